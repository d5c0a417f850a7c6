/* A render as jobs: cells of its image. No pixel depends on another, so cells with all samples of their pixels,
 * side by side, are bit by bit the image of one render, however it is cut. --ranges: each cell is also cut into
 * sample ranges, whose sums are added in the order of the samples; the bits then depend on the ranges, and on
 * nothing else. */
#include "renderer/base/cli_rewrite.h"
#include "renderer/base/fs.h"
#include "renderer/collada/collada.h"
#include "renderer/image/image_oiio.h"
#include "renderer/pathtracer/options.h"
#include "job_kinds.h"

#include <stdio.h>
#include <stdlib.h>

/* Options that each job sets itself. */
static const struct option_words cells_and_threads[] = {{"-p", 4}, {"--cell", 4}, {0}};

#define PRODUCT "cell.png.state"

static bool check_ranges(const struct options *o, int ranges, struct err *e)
{
    if (ranges > o->last - o->first)
        return err_set(e, "--ranges: %d of %d samples; at most one for each", ranges,
                       o->last - o->first);
    if (ranges > 1 && o->adaptive_batch > 0)
        return err_set(e, "--ranges: not with --adaptive, whose rule stops a pixel by all of its "
                          "samples (--adaptive-unbiased can be cut)");
    if (ranges > 1 && o->keep_state)
        return err_set(e,
                       "--ranges: not with --keep-state, as who goes on with added sums makes an "
                       "image that no command makes again (assay merge adds samples)");
    return true;
}

static bool check_options(const struct options *o, struct err *e)
{
    const struct {
        bool given;
        const char *name, *why;
    } no[] = {{o->action != ACTION_RENDER, "--help and the like", "are no render"},
              {o->max_seconds > 0, "--time", "asks when all of the image is done"},
              {o->max_error > 0, "--error", "looks at all of the image"},
              {o->write_every > 0, "--write-every", "needs all of the image"},
              {o->resume != NULL, "--resume", "goes on with all of the image"},
              {o->num_seeds > 1, "--seed", "one alone"},
              {o->heatmap != NULL, "--heatmap", "is made at once, without jobs"}};
    for (size_t i = 0; i < sizeof no / sizeof *no; i++)
        if (no[i].given)
            return err_set(e, "%s: cannot be cut into jobs: %s", no[i].name, no[i].why);
    return true;
}

/* Cell k (out: x y dx dy, origin at the bottom left) of *num, about `parts`: strips of at least 16 rows or so,
 * which are cut into columns, too, if there are too few of them. */
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

/* The words of all jobs. ranges: each job has its own --samples; -s must then be given, as it would default to
 * their end. */
static bool add_words(struct plan *p, int argc, char **argv, const struct options *o,
                      const char *program, int threads, bool ranges, struct err *e)
{
    char t[16], spp[16], samples[64];
    snprintf(t, sizeof t, "%d", threads);
    snprintf(spp, sizeof spp, "%d", o->spp);
    snprintf(samples, sizeof samples, "%d:%d", o->first, o->last);
    bool some = ranges || o->first > 0 || o->last < o->spp;
    char **word = calloc((size_t)argc, sizeof *word);
    if (word == NULL)
        return err_set(e, "out of memory");
    int num = cli_rewrite_kept(cli_rewrite_render, argc - 1, argv + 1, word);
    num = cli_rewrite_kept(cells_and_threads, num, word, word);
    bool ok = plan_run_words(p,
                             (const char *const[]){
                                 program, "-q", "-t", t, "--keep-state", "-f", "{out}/cell.png",
                                 "{job}", ranges ? "-s" : "--samples", ranges ? spp : samples},
                             some ? 10 : 8, false, e) &&
              plan_run_words(p, (const char *const *)word, num, true, e);
    free(word);
    return ok;
}

/* Samples of range r of num. */
static void range_of(const struct options *o, int num, int r, int out[2])
{
    long long all = o->last - o->first;
    out[0] = o->first + (int)(all * r / num);
    out[1] = o->first + (int)(all * (r + 1) / num);
}

/* "-p X Y DX DY", and with several ranges "--samples A:B". */
static bool add_job(struct plan *p, const int cell[4], const int *range, struct err *e)
{
    char text[4][16], samples[32];
    const char *word[7] = {"-p", text[0], text[1], text[2], text[3], "--samples", samples};
    for (int i = 0; i < 4; i++)
        snprintf(text[i], sizeof text[i], "%d", cell[i]);
    if (range != NULL)
        snprintf(samples, sizeof samples, "%d:%d", range[0], range[1]);
    return plan_job(p, word, range != NULL ? 7 : 5, (const char *const[]){NULL}, e);
}

/* Adds the scene's textures, the module that reads them, and the documents that it refers to, as inputs. */
static bool add_images(struct plan *p, const struct options *o, struct err *e)
{
    struct scene s;
    struct path module;
    if (!collada_load(o->scene, (enum dialect)o->dialect, &s, e))
        return false;
    bool ok = s.num_images == 0 || (image_oiio_file(&module, e) && plan_input(p, module.s, e));
    for (uint32_t i = 0; ok && i < s.num_images; i++)
        ok = plan_input(p, image_get_attr(&s.images[i], SCENE_IMAGE_FILE), e);
    for (uint32_t i = 0; ok && i < s.num_documents; i++)
        ok = plan_input(p, s.documents[i], e);
    scene_free(&s);
    return ok;
}

bool job_render_plan(int argc, char **argv, const struct plan_wishes *w, struct plan *p,
                     struct err *e)
{
    struct options o;
    int ranges = w->ranges > 0 ? w->ranges : 1;
    if (!options_parse(argc, argv, &o, e) || !check_options(&o, e) || !check_ranges(&o, ranges, e))
        return false;
    const struct path beside = fs_beside_program("pathtracer");
    int parts = o.slurm > 0 ? o.slurm : w->parts > 0 ? w->parts : PLAN_PARTS;
    int threads = cli_rewrite_has_word(argc, argv, "-t", "--threads") ? o.threads : 1, num = 1;
    const char *const inputs[] = {o.scene, o.camera_file, o.environment_file};
    bool ok = plan_begin(p, o.output[0], PRODUCT, threads, e) &&
              add_words(p, argc, argv, &o, w->pathtracer != NULL ? w->pathtracer : beside.s,
                        threads, ranges > 1, e);
    for (size_t i = 0; ok && i < sizeof inputs / sizeof *inputs; i++)
        ok = inputs[i] == NULL || plan_input(p, inputs[i], e);
    ok = ok && add_images(p, &o, e);
    for (int k = 0; ok && k < num; k++) {
        int cell[4];
        cell_of(&o, parts, k, &num, cell);
        for (int r = 0; ok && r < ranges; r++) {
            int range[2];
            range_of(&o, ranges, r, range);
            ok = add_job(p, cell, ranges > 1 ? range : NULL, e);
        }
    }
    return ok;
}
