/* assay reference, the same as assay golden render: renders references by Cycles, POV-Ray or an engine
 * file. */
#include "reference/base/utc_date.h"
#include "reference/base/json_node.h"
#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"
#include "renderer/base/progress.h"
#include "tools/base/data_dirs.h"
#include "tools/golden/noise_record.h"
#include "tools/golden/reference_options.h"
#include "tools/results/results.h"
#include "commands.h"

#include <stdio.h>

static bool make_one(const struct reference_command *c, const struct suite_scene *scene,
                     const struct suite_reference *ref, struct err *e)
{
    struct reference_state state;
    struct moments m;
    json_t *manifest;
    double start = progress_seconds();
    if (!reference_options_state(c, scene, ref, &state, e))
        return false;
    if (state.there != NULL)
        return reference_options_keep(c, scene, ref, &state, e);
    if (!c->quiet)
        fprintf(stderr, "%s: rendering with %s\n", scene->name, ref->engine);
    if (!reference_render(scene, ref, &state.opt, &m, &manifest, e))
        return false;
    bool ok = reference_options_write(c, scene, ref, state.key, &m, manifest,
                                      progress_seconds() - start, e);
    moments_free(&m);
    json_decref(manifest);
    return ok;
}

/* The single reference of --images. */
struct chosen {
    const struct suite_scene *scene;
    const struct suite_reference *ref;
};

static bool choose(void *ctx, const struct suite_scene *scene, const struct suite_reference *ref,
                   struct err *e)
{
    struct chosen *c = ctx;
    if (c->ref != NULL)
        return err_set(e, "--images is of one reference: give --only and --engine");
    *c = (struct chosen){scene, ref};
    return true;
}

static bool make_images(const struct reference_command *c, struct err *e)
{
    struct chosen one = {NULL, NULL};
    return reference_options_each(c, choose, &one, e) && fs_make_dirs(c->out, e) &&
           reference_render_part(one.scene, one.ref, &c->opt, c->first, c->last, c->out, e);
}

static bool make_noise(const struct reference_command *c, struct err *e)
{
    const struct data_dirs at = data_dirs_find();
    const struct utc_date made = utc_date_now();
    bool ok = true;
    for (int i = 0; ok && i < c->suite.num_scenes; i++)
        if (reference_options_selects(c, &c->suite.scene[i]))
            ok = noise_record_render(c, &c->suite.scene[i], at.pathtracer.s, made.s, e);
    return ok;
}

/* Renders a reference of a suite of one's own with the engine of --engine FILE, even if it is up to date. */
static bool make_described(const struct reference_command *c, const struct suite_scene *scene,
                           const struct suite_reference *ref, struct err *e)
{
    const struct engine_options opt = {.spp = ref->spp,
                                       .replicates = ref->replicates,
                                       .seed = c->opt.seed,
                                       .threads = c->opt.threads,
                                       .timeout_s = c->opt.timeout_s,
                                       .work_dir = c->work};
    struct moments m;
    struct err why;
    json_t *manifest;
    double start = progress_seconds();
    if (!engine_expresses(&c->described, scene, c->work, &why)) {
        printf("%s cannot express %s: %s\n", c->described.name, scene->name, why.msg);
        return true;
    }
    if (!c->quiet)
        fprintf(stderr, "%s: rendering %s with %s\n", scene->name, ref->engine, c->described.file);
    if (!engine_render(&c->described, scene, &opt, &m, &manifest, e))
        return false;
    json_object_set_new(manifest, "engine", json_string(ref->engine));
    json_object_set_new(manifest, "seed", json_integer(opt.seed));
    json_object_set_new(manifest, "subgrid", json_integer(0));
    /* All else that decides the bits is in the manifest already. */
    char key[65];
    sha256_text(fs_path("%s %s %u", member_text(manifest, "description_sha256"),
                        member_text(manifest, "binary_sha256"), opt.seed)
                    .s,
                key);
    bool ok =
        reference_options_write(c, scene, ref, key, &m, manifest, progress_seconds() - start, e);
    moments_free(&m);
    json_decref(manifest);
    return ok;
}

/* References that are made one after the other; one that fails does not keep the others from being made. */
struct making {
    const struct reference_command *c;
    int num, failed;
    struct err first; /* failure */
};

static bool make_next(void *ctx, const struct suite_scene *scene, const struct suite_reference *ref,
                      struct err *e)
{
    struct making *m = ctx;
    m->num++;
    if (m->c->as != NULL ? make_described(m->c, scene, ref, e) : make_one(m->c, scene, ref, e))
        return true;
    if (err_is_of_memory(e))
        return false;
    printf("%s/%s: not made: %s\n", scene->name, ref->engine, e->msg);
    if (m->failed++ == 0)
        m->first = *e;
    return true;
}

static bool make_all(const struct reference_command *c, struct err *e)
{
    struct making m = {.c = c};
    if (!reference_options_each(c, make_next, &m, e))
        return false;
    if (m.failed > 1)
        return err_set(e, "%d of %d references were not made; the first: %.900s", m.failed, m.num,
                       m.first.msg);
    *e = m.first;
    return m.failed == 0;
}

int command_reference(int argc, char **argv, struct err *e)
{
    struct reference_command c;
    int code = EXIT_NOT_JUDGED;
    bool ok = reference_options_read(argc, argv, &c, e);
    if (ok && c.slurm && !c.help) {
        char name[] = "reference", *word = argv[0]; /* or "render", of `golden render` */
        argv[0] = name;
        code = command_slurm_run(NULL, argc, argv, NULL, e);
        argv[0] = word;
    } else if (ok && (c.help || (c.last > 0 ? make_images(&c, e)
                                 : c.noise  ? make_noise(&c, e)
                                            : make_all(&c, e)))) {
        code = 0;
    }
    reference_options_free(&c);
    return code;
}
