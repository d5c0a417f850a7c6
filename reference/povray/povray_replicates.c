/* The images that a POV-Ray reference consists of, and how they are folded. */
#include "povray_replicates.h"

#include "reference/replicates/independence.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool povray_replicates(const struct reference_job *job, struct povray_replicates *out,
                       struct err *e)
{
    *out = (struct povray_replicates){
        .job = job, .size = (size_t)job->suite->width * (size_t)job->suite->height * 3};
    if (!povray_passes(job->scene, job->camera, job->suite->depth, &out->plan, e))
        return false;
    if (povray_passes_are_noisy(&out->plan)) {
        assert(job->ref->replicates > 1 && job->ref->subgrid > 0);
        out->replicates = job->ref->replicates;
    }
    return true;
}

struct povray_image povray_replicates_window(const struct povray_replicates *s, int j, int pass)
{
    return povray_window(&s->plan, s->job->suite->width, s->job->suite->height, j, pass);
}

struct povray_image povray_replicates_replicate(const struct povray_replicates *s, int i, int pass,
                                                bool indirect)
{
    i += s->job->opt->first_replicate;
    return povray_replicate(&s->plan, s->job->suite->width, s->job->suite->height,
                            s->job->ref->subgrid, i, replicate_seed(s->job->opt->seed, i), pass,
                            indirect);
}

void povray_command_line(const struct povray_replicates *s, const char *program,
                         const struct povray_image *p, char text[4][32],
                         const char *argv[POVRAY_ARGS])
{
    snprintf(text[0], sizeof text[0], "+W%d", p->grid * s->job->suite->width);
    snprintf(text[1], sizeof text[1], "+H%d", p->grid * s->job->suite->height);
    snprintf(text[2], sizeof text[2], "+BS%d", p->block);
    const char *const args[] = {
        program, "+Iscene.pov", "+Oscene.exr", "+FE", text[0], text[1], text[2],          "+WT1",
        "-A",    "-C",          "-D",          "-P",  "-V",    "+Q9",   "File_Gamma=1.0", NULL};
    static_assert(sizeof args / sizeof *args == POVRAY_ARGS, "one slot per argument");
    memcpy(argv, args, sizeof args);
}

static void describe(const struct povray_replicates *s, const json_t *said, json_t *manifest)
{
    char text[4][32], command[512] = "povray";
    const char *argv[POVRAY_ARGS];
    int replicates = s->replicates;
    struct povray_image first = replicates > 0 ? povray_replicates_replicate(s, 0, 0, true)
                                               : povray_replicates_window(s, 0, 0);
    povray_command_line(s, "povray", &first, text, argv);
    for (int i = 1; argv[i] != NULL; i++)
        snprintf(command + strlen(command), sizeof command - strlen(command), " %s", argv[i]);
    json_t *seeds = json_array(), *blocks = json_array();
    for (int i = 0; i < replicates; i++) {
        json_array_append_new(seeds, json_integer(replicate_seed(
                                         s->job->opt->seed, s->job->opt->first_replicate + i)));
        json_array_append_new(blocks,
                              json_integer(povray_replicates_replicate(s, i, 0, true).block));
    }
    double top = POVRAY_TOP_VALUE / s->plan.radiance;
    json_t *passes = json_array();
    for (int i = 0; i < s->plan.num_passes; i++) {
        const struct povray_pass *pass = &s->plan.pass[i];
        json_array_append_new(
            passes, json_pack("{s:b, s:b, s:i, s:i, s:i}", "light_sources", pass->sources, "glow",
                              pass->glow, "recursion_limit", pass->recursion, "max_trace_level",
                              pass->levels, "max_trace_level_indirect", pass->levels_indirect));
    }
    struct povray_image fine = povray_replicates_window(s, 0, 0);
    json_t *settings =
        json_pack("{s:o, s:[f,f], s:{s:i, s:i, s:i, s:s}}", "passes", passes, "scale", top, 2 * top,
                  "fine", "windows", (int)POVRAY_WINDOWS, "subgrid", (int)POVRAY_WINDOW_GRID,
                  "lamp_cells", fine.variant.lamp_cells, "rule",
                  fine.variant.rule == POVRAY_GAUSS ? "gauss2" : "shifted grid");
    json_t *scheme = replicates > 0
                         ? json_pack("{s:i, s:i, s:f, s:o}", "subgrid", s->job->ref->subgrid,
                                     "jittered_lamp_cells", first.variant.lamp_cells, "roulette",
                                     POVRAY_ROULETTE, "block_sizes", blocks)
                         : json_string("none: the picture has no noise");
    json_object_set_new(settings, "replicate", scheme);
    json_object_set(manifest, "version", json_object_get(said, "version"));
    json_object_set(manifest, "binary_sha256", json_object_get(said, "binary_sha256"));
    json_object_set_new(manifest, "command", json_string(command));
    json_object_set_new(manifest, "settings", settings);
    json_object_set_new(manifest, "seeds", seeds);
    if (replicates == 0)
        json_decref(blocks);
}

