/* A student's page: what was asked, what was seen, where. One file, no script, nothing from elsewhere. Checks that
 * are not visible now are left out: the page may be handed to the student. The reference is not shown, only how the
 * student's image differs from it. */
#include "student_page.h"

#include "renderer/base/fs.h"
#include "renderer/image/tone.h"
#include "tools/images/image_file.h"
#include "tools/html/html.h"
#include "tools/results/results.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void paragraph(FILE *f, const char *label, const char *text, const char *class)
{
    if (text[0] != '\0')
        html_print(f, "<p class=\"%s\"><b>%s</b> %s</p>\n", class, label, text);
}

/* Codes as they are, floats by sRGB. */
static uint8_t *codes(const struct image_file *pic)
{
    size_t n = 3 * (size_t)pic->width * (size_t)pic->height;
    uint8_t *rgb8 = malloc(n);
    bool coded = pic->info.type == IMAGE_INT8 || pic->info.type == IMAGE_INT16;
    for (size_t i = 0; rgb8 != NULL && i < n; i++)
        rgb8[i] = coded ? (uint8_t)lround(255 * (double)pic->rgb[i])
                        : tone_map(TONE_SRGB, (double)pic->rgb[i]);
    return rgb8;
}

static bool write_png(FILE *f, int width, int height, const uint8_t *rgb8, struct err *e)
{
    uint8_t *bytes;
    size_t size;
    if (!image_encode_png(width, height, rgb8, &bytes, &size, e))
        return false;
    fputs("data:image/png;base64,", f);
    html_base64(f, bytes, size);
    free(bytes);
    return true;
}

/* The tile with its neighbours, enlarged: three by three of them, fewer at the rim. Moves rows of rgb8 to its front. */
static bool show_crop(FILE *f, const struct image_file *pic, uint8_t *rgb8, const json_t *tile,
                      struct err *e)
{
    if (json_array_size(tile) != 2)
        return true;
    int x = (int)json_number_value(json_array_get(tile, 0)) - GRADE_TILE,
        y = (int)json_number_value(json_array_get(tile, 1)) - GRADE_TILE;
    int right = x + 3 * GRADE_TILE < pic->width ? x + 3 * GRADE_TILE : pic->width,
        bottom = y + 3 * GRADE_TILE < pic->height ? y + 3 * GRADE_TILE : pic->height;
    x = x > 0 ? x : 0;
    y = y > 0 ? y : 0;
    int width = right - x, height = bottom - y;
    if (width <= 0 || height <= 0)
        return true;
    for (int row = 0; row < height; row++)
        memmove(rgb8 + 3 * (size_t)(row * width),
                rgb8 + 3 * ((size_t)(y + row) * (size_t)pic->width + (size_t)x), 3 * (size_t)width);
    fprintf(f, "<figure><img width=\"%d\" alt=\"\" src=\"", 12 * width);
    bool ok = write_png(f, width, height, rgb8, e);
    fprintf(f,
            "\"><figcaption>of it, pixels %d,%d to %d,%d, around what differs "
            "most</figcaption></figure>\n",
            x, y, right - 1, bottom - 1);
    return ok;
}

static bool show_image(FILE *f, const char *path, const char *name, const json_t *tile,
                       struct err *e)
{
    struct image_file pic;
    struct err why;
    if (!image_file_read(path, &pic, &why)) /* what is wrong with it has been said */
        return !err_is_of_memory(&why) || err_set(e, "%s", why.msg);
    uint8_t *rgb8 = codes(&pic);
    bool ok = rgb8 != NULL || err_set(e, "out of memory");
    fprintf(f, "<figure><img width=\"%d\" alt=\"\" src=\"", GRADE_SHOWN);
    ok = ok && write_png(f, pic.width, pic.height, rgb8, e);
    html_print(f, "\"><figcaption>%s, yours</figcaption></figure>\n", name);
    ok = ok && show_crop(f, &pic, rgb8, tile, e);
    free(rgb8);
    image_file_free(&pic);
    return ok;
}

/* The chance that another run gets other points, of a check or of all of them. */
static void show_chance(FILE *f, double chance, bool moves, const char *here)
{
    fputs("<p class=\"where\">", f);
    if (moves)
        fputs("Between none and all, points move a little with the noise of each run.", f);
    else if (chance >= 1e-4)
        fprintf(f, "Another run of the same program gets other points%s with a chance of %.2g %%.",
                here, 100 * chance);
    else
        fprintf(f, "Another run of the same program gets the same points%s, but for 1 in 10 000.",
                here);
    fputs("</p>\n", f);
}

