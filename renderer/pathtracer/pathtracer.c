/* pathtracer: options -> scene -> render -> images. */
#include "renderer/base/cli_rewrite.h"
#include "renderer/collada/collada.h"
#include "renderer/base/fs.h"
#include "heatmap.h"
#include "options.h"
#include "output.h"
#include "renderer/scene/cs184_deviations.h"
#include "checkpoint.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { EXIT_BAD_INPUT = 3, EXIT_SIGNAL = 128 };

/* The argument of the callbacks in struct render_control. */
struct session {
    struct output out;
    char state_path[CHECKPOINT_PATH];
    sigset_t signals; /* blocked while rendering, so that they can be polled */
    int signal;       /* the first that came; 0: none */
};

/* Blocks SIGINT and SIGTERM, so that signal_came() can poll them; one that the parent has set to be
 * ignored stays ignored. All threads inherit the mask. */
static void hold_signals(struct session *s)
{
    static const int numbers[] = {SIGINT, SIGTERM};
    sigemptyset(&s->signals);
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        struct sigaction a;
        if (sigaction(numbers[i], NULL, &a) == 0 && a.sa_handler != SIG_IGN)
            sigaddset(&s->signals, numbers[i]);
    }
    pthread_sigmask(SIG_BLOCK, &s->signals, NULL);
}

/* Polls for a signal. After the first one they are unblocked, so a second one ends the program at once. */
static bool signal_came(void *arg)
{
    struct session *s = arg;
    const struct timespec now = {0};
    int signal = sigtimedwait(&s->signals, NULL, &now);
    if (signal <= 0)
        return false;
    s->signal = signal;
    pthread_sigmask(SIG_UNBLOCK, &s->signals, NULL);
    return true;
}

static bool write_meanwhile(void *arg, const struct film *f, struct err *e)
{
    const struct session *s = arg;
    if (!output_images(&s->out, f, NULL, e))
        return !err_is_of_memory(e) && output_rescue(&s->out, f, NULL, e);
    return checkpoint_write(s->state_path, s->out.id, f, e);
}

static bool setup_camera(const struct options *o, const struct scene *scene, struct camera *c,
                         struct err *e)
{
    if (!camera_init(c, scene, o->width, o->height, e))
        return err_prefix(e, "%s", o->scene);
    if (o->frame == FRAME_WHOLE && (scene->dialect != DIALECT_CGL || o->camera_file != NULL))
        return err_set(e, "%s: --frame is of the assignment's camera, without --camera", o->scene);
    if (o->frame == FRAME_WHOLE)
        camera_show_whole(c);
    if (o->camera_file != NULL && !camera_read_file(c, o->camera_file, e))
        return false;
    c->filter = o->filter;
    if (o->lens_radius >= 0)
        c->lens_radius = (float)o->lens_radius;
    if (c->is_orthographic && c->lens_radius > 0)
        return err_set(e, "%s: a lens needs a perspective camera", o->scene);
    if (o->focal_distance >= 0 || o->camera_file == NULL)
        c->focal_distance = o->focal_distance >= 0 ? (float)o->focal_distance : 4.7f;
    return true;
}

static bool print_cameras(const struct options *o, struct err *e)
{
    const double degree = M_PI / 180;
    struct scene scene = {0};
    if (!collada_load(o->scene, (enum dialect)o->dialect, &scene, e))
        return false;
    for (uint32_t i = 0; i < scene.num_cameras; i++) {
        const struct scene_camera *c = &scene.cameras[i];
        if (c->xmag > 0 || c->ymag > 0)
            printf("%s: orthographic, %g x %g\n", c->name, 2 * (double)c->xmag,
                   2 * (double)c->ymag);
        else
            printf("%s: perspective, %g x %g degrees\n", c->name, (double)c->hfov / degree,
                   (double)c->vfov / degree);
    }
    scene_free(&scene);
    return true;
}

static bool load_scene(const struct options *o, struct scene *scene, struct err *e)
{
    if (!collada_load(o->scene, (enum dialect)o->dialect, scene, e))
        return false;
    if (o->camera_name != NULL && !scene_choose_camera(scene, o->camera_name))
        return err_set(e,
                       "--camera: '%s' is neither a camera of the scene (--list-cameras) nor a "
                       "file",
                       o->camera_name);
    if (scene->note[0] != '\0' && !o->quiet)
        fprintf(stderr, "pathtracer: note: %s\n", scene->note);
    if (scene->num_degenerate > 0 && !o->quiet)
        fprintf(stderr, "pathtracer: note: %s: %u triangles without area left out\n", o->scene,
                scene->num_degenerate);
    if (scene->num_zero_normals > 0 && !o->quiet)
        fprintf(stderr, "pathtracer: note: %s: %u corners with a normal of no length, flat there\n",
                o->scene, scene->num_zero_normals);
    for (uint32_t i = 0; i < scene->num_materials; i++)
        scene->materials[i].schlick = o->fresnel == FRESNEL_SCHLICK;
    if (scene->num_dark_lights > 0 && !o->quiet)
        fprintf(stderr, "pathtracer: note: %s: %u lights have no power\n", o->scene,
                scene->num_dark_lights);
    if (!cs184_deviations_apply(scene, o->starter, e))
        return false;
    if (o->environment_file != NULL && !scene_read_environment(scene, o->environment_file, e))
        return false;
    if (scene->num_lights == 0 && o->kind == INTEGRATE_PATHS)
        return err_set(e, "%s: the scene has no light (-e FILE: an environment)", o->scene);
    return true;
}

