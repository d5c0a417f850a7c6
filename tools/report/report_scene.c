/* A scene on the page: its images, which its claims share, and its claims. */
#include "report_internal.h"

#include "renderer/base/fs.h"
#include "tools/html/plot_colour.h"
#include "tools/images/luminance.h"
#include "tools/html/html.h"
#include "reference/suite/engine_table.h"

#include <stdlib.h>
#include <string.h>

/* One radiance image of a scene; claims share it. */
struct shot {
    const char *engine, *file; /* borrowed from the claim */
    struct moments m;
    size_t layer; /* its number on the page */
};

struct scene {
    struct shot *shot;
    size_t num_shots;
    double white;       /* radiance that is shown as white */
    const char *anchor; /* the engine whose image white was taken from; NULL without images */
    bool white_capped;
};

static struct path full_path(const struct page *p, const char *file)
{
    return fs_path("%s%s", file[0] == '/' ? "" : p->dir, file);
}

static bool load_shot(struct page *p, struct scene *s, const json_t *claim, const char *side,
                      struct err *e)
{
    const char *file = member_text(json_object_get(claim, "files"), side);
    for (size_t i = 0; i < s->num_shots; i++)
        if (strcmp(s->shot[i].file, file) == 0)
            return true;
    struct shot *shot = &s->shot[s->num_shots];
    const struct path path = full_path(p, file);
    if (!moments_read(path.s, &shot->m, NULL, e))
        return false;
    shot->engine = member_text(claim, side);
    shot->file = file;
    s->num_shots++;
    if (shot->m.width != s->shot[0].m.width || shot->m.height != s->shot[0].m.height)
        return err_set(e, "%s: %d x %d pixels, but %s has %d x %d", path.s, shot->m.width,
                       shot->m.height, s->shot[0].file, s->shot[0].m.width, s->shot[0].m.height);
    return report_pixel_data_add(p, path.s, &shot->m, &shot->layer, e);
}

/* The order of images, so that keys 1, 2, .. mean the same in every scene: ours, the references, the rest. */
static int rank_of(const struct shot *s)
{
    static const char *const order[] = {"pathtracer", ENGINES_WITH_GOLDENS(ENGINE_WORD) "truth",
                                        NULL};
    int rank = 0;
    while (order[rank] != NULL && strcmp(s->engine, order[rank]) != 0)
        rank++;
    return rank;
}

static void order_shots(struct scene *s)
{
    for (size_t i = 1; i < s->num_shots; i++)
        for (size_t k = i; k > 0 && rank_of(&s->shot[k]) < rank_of(&s->shot[k - 1]); k--) {
            struct shot swap = s->shot[k];
            s->shot[k] = s->shot[k - 1];
            s->shot[k - 1] = swap;
        }
}

/* The loaded image of one side of a claim. */
static const struct shot *shot_of(const struct scene *s, const json_t *claim, const char *side)
{
    const char *file = member_text(json_object_get(claim, "files"), side);
    const struct shot *shot = s->shot;
    while (strcmp(shot->file, file) != 0)
        shot++;
    return shot;
}

static bool choose_white(struct scene *s, const json_t *claim, struct err *e)
{
    const struct shot *shot = shot_of(s, claim, "b");
    size_t pixels = (size_t)shot->m.width * (size_t)shot->m.height;
    double *v = malloc(pixels * sizeof *v);
    if (v == NULL)
        return err_set(e, "out of memory for the report");
    for (size_t i = 0; i < pixels; i++)
        v[i] = luminance(shot->m.mean + 3 * i);
    s->white = plot_display_white(v, pixels, &s->white_capped);
    s->anchor = shot->engine;
    free(v);
    return true;
}

static void scene_free(struct scene *s)
{
    for (size_t i = 0; i < s->num_shots; i++)
        moments_free(&s->shot[i].m);
    free(s->shot);
}

static bool scene_load(struct page *p, struct scene *s, const struct claim_ref *claim, size_t num,
                       struct err *e)
{
    *s = (struct scene){0};
    s->shot = calloc(2 * num, sizeof *s->shot);
    bool ok = s->shot != NULL || err_set(e, "out of memory for the report");
    for (size_t i = 0; ok && i < num; i++) {
        const json_t *json = claim[i].json;
        if (claim[i].outcome == OUTCOME_NOT_JUDGED)
            continue;
        ok = load_shot(p, s, json, "a", e) && load_shot(p, s, json, "b", e);
        if (ok && s->anchor == NULL)
            ok = choose_white(s, json, e);
    }
    if (ok)
        order_shots(s);
    else
        scene_free(s);
    return ok;
}

