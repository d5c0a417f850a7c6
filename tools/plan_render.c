/* A render as jobs: cells of its picture, each with all samples of its pixels. What a pixel is depends on no other, so the parts
 * put beside each other are the picture of one render bit by bit, whatever the cells. */
#include "../renderer/cli.h"
#include "../renderer/collada.h"
#include "../renderer/fs.h"
#include "../renderer/output.h"
#include "../renderer/state.h"
#include "command_words.h"
#include "plan_kinds.h"
#include "results.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Every job says these itself. */
static const struct option_words cells_and_threads[] = {{"-p", 4}, {"--cell", 4}, {0}};

#define PRODUCT "cell.png.state"

static bool check_options(const struct options *o, struct err *e)
{
    const struct {
        bool given;
        const char *name, *why;
    } no[] = {{o->action != ACTION_RENDER, "--help and the like", "are no render"},
              {o->max_seconds > 0, "--time", "asks when all of the picture is done"},
              {o->max_error > 0, "--error", "looks at all of the picture"},
              {o->write_every > 0, "--write-every", "needs all of the picture"},
              {o->resume != NULL, "--resume", "goes on with all of the picture"},
              {o->heatmap != NULL, "--heatmap", "is made at once, without jobs"}};
    for (size_t i = 0; i < sizeof no / sizeof *no; i++)
        if (no[i].given)
            return err_set(e, "%s: cannot be cut into jobs: %s", no[i].name, no[i].why);
    return true;
}

/* As near to `parts` as whole rows of cells allow: rows of the picture as long as there are enough for 16 each, then
 * columns too. out: x y dx dy, origin at the bottom left. */
static void cell_of(const struct options *o, int parts, int k, int *num, int out[4])
{
    int width = o->cell[2], height = o->cell[3];
    int most = (height + 15) / 16, rows = parts < most ? parts : most;
    int columns = (parts + rows - 1) / rows;
    columns = columns < width ? columns : width;
    int row = k / columns, column = k % columns;
    int y0 = (int)((long long)height * row / rows),
        y1 = (int)((long long)height * (row + 1) / rows);
    int x0 = (int)((long long)width * column / columns),
        x1 = (int)((long long)width * (column + 1) / columns);
    *num = rows * columns;
    out[0] = o->cell[0] + x0;
    out[1] = o->cell[1] + y0;
    out[2] = x1 - x0;
    out[3] = y1 - y0;
}

static bool add_words(struct plan *p, int argc, char **argv, const struct options *o, int threads,
                      struct err *e)
{
    char program[4096], t[16], samples[64];
    beside_program(program, sizeof program, "pathtracer");
    snprintf(t, sizeof t, "%d", threads);
    snprintf(samples, sizeof samples, "%d:%d", o->first, o->last);
    const char *const first[] = {
        program,          "-q",    "-t",        t,      "--keep-state", "-f",
        "{out}/cell.png", "{job}", "--samples", samples};
    bool some = o->first > 0 || o->last < o->spp;
    char **word = calloc((size_t)argc, sizeof *word);
    if (word == NULL)
        return err_set(e, "out of memory");
    int num = words_kept(render_how, argc - 1, argv + 1, word);
    num = words_kept(cells_and_threads, num, word, word);
    bool ok =
        plan_run_words(p, first, (int)(sizeof first / sizeof *first) - (some ? 0 : 2), false, e) &&
        plan_run_words(p, (const char *const *)word, num, true, e);
    free(word);
    return ok;
}

bool render_plan(int argc, char **argv, int parts, struct plan *p, struct err *e)
{
    struct options o;
    if (!options_parse(argc, argv, &o, e) || !check_options(&o, e))
        return false;
    parts = o.slurm > 0 ? o.slurm : parts;
    int threads = has_word(argc, argv, "-t", "--threads") ? o.threads : 1, num = 1;
    const char *const inputs[] = {o.scene, o.camera_file, o.environment_file};
    bool ok =
        plan_begin(p, o.output[0], PRODUCT, threads, e) && add_words(p, argc, argv, &o, threads, e);
    for (size_t i = 0; ok && i < sizeof inputs / sizeof *inputs; i++)
        ok = inputs[i] == NULL || plan_input(p, inputs[i], e);
    for (int k = 0; ok && k < num; k++) {
        int cell[4];
        char text[4][16];
        const char *word[5] = {"-p"};
        cell_of(&o, parts, k, &num, cell);
        for (int i = 0; i < 4; i++) {
            snprintf(text[i], sizeof text[i], "%d", cell[i]);
            word[i + 1] = text[i];
        }
        ok = plan_job(p, word, 5, (const char *const[]){NULL}, e);
    }
    return ok;
}

/* A part, while its rows are needed. */
struct part {
    int x, y, width, height; /* in the picture, origin at the top left */
    struct state_file state; /* f NULL: not open */
};

struct gathering {
    const struct plan *plan;
    const struct options *o;
    struct identity id; /* of the whole */
    struct part *part;
    uint32_t
        num_samples; /* the most of any part: pixels of an adaptive one may have stopped before */
};