static struct render_options render_options_of(const struct options *o)
{
    bool pilot = o->pilot_tolerance >= 0;
    const struct sampler sampler = {(enum sampler_kind)o->sampler, o->seed};
    return (struct render_options){.integrator = {.kind = (enum integrator_kind)o->kind,
                                                  .direct = (enum direct_kind)o->direct,
                                                  .max_bounces = o->max_bounces,
                                                  .first_bounce = o->first_bounce,
                                                  .light_samples = o->light_samples,
                                                  .roulette = o->roulette,
                                                  .survival = (float)o->survival,
                                                  .sampler = sampler,
                                                  .guiding = o->guiding,
                                                  .isa = (enum isa)o->isa},
                                   .x = o->cell[0],
                                   .y = o->height - o->cell[1] - o->cell[3],
                                   .width = o->cell[2],
                                   .height = o->cell[3],
                                   .first_sample = (uint32_t)o->first,
                                   .num_samples = (uint32_t)(o->last - o->first),
                                   .threads = o->threads,
                                   .adaptive_batch = o->adaptive_batch,
                                   .adaptive_tolerance = o->adaptive_tolerance,
                                   .pilot_samples = pilot ? (uint32_t)o->pilot : 0,
                                   .pilot_max = (uint32_t)o->spp,
                                   .pilot_tolerance = pilot ? o->pilot_tolerance : 0};
}

static bool start_film(const struct session *s, const struct options *o, struct film *f,
                       struct err *e)
{
    char path[CHECKPOINT_PATH];
    if (!film_alloc(f, o->cell[2], o->cell[3], o->aov, e))
        return false;
    if (o->resume == NULL)
        return true;
    if (!output_state_path(&s->out, o->resume, path, e) || !checkpoint_read(path, s->out.id, f, e))
        return false;
    if (f->num_samples > (uint32_t)(o->last - o->first))
        return err_set(e, "%s: has %lu samples per pixel already, more than the %d asked for", path,
                       (unsigned long)f->num_samples, o->last - o->first);
    return true;
}

/* Writes the images, and the state if it may be needed; otherwise removes an old state. */
static bool finish(struct session *s, const struct film *f, const struct render_stats *stats,
                   struct err *e)
{
    const struct options *o = s->out.opt;
    if (!output_images(&s->out, f, stats, e))
        return !err_is_of_memory(e) && output_rescue(&s->out, f, stats, e);
    if (stats->end == RENDER_ASKED || o->keep_state)
        return checkpoint_write(s->state_path, s->out.id, f, e);
    unlink(s->state_path);
    return true;
}

static bool write_heatmap(const struct output *out, const struct bvh *bvh, const struct camera *c,
                          const struct render_options *opt, struct err *e)
{
    const char *path = out->opt->heatmap;
    uint64_t most;
    if (!heatmap_write(path, bvh, c, opt->x, opt->y, opt->width, opt->height, &most, e))
        return false;
    printf("%s: at most %llu nodes visited\n", path, (unsigned long long)most);
    return true;
}

/* Renders one image of the loaded scene. is_last: no other image follows, so a signal that arrives
 * after the last sample is dropped. */
static bool render_seed(struct session *s, const struct camera *camera, const struct bvh *bvh,
                        bool is_last, struct err *e)
{
    const struct options *o = s->out.opt;
    struct film film = {0};
    bool ok = false;
    if (!output_state_path(&s->out, NULL, s->state_path, e) || !start_film(s, o, &film, e))
        goto done;
    const struct render_options opt = render_options_of(o);
    if (o->heatmap != NULL && !write_heatmap(&s->out, bvh, camera, &opt, e))
        goto done;
    const struct render_control control = {.max_seconds = o->max_seconds,
                                           .max_error = o->max_error,
                                           .write_every = o->write_every,
                                           .write = write_meanwhile,
                                           .asked_to_stop = signal_came,
                                           .arg = s};
    struct progress progress;
    struct render_stats stats;
    progress_start(&progress, "rendering", "Mpaths", o->quiet);
    hold_signals(s);
    if (!render_film(s->out.scene, camera, bvh, &opt, &control, &progress, &film, &stats, e))
        goto done;
    progress_end(&progress, stats.samples);
    if (stats.end != RENDER_ASKED && is_last)
        s->signal = 0; /* it came too late to cut anything short */
    ok = finish(s, &film, &stats, e);
    if (ok)
        output_print_summary(&s->out, &film, &stats);
    if (ok && stats.end == RENDER_ASKED)
        output_print_how_to_resume(&s->out, &film);
done:
    film_free(&film);
    return ok;
}

