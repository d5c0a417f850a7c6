/* The page's matrix: a row for each scene, a column for each reference. */
#include "report_internal.h"

#include "reference/suite/engine_table.h"
#include "renderer/base/fs.h"
#include "renderer/image/tone.h"
#include "tools/html/html.h"
#include "tools/html/plot_colour.h"
#include "tools/images/luminance.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_COLUMNS = 12, THUMBNAIL = 48 };

static bool is_same_scene(const struct claim_ref *a, const struct claim_ref *b)
{
    return strcmp(member_text(a->json, "scene"), member_text(b->json, "scene")) == 0;
}

static bool is_first_of_scene(const struct claim_ref *claim, size_t i)
{
    size_t k = 0;
    while (!is_same_scene(&claim[k], &claim[i]))
        k++;
    return k == i;
}

static const char *tested_program(const struct claim_ref *claim, size_t num)
{
    static const char ours[] = "pathtracer";
    for (size_t i = 0; i < num; i++) {
        const char *a = member_text(claim[i].json, "a");
        if (strncmp(a, ours, sizeof ours - 1) != 0 && strcmp(a, "truth") != 0 &&
            engine_with_goldens(a) == NULL)
            return a;
    }
    return ours;
}

static bool is_of(const struct claim_ref *c, const char *program)
{
    return strcmp(member_text(c->json, "a"), program) == 0;
}

/* 8-bit sRGB of box means, at most THUMBNAIL pixels wide and high, to free(); NULL if out of memory. */
static uint8_t *shrink(const struct moments *m, int *width, int *height)
{
    const int most = m->width > m->height ? m->width : m->height,
              step = most > THUMBNAIL ? (most + THUMBNAIL - 1) / THUMBNAIL : 1;
    const size_t pixels = (size_t)m->width * (size_t)m->height;
    double *grey = malloc(pixels * sizeof *grey);
    *width = m->width / step;
    *height = m->height / step;
    uint8_t *rgb8 = malloc(3 * (size_t)*width * (size_t)*height + 1);
    for (size_t i = 0; grey != NULL && i < pixels; i++)
        grey[i] = luminance(m->mean + 3 * i);
    bool capped;
    const double white = grey != NULL ? plot_display_white(grey, pixels, &capped) : 1;
    free(grey);
    for (int i = 0; rgb8 != NULL && i < 3 * *width * *height; i++) {
        const int c = i % 3, x = i / 3 % *width * step, y = i / 3 / *width * step;
        double sum = 0;
        for (int k = 0; k < step * step; k++)
            sum += m->mean[3 * (size_t)((y + k / step) * m->width + x + k % step) + (size_t)c];
        rgb8[i] = tone_map(TONE_SRGB, sum / (step * step) / white);
    }
    return rgb8;
}

static void write_thumbnail(struct page *p, const json_t *claim)
{
    const char *file = member_text(json_object_get(claim, "files"), "a");
    struct moments m = {0};
    struct err ignored;
    int width = 0, height = 0;
    size_t size;
    uint8_t *bytes = NULL;
    if (file == NULL ||
        !moments_read(fs_path("%s%s", file[0] == '/' ? "" : p->dir, file).s, &m, NULL, &ignored))
        return;
    uint8_t *rgb8 = shrink(&m, &width, &height);
    moments_free(&m);
    if (rgb8 != NULL && image_encode_png(width, height, rgb8, &bytes, &size, &ignored)) {
        fprintf(p->f, "<img width=\"%d\" height=\"%d\" alt=\"\" src=\"data:image/png;base64,",
                width, height);
        html_base64(p->f, bytes, size);
        fputs("\">", p->f);
        free(bytes);
    }
    free(rgb8);
}

static void write_cell(FILE *f, const struct claim_ref *c)
{
    static const char *const mark[] = {"!", "✗", "?", "✓"};
    static const char *const words[] = {"not judged", "wrong", "undecided", "as it should be"};
    const bool judged = c->outcome != OUTCOME_NOT_JUDGED;
    fprintf(f, "<td class=\"num%s\"><a href=\"#claim-%zu\"><span aria-hidden=\"true\">%s</span>",
            c->outcome == OUTCOME_AS_EXPECTED ? "" : " wrong", c->index, mark[c->outcome]);
    html_print(f, "<span class=\"unseen\">%s, </span> ", words[c->outcome]);
    if (judged)
        fputs(html_percent_column(member_number(c->json, "difference")).s, f);
    if (!judged || strcmp(member_text(c->json, "verdict"), "EQUIVALENT") != 0)
        html_print(f, "<br><small>%s</small>",
                   judged ? member_text(c->json, "verdict") : "NOT JUDGED");
    fputs("</a></td>", f);
}