static bool open_part(struct gathering *g, int k, struct err *e)
{
    struct part *part = &g->part[k];
    const struct options *o = g->o;
    char path[PLAN_PATH + 256];
    struct identity id = g->id;
    const int cell[4] = {o->cell[0] + part->x, o->cell[1] + o->cell[3] - part->y - part->height,
                         part->width, part->height};
    plan_artefact(g->plan, k, PRODUCT, path);
    identity_cell(cell, o->width, o->height, id.cell);
    return state_open(&part->state, path, &id, part->width, part->height, o->aov, e);
}

static bool find_parts(struct gathering *g, struct err *e)
{
    const struct options *o = g->o;
    bool may_stop = o->adaptive_batch > 0 || o->pilot_tolerance >= 0;
    json_t *job = NULL;
    bool ok = true;
    for (int k = 0; ok && k < g->plan->num; k++) {
        int c[4] = {0};
        job = json_loads(g->plan->line[k], 0, NULL);
        for (size_t i = 0; i < 4; i++) {
            const char *word =
                json_string_value(json_array_get(json_object_get(job, "words"), i + 1));
            ok = ok && word != NULL && cli_int("a cell", word, 0, 65535, &c[i], e);
        }
        json_decref(job);
        g->part[k] = (struct part){.x = c[0] - o->cell[0],
                                   .y = o->cell[1] + o->cell[3] - c[1] - c[3],
                                   .width = c[2],
                                   .height = c[3]};
        if (ok && may_stop) {
            ok = open_part(g, k, e);
            if (ok && g->part[k].state.num_samples > g->num_samples)
                g->num_samples = g->part[k].state.num_samples;
            state_close(&g->part[k].state);
        }
    }
    if (!may_stop)
        g->num_samples = (uint32_t)(o->last - o->first);
    return ok;
}

/* Rows y .. y+num-1 of the picture, from all parts that have some of them. */
static bool read_band(struct gathering *g, int y, int num, struct film *band, struct err *e)
{
    for (int k = 0; k < g->plan->num; k++) {
        struct part *part = &g->part[k];
        int from = part->y > y ? part->y : y,
            to = part->y + part->height < y + num ? part->y + part->height : y + num;
        if (from >= to)
            continue;
        if (part->state.f == NULL && !open_part(g, k, e))
            return false;
        if (!state_rows(&part->state, from - part->y, to - from, band, part->x, from - y, e))
            return false;
        if (to == part->y + part->height)
            state_close(&part->state);
    }
    return true;
}

/* All rows by bands into the pictures; with --keep-state one band is all of it, which must fit into memory. */
static bool write_whole(struct gathering *g, const struct output *out, struct err *e)
{
    const struct options *o = g->o;
    int width = o->cell[2], height = o->cell[3];
    int each = o->keep_state || height < IMAGE_BAND ? height : IMAGE_BAND;
    struct film band = {0};
    struct output_writer *w = output_open(out, width, height, g->num_samples, NULL, e);
    if (w == NULL)
        return false;
    bool ok = film_alloc(&band, width, each, o->aov, e);
    if (ok && o->keep_state && o->pilot_tolerance >= 0) {
        band.target = calloc((size_t)width * (size_t)height, sizeof *band.target);
        ok = band.target != NULL || err_set(e, "out of memory");
    }
    film_set_sampler(&band, (enum sampler_kind)o->sampler);
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
        char path[STATE_PATH];
        band.num_samples = g->num_samples;
        ok = output_state_path(out, NULL, path, e) && state_write(path, &g->id, &band, e);
    }
    film_free(&band);
    return ok;
}

int render_gather(const struct plan *p, int argc, char **argv, struct err *e)
{
    struct options o;
    struct scene scene = {0};
    struct gathering g = {.plan = p, .o = &o};
    struct output out = {.opt = &o, .id = &g.id, .scene = &scene};
    char **word = calloc((size_t)argc + 1, sizeof *word);
    g.part = calloc((size_t)p->num, sizeof *g.part);
    bool ok = (word != NULL && g.part != NULL) || err_set(e, "out of memory");
    /* As a render here would have been asked for. */
    static const struct option_words slurm[] = {{"--slurm", 1}, {0}};
    if (ok)
        out.argc = words_kept(slurm, argc, argv, word);
    out.argv = word;
    ok = ok && options_parse(out.argc, word, &o, e) && identity_make(&o, &g.id, e) &&
         collada_load(o.scene, (enum dialect)o.dialect, &scene, e);
    if (ok)
        snprintf(out.accel, sizeof out.accel, "%s: in %d parts", bvh_kind_names[o.accel], p->num);
    ok = ok && find_parts(&g, e) && write_whole(&g, &out, e);
    for (int k = 0; g.part != NULL && k < p->num; k++)
        state_close(&g.part[k].state);
    for (int i = 0; ok && i < o.num_outputs; i++)
        printf("%s\n", o.output[i]);
    scene_free(&scene);
    free(g.part);
    free(word);
    return ok ? EXIT_EQUIVALENT : EXIT_NOT_JUDGED;
}
