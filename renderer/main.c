/* pathtracer: options -> scene -> render -> pictures. */
#include "cli.h"
#include "collada.h"
#include "environment.h"
#include "fs.h"
#include "render.h"
#include "tone.h"
#include "version.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

enum { MAX_OUTPUTS = 8, EXIT_BAD_INPUT = 3 };

struct settings {
    const char *scene, *camera_file, *environment_file;
    const char *output[MAX_OUTPUTS];
    int num_outputs;
    int width, height;
    int cell[4]; /* x y dx dy, origin at the bottom left; dx 0: the whole picture */
    int dialect, accel, kind, direct, fresnel, sampler;
    int spp, light_samples, threads, max_bounces, first_bounce;
    bool roulette, quiet;
    uint64_t seed;
    int adaptive_batch;
    double adaptive_tolerance;
    double lens_radius, focal_distance; /* negative: not given */
};

enum option {
    OPT_SPP,
    OPT_LIGHT_SAMPLES,
    OPT_THREADS,
    OPT_BOUNCES,
    OPT_ACCUMULATE,
    OPT_FIRST_BOUNCE,
    OPT_ONLY,
    OPT_HEMISPHERE,
    OPT_DIRECT,
    OPT_ROULETTE,
    OPT_ADAPTIVE,
    OPT_ENVIRONMENT,
    OPT_LENS,
    OPT_FOCUS,
    OPT_OUT,
    OPT_RESOLUTION,
    OPT_CELL,
    OPT_CAMERA,
    OPT_SEED,
    OPT_SAMPLER,
    OPT_INTEGRATOR,
    OPT_ACCEL,
    OPT_DIALECT,
    OPT_FRESNEL,
    OPT_QUIET,
    OPT_VERSION,
    OPT_HELP
};