/* The mean of the windows. */
static bool mean_window(const struct povray_replicates *s, const struct replicate_images *images,
                        double *fine, struct err *e)
{
    for (int t = 0; t < POVRAY_WINDOWS; t++) {
        char path[REPLICATE_IMAGE_PATH];
        images->path_of(images->ctx, t, path);
        float *px =
            replicate_images_read(path, s->job->suite->width, s->job->suite->height, true, e);
        if (px == NULL)
            return false;
        for (size_t i = 0; i < s->size; i++)
            fine[i] += (double)px[i] / POVRAY_WINDOWS;
        free(px);
    }
    return true;
}

/* fine + the difference of replicate k, into the moments. */
static bool add_replicate(const struct povray_replicates *s, const struct replicate_images *images,
                          int k, const double *fine, struct replicate_repeats *repeats,
                          struct replicates *all, struct moments *m, struct err *e)
{
    char path[REPLICATE_IMAGE_PATH];
    images->path_of(images->ctx, POVRAY_WINDOWS + k, path);
    float *px = replicate_images_read(path, m->width, m->height, true, e);
    if (px == NULL)
        return false;
    int first = replicate_repeats_add(repeats, px, s->size / 3);
    if (first < k) {
        free(px);
        return err_set(e, "POV-Ray: replicates %d and %d are the same", first, k);
    }
    for (size_t i = 0; i < s->size; i++)
        px[i] = (float)(fine[i] + (double)px[i]);
    moments_add_image(m, px);
    if (s->job->opt->on_replicate != NULL)
        s->job->opt->on_replicate(s->job->opt->on_replicate_ctx, k, px);
    replicates_add(all, px);
    free(px);
    return true;
}

/* fine + each replicate's difference; fine alone if there are none. */
static bool fold_images(const struct povray_replicates *s, const struct replicate_images *images,
                        struct moments *out, json_t *manifest, struct err *e)
{
    const struct suite_scene *suite = s->job->suite;
    int replicates = s->replicates;
    struct moments m = {0};
    struct replicates all = {0};
    struct replicate_repeats repeats = {0};
    double *fine = calloc(s->size, sizeof *fine);
    bool ok = fine != NULL || err_set(e, "POV-Ray images: out of memory");
    ok = ok && moments_alloc(&m, suite->width, suite->height, e) &&
         (replicates == 0 || (replicates_alloc(&all, m.width, m.height, replicates, e) &&
                              replicate_repeats_alloc(&repeats, replicates, e))) &&
         mean_window(s, images, fine, e);
    strcpy(m.unit, replicates == 0 ? "exact" : "replicate");
    m.spp = replicates == 0 ? 0 : s->job->ref->subgrid * s->job->ref->subgrid;
    for (int k = 0; ok && k < replicates; k++)
        ok = add_replicate(s, images, k, fine, &repeats, &all, &m, e);
    ok = ok &&
         (replicates == 0 || independence_check(&all, manifest, e) || err_prefix(e, "POV-Ray"));
    for (size_t i = 0; ok && replicates == 0 && i < s->size; i++) {
        m.mean[i] = fine[i];
        m.n[i / 3] = 1;
    }
    free(fine);
    replicates_free(&all);
    replicate_repeats_free(&repeats);
    if (ok)
        *out = m;
    else
        moments_free(&m);
    return ok;
}

bool povray_fold(const struct reference_job *job, const struct replicate_images *images,
                 const json_t *said, struct moments *out, json_t *manifest, struct err *e)
{
    struct povray_replicates s;
    if (!povray_replicates(job, &s, e))
        return false;
    describe(&s, said, manifest);
    return fold_images(&s, images, out, manifest, e);
}
