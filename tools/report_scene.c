#include "report_parts.h"

#include "../renderer/tone.h"
#include "report_colour.h"
#include "report_html.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* One radiance image of a scene; claims share it. */
struct shot {
    const char *engine, *file; /* borrowed from the claim */
    struct moments m;
};

struct scene {
    struct shot *shot;
    size_t num_shots;
    struct image *relative, *z; /* one per claim; empty for claims that could not be judged */
    size_t num_claims;
    double range;       /* of the relative maps: +-range */
    double white;       /* radiance that is shown as white */
    const char *anchor; /* the engine whose image white was taken from; NULL without images */
    bool white_capped;
};

static bool full_path(const struct page *p, const char *file, char path[8192], struct err *e)
{
    int n = snprintf(path, 8192, "%s%s", file[0] == '/' ? "" : p->dir, file);
    return n > 0 && n < 8192 ? true : err_set(e, "%.64s...: path too long", file);
}

static bool load_shot(const struct page *p, struct scene *s, const json_t *claim, const char *side,
                      struct err *e)
{
    const char *file = member_text(json_object_get(claim, "files"), side);
    for (size_t i = 0; i < s->num_shots; i++)
        if (strcmp(s->shot[i].file, file) == 0)
            return true;
    struct shot *shot = &s->shot[s->num_shots];
    char path[8192];
    if (!full_path(p, file, path, e) || !moments_read(path, &shot->m, NULL, e))
        return false;
    shot->engine = member_text(claim, side);
    shot->file = file;
    s->num_shots++;
    if (shot->m.width != s->shot[0].m.width || shot->m.height != s->shot[0].m.height)
        return err_set(e, "%s: %d x %d pixels, but %s has %d x %d", path, shot->m.width,
                       shot->m.height, s->shot[0].file, s->shot[0].m.width, s->shot[0].m.height);
    return true;
}

static bool load_map(const struct page *p, const struct scene *s, const json_t *claim,
                     const char *which, struct image *out, struct err *e)
{
    char path[8192];
    if (!full_path(p, member_text(json_object_get(claim, "files"), which), path, e) ||
        !image_read_exr(path, out, NULL, e))
        return false;
    const struct moments *m = &s->shot[0].m;
    if (out->channels != 1 || out->width != m->width || out->height != m->height)
        return err_set(e, "%s: %d x %d pixels of %d channels, not %d x %d of 1", path, out->width,
                       out->height, out->channels, m->width, m->height);
    return true;
}

/* The 98th percentile of all |relative difference|, rounded up to 1, 2 or 5 times a power of ten:
 * the noise of single pixels fills the map's range without clipping much of it. From 0.1 % to 100
 * %. */
static bool choose_range(struct scene *s, struct err *e)
{
    size_t num = 0, pixels = (size_t)s->shot[0].m.width * (size_t)s->shot[0].m.height;
    double *v = malloc(s->num_claims * pixels * sizeof *v);
    if (v == NULL)
        return err_set(e, "out of memory for the report");
    for (size_t c = 0; c < s->num_claims; c++)
        for (size_t i = 0; s->relative[c].data != NULL && i < pixels; i++)
            if (isfinite(s->relative[c].data[i]))
                v[num++] = fabs((double)s->relative[c].data[i]);
    double p98 = num > 0 ? percentile(v, num, 0.98) : 0;
    free(v);
    static const double ladder[] = {0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5};
    s->range = 1;
    for (size_t i = sizeof ladder / sizeof *ladder; i-- > 0;)
        if (p98 <= ladder[i])
            s->range = ladder[i];
    return true;
}

static bool choose_white(struct scene *s, const json_t *claim, struct err *e)
{
    const char *file = member_text(json_object_get(claim, "files"), "b");
    const struct shot *shot = s->shot;
    while (strcmp(shot->file, file) != 0)
        shot++;
    size_t pixels = (size_t)shot->m.width * (size_t)shot->m.height;
    double *v = malloc(pixels * sizeof *v);
    if (v == NULL)
        return err_set(e, "out of memory for the report");
    for (size_t i = 0; i < pixels; i++)
        v[i] = luminance(&shot->m.mean[3 * i]);
    s->white = display_white(v, pixels, &s->white_capped);
    s->anchor = shot->engine;
    free(v);
    return true;
}

static void scene_free(struct scene *s)
{
    for (size_t i = 0; i < s->num_shots; i++)
        moments_free(&s->shot[i].m);
    for (size_t i = 0; i < s->num_claims; i++) {
        if (s->relative != NULL)
            image_free(&s->relative[i]);
        if (s->z != NULL)
            image_free(&s->z[i]);
    }
    free(s->shot);
    free(s->relative);
    free(s->z);
}

static bool scene_load(const struct page *p, struct scene *s, const struct claim_ref *claim,
                       size_t num, struct err *e)
{
    *s = (struct scene){.num_claims = num};
    s->shot = calloc(2 * num, sizeof *s->shot);
    s->relative = calloc(num, sizeof *s->relative);
    s->z = calloc(num, sizeof *s->z);
    if (s->shot == NULL || s->relative == NULL || s->z == NULL) {
        err_set(e, "out of memory for the report");
        goto fail;
    }
    for (size_t i = 0; i < num; i++) {
        const json_t *json = claim[i].json;
        if (claim[i].outcome == OUTCOME_NOT_JUDGED)
            continue;
        if (!load_shot(p, s, json, "a", e) || !load_shot(p, s, json, "b", e) ||
            !load_map(p, s, json, "relative", &s->relative[i], e) ||
            !load_map(p, s, json, "z", &s->z[i], e))
            goto fail;
        if (s->anchor == NULL && !choose_white(s, json, e))
            goto fail;
    }
    if (s->num_shots > 0 && !choose_range(s, e))
        goto fail;
    return true;
fail:
    scene_free(s);
    return false;
}

