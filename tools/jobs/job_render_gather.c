/* Assembles the parts of a render (job_render.c), 16 rows at a time, from the sums in their state files. */
#include "renderer/base/cli.h"
#include "renderer/collada/collada.h"
#include "renderer/base/cli_rewrite.h"
#include "renderer/pathtracer/output.h"
#include "renderer/pathtracer/checkpoint.h"
#include "job_kinds.h"
#include "tools/base/text.h"
#include "tools/results/results.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What one job rendered, with its state file while rows of it are needed. */
struct part {
    int x, y, width, height;  /* in the image, origin at the top left */
    int first, last;          /* its samples */
    struct checkpoint *state; /* NULL: not yet open, or done */
};

struct gathering {
    const struct plan *plan;
    const struct options *o;
    struct render_id id; /* of the whole */
    struct part *part;
    bool ranges;
    struct film more; /* ranges: the band of a range to be added */
    uint32_t
        num_samples; /* the most of any part: pixels of an adaptive one may have stopped before */
};

static bool open_part(struct gathering *g, int k, struct err *e)
{
    struct part *part = &g->part[k];
    const struct options *o = g->o;
    const struct path path = job_run_artefact(g->plan, k, plan_text(g->plan, "product"));
    struct render_id id = g->id;
    const int cell[4] = {o->cell[0] + part->x, o->cell[1] + o->cell[3] - part->y - part->height,
                         part->width, part->height};
    render_id_cell(cell, o->width, o->height, id.cell);
    id.first_sample = (uint32_t)part->first;
    part->state = calloc(1, sizeof *part->state);
    if (part->state == NULL)
        return err_set(e, "out of memory");
    return checkpoint_open(part->state, path.s, &id, part->width, part->height, o->aov, e) &&
           (o->pilot_tolerance < 0 || part->state->has_target ||
            err_set(e, "%s: its pilot has decided nothing", path.s));
}

static void close_part(struct part *part)
{
    if (part->state != NULL)
        checkpoint_close(part->state);
    free(part->state);
    part->state = NULL;
}

static bool no_job(const struct plan *p, int k, struct err *e)
{
    return err_set(e, "%s/plan.jsonl: line %d is no job that follows the one before", p->dir,
                   k + 2);
}

/* "-p X Y DX DY", and with several ranges "--samples A:B". */
static bool read_job(const struct plan *p, int k, const struct options *o, struct part *part,
                     struct err *e)
{
    int c[4] = {0}, end = 0;
    json_t *job = json_loads(p->line[k], 0, NULL), *words = json_object_get(job, "words");
    bool ok = plan_are_texts(words) && (json_array_size(words) == 5 || json_array_size(words) == 7);
    for (size_t i = 0; ok && i < 4; i++)
        ok = cli_int("a cell", json_string_value(json_array_get(words, i + 1)), 0, 65535, &c[i], e);
    *part = (struct part){.x = c[0] - o->cell[0],
                          .y = o->cell[1] + o->cell[3] - c[1] - c[3],
                          .width = c[2],
                          .height = c[3],
                          .first = o->first,
                          .last = o->last};
    if (ok && json_array_size(words) == 7) {
        const char *samples = json_string_value(json_array_get(words, 6));
        ok = sscanf(samples, "%9d:%9d%n", &part->first, &part->last, &end) == 2 &&
             samples[end] == '\0' && part->first < part->last;
    }
    json_decref(job);
    return ok || no_job(p, k, e);
}

static bool find_parts(struct gathering *g, struct err *e)
{
    const struct options *o = g->o;
    bool ok = true;
    for (int k = 0, next = o->first; ok && k < g->plan->num; k++) {
        ok = read_job(g->plan, k, o, &g->part[k], e) &&
             (g->part[k].first == next || no_job(g->plan, k, e));
        next = g->part[k].last < o->last ? g->part[k].last : o->first;
    }
    g->ranges = ok && g->part[0].last < o->last;
    g->num_samples = (uint32_t)(o->last - o->first);
    /* Without ranges, the states of an adaptive render say how many sample numbers were seen; a range ends early
     * only once all its pixels have stopped, so that with ranges all of them count as seen. */
    if (!ok || g->ranges || (o->adaptive_batch == 0 && o->pilot_tolerance < 0))
        return ok;
    g->num_samples = 0;
    for (int k = 0; ok && k < g->plan->num; k++) {
        ok = open_part(g, k, e);
        if (ok && g->part[k].state->num_samples > g->num_samples)
            g->num_samples = g->part[k].state->num_samples;
        close_part(&g->part[k]);
    }
    return ok;
}

/* Has every pixel in num rows of the part, from the band's row y on, as many samples as it should? With the
 * assignment's adaptive rule that number is not known beforehand, and nothing is checked. */
static bool check_counts(const struct gathering *g, const struct part *part, const struct film *f,
                         int y, int num, struct err *e)
{
    for (int row = y; row < y + num && g->o->adaptive_batch == 0; row++)
        for (int x = part->x; x < part->x + part->width; x++) {
            size_t p = (size_t)row * (size_t)f->m.width + (size_t)x;
            double last = part->last;
            if (f->target != NULL && f->target[p] < last)
                last = f->target[p];
            double n = last > part->first ? last - part->first : 0;
            if (f->m.n[p] != n)
                return err_set(e, "%s: has not the samples %d:%d", part->state->path, part->first,
                               part->last);
        }
    return true;
}

/* Adds num rows of a range to the band, which has the ranges before it, from its row y on. The pilot's decisions
 * must be the same in every range. */