static const struct cli_option options[] = {
    [OPT_SPP] = {'s', "spp", 1, "N", "paths per pixel (16)"},
    [OPT_LIGHT_SAMPLES] = {'l', "light-samples", 1, "N", "samples per area light and vertex (1)"},
    [OPT_THREADS] = {'t', "threads", 1, "N", "threads; 0: one per processor (0)"},
    [OPT_BOUNCES] = {'m', "max-bounces", 1, "N",
                     "0: emission seen directly, 1: + direct light, ... (5)"},
    [OPT_ACCUMULATE] = {'o', "accumulate", 1, "0|1",
                        "0: only light that bounced exactly -m times (1)"},
    [OPT_FIRST_BOUNCE] = {0, "first-bounce", 1, "N", "leave out light with fewer bounces (0)"},
    [OPT_ONLY] = {0, "only", 1, "PART", "direct: at most one bounce; indirect: two or more"},
    [OPT_HEMISPHERE] = {'H', "hemisphere", 0, "", "short for --direct hemisphere"},
    [OPT_DIRECT] = {0, "direct", 1, "HOW", "hemisphere, light, bsdf or mis (mis)"},
    [OPT_ROULETTE] = {0, "roulette", 1, "on|off", "end dim paths at random, without bias (on)"},
    [OPT_ADAPTIVE] = {'a', "adaptive", 2, "N TOL",
                      "every N samples a pixel stops if its 95 % interval\n"
                      "is within TOL of its mean; biased (off)"},
    [OPT_ENVIRONMENT] = {'e', "environment", 1, "FILE",
                         "environment map in latitude and longitude, .exr or .hdr"},
    [OPT_LENS] = {'b', "lens-radius", 1, "R", "thin lens, scene units; 0: pinhole (0)"},
    [OPT_FOCUS] = {'d', "focal-distance", 1, "D", "distance in focus, scene units (4.7)"},
    [OPT_OUT] = {'f', "out", 1, "FILE",
                 "picture; may be given again. .exr: float32 with moments,\n"
                 ".png: 8 bits by the dialect's tone curve"},
    [OPT_RESOLUTION] = {'r', "resolution", 2, "W H", "pixels (800 600)"},
    [OPT_CELL] = {'p', "cell", 4, "X Y DX DY", "render only this cell, origin at the bottom left"},
    [OPT_CAMERA] = {'c', "camera", 1, "FILE",
                    "camera settings as the assignment's GUI writes them"},
    [OPT_SEED] = {0, "seed", 1, "N", "64-bit seed of all samples (1)"},
    [OPT_SAMPLER] = {0, "sampler", 1, "NAME",
                     "independent or sobol: less noise, but unknown error (independent)"},
    [OPT_INTEGRATOR] = {0, "integrator", 1, "NAME", "path or normals (path)"},
    [OPT_ACCEL] = {0, "accel", 1, "NAME", "bruteforce, centroid or sah (sah)"},
    [OPT_DIALECT] = {0, "dialect", 1, "NAME",
                     "auto, collada or cgl: whose rules for camera and lights;\n"
                     "auto: cgl if the file has CGL extras (auto)"},
    [OPT_FRESNEL] = {0, "fresnel", 1, "HOW",
                     "of glass: exact, or schlick as in the assignment (exact)"},
    [OPT_QUIET] = {'q', "quiet", 0, "", "no progress, no statistics"},
    [OPT_VERSION] = {0, "version", 0, "", "print version and libraries"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

static const char *const dialect_names[] = {"auto", "collada", "cgl", NULL};

enum { FRESNEL_EXACT, FRESNEL_SCHLICK };
static const char *const fresnel_names[] = {"exact", "schlick", NULL};

static void print_help(void)
{
    puts("usage: pathtracer [options] -f OUT.exr SCENE.dae\n\n"
         "Renders a COLLADA scene by path tracing. Every option with its default:\n");
    cli_print_options(stdout, options);
    puts("\nExit code: 0, or 3 with one line on stderr.");
}

static bool parse_only(struct settings *s, const char *text, struct err *e)
{
    static const char *const parts[] = {"direct", "indirect", NULL};
    int part;
    if (!cli_choice("--only", text, parts, &part, e))
        return false;
    if (part == 0)
        s->max_bounces = 1;
    else
        s->first_bounce = 2;
    return true;
}

static bool parse_switch(const char *what, const char *text, bool *out, struct err *e)
{
    static const char *const words[] = {"off", "on", NULL};
    int i;
    if (!cli_choice(what, text, words, &i, e))
        return false;
    *out = i == 1;
    return true;
}

static bool add_output(struct settings *s, const char *path, struct err *e)
{
    const char *dot = strrchr(path, '.');
    if (dot == NULL || (strcasecmp(dot, ".exr") != 0 && strcasecmp(dot, ".png") != 0))
        return err_set(e, "--out: '%s' ends neither in .exr nor in .png", path);
    if (s->num_outputs == MAX_OUTPUTS)
        return err_set(e, "--out: at most %d files", MAX_OUTPUTS);
    s->output[s->num_outputs++] = path;
    return true;
}

static bool parse_cell(struct settings *s, const char *const value[4], struct err *e)
{
    for (int k = 0; k < 4; k++)
        if (!cli_int("--cell", value[k], k < 2 ? 0 : 1, 65535, &s->cell[k], e))
            return false;
    return true;
}

/* One option; *accumulate is -o, which counts only after all of them are read. */
static bool parse_option(struct settings *s, enum option o, const struct cli *c, int *accumulate,
                         struct err *e)
{
    const char *v = c->value[0];
    switch (o) {
    case OPT_SPP: return cli_int("--spp", v, 1, 1 << 24, &s->spp, e);
    case OPT_LIGHT_SAMPLES: return cli_int("--light-samples", v, 1, 65536, &s->light_samples, e);
    case OPT_THREADS: return cli_int("--threads", v, 0, 1024, &s->threads, e);
    case OPT_BOUNCES: return cli_int("--max-bounces", v, 0, 10000, &s->max_bounces, e);
    case OPT_ACCUMULATE: return cli_int("--accumulate", v, 0, 1, accumulate, e);
    case OPT_FIRST_BOUNCE: return cli_int("--first-bounce", v, 0, 10000, &s->first_bounce, e);
    case OPT_ONLY: return parse_only(s, v, e);
    case OPT_HEMISPHERE: s->direct = DIRECT_HEMISPHERE; return true;
    case OPT_DIRECT: return cli_choice("--direct", v, direct_kind_names, &s->direct, e);
    case OPT_ROULETTE: return parse_switch("--roulette", v, &s->roulette, e);
    case OPT_ADAPTIVE:
        return cli_int("--adaptive", v, 1, 1 << 24, &s->adaptive_batch, e) &&
               cli_double("--adaptive", c->value[1], 0, 1e6, &s->adaptive_tolerance, e);
    case OPT_ENVIRONMENT: s->environment_file = v; return true;
    case OPT_LENS: return cli_double("--lens-radius", v, 0, 1e6, &s->lens_radius, e);
    case OPT_FOCUS: return cli_double("--focal-distance", v, 1e-6, 1e9, &s->focal_distance, e);
    case OPT_OUT: return add_output(s, v, e);
    case OPT_RESOLUTION:
        return cli_int("--resolution", v, 1, 65535, &s->width, e) &&
               cli_int("--resolution", c->value[1], 1, 65535, &s->height, e);
    case OPT_CELL: return parse_cell(s, c->value, e);
    case OPT_CAMERA: s->camera_file = v; return true;
    case OPT_SEED: return cli_uint64("--seed", v, &s->seed, e);
    case OPT_SAMPLER: return cli_choice("--sampler", v, sampler_kind_names, &s->sampler, e);
    case OPT_INTEGRATOR: return cli_choice("--integrator", v, integrator_kind_names, &s->kind, e);
    case OPT_ACCEL: return cli_choice("--accel", v, bvh_kind_names, &s->accel, e);
    case OPT_DIALECT: return cli_choice("--dialect", v, dialect_names, &s->dialect, e);
    case OPT_FRESNEL: return cli_choice("--fresnel", v, fresnel_names, &s->fresnel, e);
    case OPT_QUIET: s->quiet = true; return true;
    case OPT_VERSION:
        printf("pathtracer %s, %s\n", assay_version, image_library_version());
        exit(0);
    case OPT_HELP: print_help(); exit(0);
    }
    return false;
}

static bool parse(int argc, char **argv, struct settings *s, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    int accumulate = 1;
    for (int i; (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return false;
        if (i == CLI_POSITIONAL) {
            if (s->scene != NULL)
                return err_set(e, "more than one scene: '%s' and '%s'", s->scene, c.value[0]);
            s->scene = c.value[0];
        } else if (!parse_option(s, (enum option)i, &c, &accumulate, e)) {
            return false;
        }
    }
    if (!accumulate)
        s->first_bounce = s->max_bounces;
    if (s->scene == NULL)
        return err_set(e, "no scene given (see --help)");
    if (s->num_outputs == 0)
        return err_set(e, "no output given: -f FILE.exr or FILE.png");
    if (s->first_bounce > s->max_bounces)
        return err_set(e, "nothing to render: light with %d bounces or more, but at most %d",
                       s->first_bounce, s->max_bounces);
    if (s->adaptive_batch > 0 && s->sampler != SAMPLER_INDEPENDENT)
        return err_set(e,
                       "--adaptive estimates the error from samples that have to be independent: "
                       "not with --sampler %s",
                       sampler_kind_names[s->sampler]);
    if (s->cell[2] == 0) {
        s->cell[2] = s->width;
        s->cell[3] = s->height;
    }
    if (s->cell[0] + s->cell[2] > s->width || s->cell[1] + s->cell[3] > s->height)
        return err_set(e, "--cell: %d %d %d %d reaches out of the %d x %d picture", s->cell[0],
                       s->cell[1], s->cell[2], s->cell[3], s->width, s->height);
    if (s->threads == 0) {
        long n = sysconf(_SC_NPROCESSORS_ONLN);
        s->threads = n < 1 ? 1 : n > 1024 ? 1024 : (int)n;
    }
    return true;
}

static bool write_png(const char *path, const struct moments *m, enum tone_curve curve,
                      struct err *e)
{
    size_t n = 3 * (size_t)m->width * (size_t)m->height;
    uint8_t *bytes = malloc(n);
    if (bytes == NULL)
        return err_set(e, "%s: out of memory", path);
    for (size_t i = 0; i < n; i++)
        bytes[i] = tone_map(curve, m->mean[i]);
    bool ok = image_write_png(path, m->width, m->height, bytes, e);
    free(bytes);
    return ok;
}

static bool write_outputs(const struct settings *s, const struct scene *scene, const char *accel,
                          const struct moments *m, const struct render_stats *stats, int argc,
                          char **argv, struct err *e)
{
    char command[4096] = "", seed[32], seconds[64], rays[128];
    size_t n = 0;
    for (int i = 0; i < argc && n < sizeof command - 1; i++) {
        int added = snprintf(command + n, sizeof command - n, "%s%s", i ? " " : "", argv[i]);
        n += added > 0 ? (size_t)added : 0;
    }
    snprintf(seed, sizeof seed, "%llu", (unsigned long long)s->seed);
    snprintf(seconds, sizeof seconds, "%.3f wall, %.3f cpu", stats->wall_seconds,
             stats->cpu_seconds);
    snprintf(rays, sizeof rays, "%llu rays, %llu box tests, %llu primitive tests",
             (unsigned long long)stats->rays.rays, (unsigned long long)stats->rays.box_tests,
             (unsigned long long)stats->rays.primitive_tests);
    const struct image_attr attrs[] = {{"assay:version", assay_version},
                                       {"assay:command", command},
                                       {"assay:seed", seed},
                                       {"assay:sampler", sampler_kind_names[s->sampler]},
                                       {"assay:seconds", seconds},
                                       {"assay:rays", rays},
                                       {"assay:accel", accel}};
    for (int i = 0; i < s->num_outputs; i++) {
        const char *path = s->output[i];
        bool exr = strcasecmp(strrchr(path, '.'), ".exr") == 0;
        enum tone_curve curve = scene->dialect == DIALECT_CGL ? TONE_CGL : TONE_SRGB;
        if (exr ? !moments_write(path, m, attrs, (int)(sizeof attrs / sizeof attrs[0]), e)
                : !write_png(path, m, curve, e))
            return false;
    }
    return true;
}

/* The image mean with its standard error, on stdout; what it cost, on stderr. */
static void print_summary(const struct settings *s, const char *accel, const struct moments *m,
                          const struct render_stats *stats)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    double mean[3] = {0}, var[3] = {0};
    for (size_t p = 0; p < pixels; p++)
        for (int c = 0; c < 3; c++) {
            mean[c] += m->mean[3 * p + (size_t)c] / (double)pixels;
            double v = moments_var_of_mean(m, p, c);
            var[c] += v > 0 ? v / (double)pixels / (double)pixels : 0;
        }
    printf("mean radiance %.6g %.6g %.6g", mean[0], mean[1], mean[2]);
    if (s->sampler == SAMPLER_INDEPENDENT)
        printf(" +- %.2g %.2g %.2g\n", sqrt(var[0]), sqrt(var[1]), sqrt(var[2]));
    else
        puts(", error unknown");
    if (s->quiet)
        return;
    double rays = (double)stats->rays.rays;
    fprintf(stderr,
            "%.3g paths, %.3g rays in %.2f s (%.2f CPU s); per ray %.1f box and %.1f primitive "
            "tests; %s\n",
            stats->samples, rays, stats->wall_seconds, stats->cpu_seconds,
            (double)stats->rays.box_tests / rays, (double)stats->rays.primitive_tests / rays,
            accel);
}

static bool setup_camera(const struct settings *s, const struct scene *scene, struct camera *c,
                         struct err *e)
{
    if (!camera_init(c, scene, s->width, s->height, e))
        return err_prefix(e, "%s", s->scene);
    if (s->camera_file != NULL && !camera_read_file(c, s->camera_file, e))
        return false;
    if (s->lens_radius >= 0)
        c->lens_radius = (float)s->lens_radius;
    if (s->focal_distance >= 0 || s->camera_file == NULL)
        c->focal_distance = s->focal_distance >= 0 ? (float)s->focal_distance : 4.7f;
    return true;
}

static bool add_environment(const struct settings *s, struct scene *scene, struct err *e)
{
    struct environment *env = environment_read(s->environment_file, e);
    if (env == NULL)
        return false;
    if (scene_add_environment(scene, env, e))
        return true;
    environment_free(env);
    return err_prefix(e, "-e %s with %s", s->environment_file, s->scene);
}

static bool run(const struct settings *s, int argc, char **argv, struct err *e)
{
    struct scene scene = {0};
    struct camera camera;
    struct moments film = {0};
    struct bvh *bvh = NULL;
    bool ok = false;
    if (!collada_load(s->scene, (enum dialect)s->dialect, &scene, e))
        return false;
    if (scene.note[0] != '\0' && !s->quiet)
        fprintf(stderr, "pathtracer: note: %s\n", scene.note);
    if (scene.num_degenerate > 0 && !s->quiet)
        fprintf(stderr, "pathtracer: note: %s: %u triangles without area left out\n", s->scene,
                scene.num_degenerate);
    for (uint32_t i = 0; i < scene.num_materials; i++)
        scene.materials[i].schlick = s->fresnel == FRESNEL_SCHLICK;
    if (scene.num_dark_lights > 0 && !s->quiet)
        fprintf(stderr, "pathtracer: note: %s: %u lights have no power\n", s->scene,
                scene.num_dark_lights);
    if (s->environment_file != NULL && !add_environment(s, &scene, e))
        goto done;
    if (!setup_camera(s, &scene, &camera, e))
        goto done;
    if (scene.num_lights == 0 && s->kind == INTEGRATE_PATHS) {
        err_set(e, "%s: the scene has no light", s->scene);
        goto done;
    }
    double start = now_seconds();
    bvh = bvh_build(&scene, (enum bvh_kind)s->accel, e);
    if (bvh == NULL)
        goto done;
    char accel[160];
    snprintf(accel, sizeof accel, "%s: %u nodes, depth %d, SAH cost %.1f, built in %.3f s",
             bvh_kind_names[s->accel], bvh_num_nodes(bvh), bvh_depth(bvh), bvh_sah_cost(bvh),
             now_seconds() - start);
    const struct sampler sampler = {(enum sampler_kind)s->sampler, s->seed};
    struct render_options opt = {.integrator = {.kind = (enum integrator_kind)s->kind,
                                                .direct = (enum direct_kind)s->direct,
                                                .max_bounces = s->max_bounces,
                                                .first_bounce = s->first_bounce,
                                                .light_samples = s->light_samples,
                                                .roulette = s->roulette,
                                                .sampler = sampler},
                                 .x = s->cell[0],
                                 .y = s->height - s->cell[1] - s->cell[3],
                                 .width = s->cell[2],
                                 .height = s->cell[3],
                                 .num_samples = (uint32_t)s->spp,
                                 .threads = s->threads,
                                 .adaptive_batch = s->adaptive_batch,
                                 .adaptive_tolerance = s->adaptive_tolerance};
    struct progress progress;
    struct render_stats stats;
    progress_start(&progress, "rendering", "Mpaths", s->quiet);
    ok = render(&scene, &camera, bvh, &opt, &progress, &film, &stats, e);
    if (!ok)
        goto done;
    progress_end(&progress, stats.samples);
    ok = write_outputs(s, &scene, accel, &film, &stats, argc, argv, e);
    if (ok)
        print_summary(s, accel, &film, &stats);
done:
    moments_free(&film);
    bvh_free(bvh);
    scene_free(&scene);
    return ok;
}

int main(int argc, char **argv)
{
    struct settings s = {.width = 800,
                         .height = 600,
                         .accel = BVH_SAH,
                         .direct = DIRECT_MIS,
                         .spp = 16,
                         .light_samples = 1,
                         .max_bounces = 5,
                         .roulette = true,
                         .seed = 1,
                         .lens_radius = -1,
                         .focal_distance = -1};
    struct err e = {0};
    if (!parse(argc, argv, &s, &e) || !run(&s, argc, argv, &e)) {
        fprintf(stderr, "pathtracer: %s\n", e.msg);
        return EXIT_BAD_INPUT;
    }
    if (fflush(stdout) != 0) {
        fputs("pathtracer: cannot write to standard output\n", stderr);
        return EXIT_BAD_INPUT;
    }
    return 0;
}