void report_scale(FILE *f, int width)
{
    int aside = 264 / width, alone = 560 / width;
    fprintf(f, " style=\"--w:%d;--k:%d;--z:%d\"", width, aside > 1 ? aside : 1,
            alone > 1 ? alone : 1);
}

/* "2048 samples per pixel", "16 replicates of 256 samples per pixel", "without noise". */
static void print_observations(FILE *f, const struct moments *m)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    double sum = 0;
    for (size_t i = 0; i < pixels; i++)
        sum += m->n[i];
    double n = sum / (double)pixels;
    if (strcmp(m->unit, "exact") == 0)
        fputs("without noise", f);
    else if (strcmp(m->unit, "sample") == 0)
        fprintf(f, "%.0f samples per pixel", n);
    else if (m->spp > 0)
        fprintf(f, "%.0f replicates of %.0f samples per pixel", n, m->spp);
    else
        fprintf(f, "%.0f replicates", n);
}

static bool write_shot(struct page *p, const struct scene *s, const struct shot *shot,
                       const char *scene_name, struct err *e)
{
    const struct moments *m = &shot->m;
    size_t pixels = (size_t)m->width * (size_t)m->height, layer;
    uint8_t *rgb8 = malloc(3 * pixels);
    if (rgb8 == NULL)
        return err_set(e, "out of memory for the report");
    for (size_t i = 0; i < 3 * pixels; i++)
        rgb8[i] = tone_map(TONE_SRGB, m->mean[i] / s->white);
    bool ok = page_add_layer(p, m->width, m->height, 3, m->mean, &layer, e);
    if (ok) {
        fputs("<figure class=\"shot\" data-name=\"", p->f);
        html_text(p->f, shot->engine);
        fputs("\"", p->f);
        report_scale(p->f, m->width);
        fprintf(p->f, "><div class=\"frame\" data-layer=\"%zu\">", layer);
        fprintf(p->f, "<img width=\"%d\" height=\"%d\" alt=\"", m->width, m->height);
        html_text(p->f, scene_name);
        fputs(" as rendered by ", p->f);
        html_text(p->f, shot->engine);
        fputs("\" src=\"", p->f);
        ok = html_png(p->f, m->width, m->height, rgb8, e);
        fputs("\"></div><figcaption><b>", p->f);
        html_text(p->f, shot->engine);
        fputs("</b> ", p->f);
        print_observations(p->f, m);
        fputs("</figcaption></figure>\n", p->f);
    }
    free(rgb8);
    return ok;
}

static bool write_images(struct page *p, const struct scene *s, const char *scene_name,
                         struct err *e)
{
    fputs("<h3>The images</h3>\n<div class=\"shots\">\n", p->f);
    for (size_t i = 0; i < s->num_shots; i++)
        if (!write_shot(p, s, &s->shot[i], scene_name, e))
            return false;
    fprintf(p->f,
            "</div>\n<p class=\"caption\">All at the same exposure, so that what looks brighter is "
            "brighter: radiance %s and above is white",
            plain_number(s->white).s);
    fputs(s->white_capped ? " (7.5 times the median of " : " (the 99th percentile of ", p->f);
    html_text(p->f, s->anchor);
    fputs(s->white_capped ? ", because something much brighter fills more than 1 % of the picture)"
                          : " is shown at 80 % of white)",
          p->f);
    fputs(", then the usual sRGB curve. Each square is one pixel. If the engines agree you should "
          "see no difference but the grain.</p>\n",
          p->f);
    return true;
}

static void write_purpose(FILE *f, const json_t *claim)
{
    const char *detects = member_text(claim, "detects"), *blind = member_text(claim, "blind_to");
    if (detects == NULL && blind == NULL)
        return;
    fputs("<dl class=\"purpose\">", f);
    if (detects != NULL) {
        fputs("<div><dt>What it can detect</dt><dd>", f);
        html_text(f, detects);
        fputs("</dd></div>", f);
    }
    if (blind != NULL) {
        fputs("<div><dt>What it is blind to</dt><dd>", f);
        html_text(f, blind);
        fputs("</dd></div>", f);
    }
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
    fprintf(p->f, "<section class=\"scene\" data-white=\"%.9g\">\n<h2>", s.white);
    html_text(p->f, title != NULL ? title : name);
    fputs(" <code>", p->f);
    html_text(p->f, name);
    fputs("</code></h2>\n", p->f);
    write_purpose(p->f, purpose);

    bool ok = true;
    for (size_t i = 0; i < num; i++)
        if (claim[i].outcome == OUTCOME_NOT_JUDGED)
            report_claim_error(p, &claim[i]);
    if (s.num_shots > 0)
        ok = write_images(p, &s, name, e);
    for (size_t i = 0; ok && i < num; i++)
        if (claim[i].outcome != OUTCOME_NOT_JUDGED)
            ok = report_claim(p, &claim[i], &s.relative[i], &s.z[i], s.range, e);
    fputs("</section>\n", p->f);
    scene_free(&s);
    return ok;
}