static const json_t *image_of(const json_t *grade, const char *name)
{
    size_t i;
    json_t *p;
    json_array_foreach(json_object_get(grade, "pictures"), i, p)
    {
        if (strcmp(member_or_empty(p, "name"), name) == 0)
            return p;
    }
    return NULL;
}

static bool show_check(FILE *f, const char *dir, const json_t *grade, const json_t *c,
                       struct err *e)
{
    bool full = member_number(c, "share") >= 1;
    html_print(f, "<section><h3>%s <span class=\"%s\">%.2f of %g</span></h3>\n",
               member_text(c, "title"), full ? "full" : "lost", member_number(c, "points"),
               member_number(c, "of"));
    paragraph(f, "Expected:", member_or_empty(c, "expected"), "");
    paragraph(f, "Seen:", member_or_empty(c, "seen"), "");
    paragraph(f, "Explained by what you were given, no points lost for it:",
              member_or_empty(c, "accepted"), "");
    double share = member_number(c, "share");
    show_chance(f, member_number(c, "chance"), share > 0 && share < 1, " here");
    const json_t *p = image_of(grade, member_or_empty(c, "picture"));
    bool ok = true;
    if (!full) {
        paragraph(f, "Hint:", member_or_empty(c, "hint"), "");
        paragraph(f, "Where:", member_or_empty(c, "where"), "where");
        if (json_is_string(json_object_get(p, "sha256"))) {
            const struct path path =
                fs_path("%s/%s/%s", dir, member_or_empty(grade, "id"), member_or_empty(p, "file"));
            ok = show_image(f, path.s, member_or_empty(p, "name"), json_object_get(c, "tile"), e);
            grade_plot_difference(f, c, member_number(p, "width"), member_number(p, "height"));
            grade_plot_intervals(f, c);
        }
    }
    fputs("</section>\n", f);
    return ok;
}

/* The named bug, or that there is no name. */
static void show_bug(FILE *f, const json_t *diagnosis)
{
    const json_t *named = json_object_get(diagnosis, "named");
    size_t i;
    json_t *b;
    const char *finding = member_or_empty(diagnosis, "finding");
    if (strcmp(finding, "unknown") == 0)
        fputs(
            "<p>The images differ from the right ones in a way that no known bug explains: different, cause unknown.</p>\n",
            f);
    if (json_array_size(named) == 0)
        return;
    fprintf(f, "<p>This looks like %s:</p><ul>\n",
            json_array_size(named) > 1 ? "one of these bugs" : "a known bug");
    json_array_foreach(named, i, b)
    {
        html_print(f, "<li>%s <span class=\"where\">(%s)</span></li>\n", member_text(b, "bug"),
                   member_text(b, "where"));
    }
    fputs("</ul>\n", f);
}

bool student_page(FILE *f, const char *dir, const json_t *grade, struct err *e)
{
    size_t i;
    json_t *p, *c;
    bool ok = true, left_out = false;
    html_page_open(f, member_or_empty(grade, "id"), NULL, 0);
    html_print(f, "<div class=\"grade\">\n<h1>%s: %.2f of %g points</h1>\n<p>%s</p>\n",
               member_text(grade, "id"), member_number(grade, "points"), member_number(grade, "of"),
               member_text(grade, "rubric"));
    if (member_or_empty(grade, "trouble")[0] == '\0' &&
        strcmp(member_or_empty(grade, "kind"), "images") != 0)
        show_chance(f, member_number(grade, "chance"), member_number(grade, "chance") >= 1, "");
    paragraph(f, "Could not be graded:", member_or_empty(grade, "trouble"), "lost");
    paragraph(f, "All of it:", member_or_empty(grade, "wrong"), "lost");
    show_bug(f, json_object_get(grade, "diagnosis"));
    fputs("<table>\n", f);
    json_array_foreach(json_object_get(grade, "parts"), i, p)
    {
        html_print(f, "<tr><td>%s</td><td>%s</td><td class=\"num\">%.2f</td><td>of %g</td></tr>\n",
                   member_text(p, "number"), member_text(p, "title"), member_number(p, "points"),
                   member_number(p, "of"));
    }
    fputs("</table>\n", f);
    json_array_foreach(json_object_get(grade, "checks"), i, c)
    {
        if (strcmp(member_or_empty(c, "visibility"), "visible") == 0)
            ok = ok && show_check(f, dir, grade, c, e);
        else
            left_out = true;
    }
    if (left_out)
        fputs("<p>Some checks are not shown yet.</p>\n", f);
    fputs("</div>\n", f);
    html_page_close(f);
    return ok;
}