/* The same for seed k of several, as if the command were "--seed N -f OUT_N.exr ...", as the metadata then say. */
static bool render_one_of(struct session *s, int k, const struct camera *camera,
                          const struct bvh *bvh, struct err *e)
{
    static const struct option_words own[] = {{"-f", 1}, {"--out", 1}, {"--seed", 1}, {0}};
    const struct options *all = s->out.opt;
    const struct output out = s->out;
    struct options o = *all;
    struct render_id id = *out.id;
    struct path name[MAX_OUTPUTS];
    char seed_option[] = "--seed", out_option[] = "-f";
    char **word = calloc((size_t)out.argc + 3 + 2 * MAX_OUTPUTS, sizeof *word);
    if (word == NULL)
        return err_set(e, "out of memory");
    snprintf(id.seed, sizeof id.seed, "%llu", (unsigned long long)all->seeds[k]);
    int n = 0;
    word[n++] = out.argv[0];
    word[n++] = seed_option;
    word[n++] = id.seed;
    for (int i = 0; i < o.num_outputs; i++) {
        const char *file = all->output[i], *dot = strrchr(file, '.');
        name[i] = fs_path("%.*s_%s%s", (int)(dot - file), file, id.seed, dot);
        o.output[i] = name[i].s;
        word[n++] = out_option;
        word[n++] = name[i].s;
    }
    o.seed = all->seeds[k];
    s->out.id = &id;
    o.heatmap = k == 0 ? o.heatmap : NULL;
    s->out.opt = &o;
    s->out.argc = n + cli_rewrite_kept(own, out.argc - 1, out.argv + 1, word + n);
    s->out.argv = word;
    bool ok = output_check(&s->out, e) && render_seed(s, camera, bvh, k + 1 == o.num_seeds, e);
    s->out = out;
    free(word);
    return ok;
}

static bool run(struct session *s, struct err *e)
{
    const struct options *o = s->out.opt;
    struct scene scene = {0};
    struct camera camera;
    struct render_id id;
    struct bvh *bvh = NULL;
    bool ok = load_scene(o, &scene, e) && (o->num_seeds > 1 || output_check(&s->out, e)) &&
              setup_camera(o, &scene, &camera, e) && render_id_make(o, &scene, &id, e);
    double start = progress_seconds();
    if (ok)
        bvh = bvh_build_on(&scene, (enum bvh_kind)o->accel, (enum isa)o->isa, o->threads, e);
    ok = bvh != NULL;
    if (ok) {
        snprintf(s->out.accel, sizeof s->out.accel,
                 "%s: %u nodes, depth %d, SAH cost %.1f, built in %.3f s", bvh_kind_names[o->accel],
                 bvh_num_nodes(bvh), bvh_depth(bvh), bvh_sah_cost(bvh), progress_seconds() - start);
        s->out.id = &id;
        s->out.scene = &scene;
    }
    if (o->num_seeds < 2)
        ok = ok && render_seed(s, &camera, bvh, true, e);
    for (int k = 0; o->num_seeds > 1 && ok && k < o->num_seeds && s->signal == 0; k++)
        ok = render_one_of(s, k, &camera, bvh, e);
    s->out.id = NULL; /* pointed to locals */
    s->out.scene = NULL;
    bvh_free(bvh);
    scene_free(&scene);
    return ok;
}

/* Replaces this process by `assay slurm`, which plans, submits and gathers, and runs this program for each part.
 * Returns only if it cannot be run. */
static bool hand_over(int argc, char **argv, struct err *e)
{
    struct path path = fs_beside_program("assay");
    char **words = calloc((size_t)argc + 3, sizeof *words);
    if (words == NULL)
        return err_set(e, "--slurm: out of memory");
    words[0] = path.s;
    words[1] = (char[]){"slurm"};
    words[2] = (char[]){"pathtracer"};
    memcpy(words + 3, argv + 1, (size_t)(argc - 1) * sizeof *words);
    execv(path.s, words);
    free(words);
    return err_set(e, "--slurm: cannot run %s: %s", path.s, strerror(errno));
}

int main(int argc, char **argv)
{
    struct options o;
    struct session s = {.out = {.opt = &o, .argc = argc, .argv = argv}};
    struct err e = {0};
    bool ok = options_parse(argc, argv, &o, &e);
    char **words = ok ? options_apart(argc, argv) : NULL;
    if (ok && words == NULL)
        ok = err_set(&e, "out of memory");
    if (ok)
        for (s.out.argv = words, s.out.argc = 0; words[s.out.argc] != NULL;)
            s.out.argc++;
    if (ok && o.action == ACTION_CAMERAS)
        ok = print_cameras(&o, &e);
    else if (ok && o.action != ACTION_RENDER)
        options_print(&o);
    else if (ok && o.slurm > 0)
        ok = hand_over(s.out.argc, words, &e);
    else
        ok = ok && run(&s, &e);
    if (ok && fflush(stdout) != 0)
        ok = err_set(&e, "cannot write to standard output");
    free(words);
    if (!ok) {
        fprintf(stderr, "pathtracer: %s\n", e.msg);
        return EXIT_BAD_INPUT;
    }
    return s.signal != 0 ? EXIT_SIGNAL + s.signal : 0;
}