/* "2048 samples per pixel", "16 replicates of 256 samples per pixel", "without noise"; a single image has no n. */
static void print_observations(FILE *f, const struct moments *m)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    double sum = 0;
    for (size_t i = 0; i < pixels; i++)
        sum += m->n[i];
    double n = sum / (double)pixels;
    if (moments_is_exact(m))
        fputs("without noise", f);
    else if (moments_noise_is_unknown(m))
        fputs("one image, its noise estimated", f);
    else if (strcmp(m->unit, "sample") == 0)
        fprintf(f, "%.0f samples per pixel", n);
    else if (m->spp > 0)
        fprintf(f, "%.0f replicates of %.0f samples per pixel", n, m->spp);
    else
        fprintf(f, "%.0f replicates", n);
}

/* The list of images that the page's script replaces by a viewer. */
static void write_images(struct page *p, const struct scene *s)
{
    const struct moments *m = &s->shot[0].m;
    fprintf(p->f,
            "<h3>The images</h3>\n<div class=\"viewer\" data-width=\"%d\" "
            "data-height=\"%d\">\n<ul class=\"shots\">\n",
            m->width, m->height);
    for (size_t i = 0; i < s->num_shots; i++) {
        html_print(p->f, "<li data-layer=\"%zu\" data-name=\"%s\"><b>%s</b> <span>",
                   s->shot[i].layer, s->shot[i].engine, s->shot[i].engine);
        print_observations(p->f, &s->shot[i].m);
        fputs("</span></li>\n", p->f);
    }
    fprintf(p->f,
            "</ul>\n</div>\n<p class=\"caption\">All at the same exposure, so that what looks "
            "brighter is brighter: at 0 stops radiance %s and above is white",
            html_number(s->white).s);
    fputs(s->white_capped ? " (7.5 times the median of " : " (the 99th percentile of ", p->f);
    html_text(p->f, s->anchor);
    fputs(s->white_capped ? ", because something much brighter fills more than 1 % of the image)"
                          : " is shown at 80 % of white)",
          p->f);
    fputs(", then the sRGB curve. A frame smaller than its image shows means. Values are exact to ",
          p->f);
    fprintf(p->f, "1/%d of their own standard error or a millionth of themselves.</p>\n",
            p->folded ? 4 : 16);
}

static void write_purpose(FILE *f, const json_t *claim)
{
    const char *detects = member_text(claim, "detects"), *blind = member_text(claim, "blind_to");
    if (detects == NULL && blind == NULL)
        return;
    fputs("<dl class=\"purpose\">", f);
    if (detects != NULL)
        html_print(f, "<div><dt>What it can detect</dt><dd>%s</dd></div>", detects);
    if (blind != NULL)
        html_print(f, "<div><dt>What it is blind to</dt><dd>%s</dd></div>", blind);
    fputs("</dl>\n", f);
}

bool report_scene(struct page *p, const struct claim_ref *claim, size_t num, struct err *e)
{
    struct scene s;
    if (!scene_load(p, &s, claim, num, e))
        return false;
    const char *name = member_text(claim[0].json, "scene"), *title = NULL;
    const json_t *purpose = claim[0].json;
    for (size_t i = 0; i < num; i++) {
        if (title == NULL)
            title = member_text(claim[i].json, "title");
        if (member_text(purpose, "detects") == NULL)
            purpose = claim[i].json;
    }
    html_print(p->f,
               "<section class=\"scene\" data-white=\"%.9g\" data-scene=\"%s\">\n<h2>%s "
               "<code>%s</code>",
               s.white, name, title != NULL ? title : name, name);
    fputs(p->folded ? "<a class=\"up\" href=\"#table\">↑ all claims</a></h2>\n" : "</h2>\n", p->f);
    write_purpose(p->f, purpose);

    for (size_t i = 0; i < num; i++)
        if (claim[i].outcome == OUTCOME_NOT_JUDGED)
            report_claim_error(p, &claim[i]);
    if (s.num_shots > 0)
        write_images(p, &s);
    bool ok = true;
    for (size_t i = 0; ok && i < num; i++) {
        if (claim[i].outcome == OUTCOME_NOT_JUDGED)
            continue;
        const struct shot *a = shot_of(&s, claim[i].json, "a"),
                          *b = shot_of(&s, claim[i].json, "b");
        ok = report_claim(p, &claim[i], &(struct claim_side){&a->m, a->layer},
                          &(struct claim_side){&b->m, b->layer}, s.white, e);
    }
    fputs("</section>\n", p->f);
    scene_free(&s);
    return ok;
}