static bool add_rows(struct gathering *g, const struct part *part, struct film *band, int y,
                     int num, struct err *e)
{
    for (int row = y; row < y + num; row++) {
        size_t p = (size_t)row * (size_t)band->m.width + (size_t)part->x;
        if (band->target != NULL && memcmp(band->target + p, g->more.target + p,
                                           (size_t)part->width * sizeof *band->target) != 0)
            return err_set(e, "%s: its pilot decided otherwise than that of the range before",
                           part->state->path);
        if (!film_merge(band, &g->more, p, part->width, e))
            return err_prefix(e, "%s", part->state->path);
    }
    return true;
}

/* Reads rows y .. y+num-1 of the image from all parts that have some of them, the ranges of a cell in the order of
 * their samples, as planned. */
static bool read_band(struct gathering *g, int y, int num, struct film *band, struct err *e)
{
    for (int k = 0; k < g->plan->num; k++) {
        struct part *part = &g->part[k];
        int from = part->y > y ? part->y : y,
            to = part->y + part->height < y + num ? part->y + part->height : y + num;
        if (from >= to)
            continue;
        bool is_first = part->first == g->o->first;
        struct film *into = is_first ? band : &g->more;
        if ((part->state == NULL && !open_part(g, k, e)) ||
            !checkpoint_rows(part->state, from - part->y, to - from, into, part->x, from - y, e) ||
            !check_counts(g, part, into, from - y, to - from, e) ||
            (!is_first && !add_rows(g, part, band, from - y, to - from, e)))
            return false;
        checkpoint_close(part->state);
        if (to == part->y + part->height)
            close_part(part);
    }
    return true;
}

static bool band_alloc(const struct options *o, int height, struct film *f, struct err *e)
{
    if (!film_alloc(f, o->cell[2], height, o->aov, e))
        return false;
    film_set_sampler(f, (enum sampler_kind)o->sampler);
    if (o->pilot_tolerance < 0)
        return true;
    f->target = calloc((size_t)o->cell[2] * (size_t)height, sizeof *f->target);
    return f->target != NULL || err_set(e, "out of memory");
}

/* Writes the images band by band; with --keep-state in a single band, which must fit into memory. */
static bool write_whole(struct gathering *g, const struct output *out, struct err *e)
{
    const struct options *o = g->o;
    int width = o->cell[2], height = o->cell[3];
    int each = o->keep_state || height < IMAGE_BAND ? height : IMAGE_BAND;
    struct film band = {0};
    struct output_writer *w = output_open(out, width, height, g->num_samples, NULL, e);
    if (w == NULL)
        return false;
    bool ok = band_alloc(o, each, &band, e) && (!g->ranges || band_alloc(o, each, &g->more, e));
    for (int y = 0; ok && y < height; y += each) {
        band.m.height = height - y < each ? height - y : each;
        ok = read_band(g, y, band.m.height, &band, e) && output_rows(w, &band, e);
    }
    if (ok) {
        ok = output_close(w, e);
    } else {
        output_abandon(w);
    }
    if (ok && o->keep_state) {
        char path[CHECKPOINT_PATH];
        band.num_samples = g->num_samples;
        ok = output_state_path(out, NULL, path, e) && checkpoint_write(path, &g->id, &band, e);
    }
    film_free(&band);
    film_free(&g->more);
    return ok;
}

/* The sample ranges of the first cell, which all share: "0:4,4:9", to free(). NULL: out of memory. */
static char *ranges_text(const struct gathering *g)
{
    enum { RANGE = 24 };
    size_t size = (size_t)g->plan->num * RANGE + 1;
    char *text = calloc(size, 1);
    for (const struct part *p = g->part; text != NULL; p++) {
        text_append(text, size, "%s%d:%d", text[0] != '\0' ? "," : "", p->first, p->last);
        if (p->last == g->o->last)
            break;
    }
    return text;
}

bool job_render_gather_quietly(const struct plan *p, int argc, char **argv, struct err *e)
{
    struct options o;
    struct scene scene = {0};
    struct gathering g = {.plan = p, .o = &o};
    struct output out = {.opt = &o, .id = &g.id, .scene = &scene};
    char **word = calloc((size_t)argc + 1, sizeof *word), *ranges = NULL;
    g.part = calloc((size_t)p->num, sizeof *g.part);
    bool ok = (word != NULL && g.part != NULL) || err_set(e, "out of memory");
    /* The command of the same render without Slurm. */
    static const struct option_words slurm[] = {{"--slurm", 1}, {0}};
    if (ok)
        out.argc = cli_rewrite_kept(slurm, argc, argv, word);
    out.argv = word;
    ok = ok && options_parse(out.argc, word, &o, e) &&
         collada_load(o.scene, (enum dialect)o.dialect, &scene, e) &&
         render_id_make(&o, &scene, &g.id, e) && find_parts(&g, e);
    if (ok)
        snprintf(out.accel, sizeof out.accel, "%s: in %d parts", bvh_kind_names[o.accel], p->num);
    if (ok && g.ranges)
        ok = (ranges = ranges_text(&g)) != NULL || err_set(e, "out of memory");
    out.ranges = ranges;
    ok = ok && write_whole(&g, &out, e);
    for (int k = 0; g.part != NULL && k < p->num; k++)
        close_part(&g.part[k]);
    scene_free(&scene);
    free(ranges);
    free(g.part);
    free(word);
    return ok;
}

int job_render_gather(const struct plan *p, int argc, char **argv, struct err *e)
{
    if (!job_render_gather_quietly(p, argc, argv, e))
        return EXIT_NOT_JUDGED;
    struct options o;
    if (!options_parse(argc, argv, &o, e))
        return EXIT_NOT_JUDGED;
    for (int i = 0; i < o.num_outputs; i++)
        printf("%s\n", o.output[i]);
    return EXIT_EQUIVALENT;
}