static void write_row(struct page *p, const struct claim_ref *claim, size_t num,
                      const struct claim_ref *first, const char *program, const char *const *column,
                      size_t num_columns, bool has_others)
{
    size_t others = 0, good = 0;
    fputs("<tr><td class=\"thumb\">", p->f);
    for (size_t i = 0; i < num; i++)
        if (is_same_scene(&claim[i], first) && claim[i].outcome != OUTCOME_NOT_JUDGED) {
            write_thumbnail(p, claim[i].json);
            break;
        }
    fprintf(p->f, "</td><th scope=\"row\"><a href=\"#claim-%zu\">", first->index);
    html_name(p->f, member_text(first->json, "scene"));
    fputs("</a></th>", p->f);
    for (size_t k = 0; k < num_columns; k++) {
        const struct claim_ref *c = NULL;
        for (size_t i = 0; i < num && c == NULL; i++)
            if (is_same_scene(&claim[i], first) && is_of(&claim[i], program) &&
                strcmp(member_text(claim[i].json, "b"), column[k]) == 0)
                c = &claim[i];
        if (c != NULL)
            write_cell(p->f, c);
        else
            fputs("<td></td>", p->f);
    }
    for (size_t i = 0; i < num; i++)
        if (is_same_scene(&claim[i], first) && !is_of(&claim[i], program)) {
            others++;
            good += claim[i].outcome == OUTCOME_AS_EXPECTED;
        }
    if (others == 0)
        fputs(has_others ? "<td></td></tr>\n" : "</tr>\n", p->f);
    else if (good == others)
        fprintf(p->f, "<td class=\"num\">✓ %zu</td></tr>\n", others);
    else
        fprintf(p->f, "<td class=\"num wrong\">✗ %zu of %zu</td></tr>\n", others - good, others);
}

void report_matrix(struct page *p, const struct claim_ref *claim, size_t num)
{
    const char *column[MOST_COLUMNS], *program = tested_program(claim, num);
    size_t num_columns = 0, scenes = 0;
    bool has_others = false, has_mistakes = false;
    for (size_t i = 0; i < num; i++) {
        const char *b = member_text(claim[i].json, "b");
        size_t k = 0;
        while (k < num_columns && strcmp(column[k], b) != 0)
            k++;
        scenes += is_first_of_scene(claim, i);
        has_others = has_others || !is_of(&claim[i], program);
        has_mistakes =
            has_mistakes || strcmp(member_or_empty(claim[i].json, "expected"), "DIFFERENT") == 0;
        if (is_of(&claim[i], program) && k == num_columns && num_columns < MOST_COLUMNS)
            column[num_columns++] = b;
    }
    if (scenes < 2 || num_columns == 0)
        return;
    html_print(p->f,
               "<section id=\"matrix\">\n<h2>%s, scene by scene</h2>\n<div class=\"wide\" "
               "tabindex=\"0\" role=\"region\" aria-label=\"Scenes by references\">\n<table>\n"
               "<thead><tr><th><span class=\"unseen\">image</span></th><th>Scene</th>",
               program);
    for (size_t k = 0; k < num_columns; k++)
        html_print(p->f, "<th class=\"num\">against %s</th>", column[k]);
    fprintf(p->f, "%s</tr></thead>\n<tbody>\n", has_others ? "<th class=\"num\">others</th>" : "");
    for (size_t i = 0; i < num; i++)
        if (is_first_of_scene(claim, i))
            write_row(p, claim, num, &claim[i], program, column, num_columns, has_others);
    fprintf(
        p->f,
        "</tbody>\n</table>\n</div>\n<p class=\"caption\">✓ as it should be, ✗ not, ? undecided, "
        "! not judged. The number is how much brighter the image is, in %%. Without a word below it "
        "the two are EQUIVALENT, the image and all tiles. %s%sA cell leads to its "
        "evidence.</p>\n</section>\n",
        has_mistakes ? "Deliberate mistakes must be DIFFERENT. " : "",
        has_others ? "<b>Others</b>: comparisons of other programs on the scene. " : "");
}
