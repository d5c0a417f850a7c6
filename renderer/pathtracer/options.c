#include "options.h"

#include "renderer/base/cli.h"
#include "renderer/scene/cs184_deviations.h"
#include "renderer/base/version.h"

#include <libxml/xmlversion.h>
#include <nettle/version.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

static const char *const fresnel_names[] = {"exact", "schlick", NULL};
static const char *const frame_names[] = {"crop", "whole", NULL};
static const char *const off_on[] = {"off", "on", NULL};
static const char *const dialect_names[] = {"auto", "collada", "cgl", NULL};

enum { DEFAULT_SPP = 16, MAX_SPP = 1 << 24 };

static bool has_ending(const char *path, const char *ending)
{
    const char *dot = strrchr(path, '.');
    return dot != NULL && strcasecmp(dot, ending) == 0;
}

bool image_is_exr(const char *path)
{
    return has_ending(path, ".exr");
}

static const struct cli_unit percent[] = {{"%", 0.01}, {NULL, 0.01}};

static bool read_scene(void *options, const char *const v[4], struct err *e)
{
    struct options *s = options;
    if (s->scene != NULL)
        return err_set(e, "more than one scene: '%s' and '%s'", s->scene, v[0]);
    s->scene = v[0];
    return true;
}

static bool read_only(void *options, const char *const v[4], struct err *e)
{
    static const char *const parts[] = {"direct", "indirect", NULL};
    struct options *s = options;
    int part;
    if (!cli_choice("--only", v[0], parts, &part, e))
        return false;
    if (part == 0)
        s->max_bounces = 1;
    else
        s->first_bounce = 2;
    return true;
}

static bool read_roulette(void *options, const char *const v[4], struct err *e)
{
    struct options *s = options;
    s->roulette = strcmp(v[0], "off") == 0  ? ROULETTE_OFF
                  : strcmp(v[0], "on") == 0 ? ROULETTE_THROUGHPUT
                                            : ROULETTE_FIXED;
    return s->roulette != ROULETTE_FIXED ||
           cli_double("--roulette", v[0], 0.01, 1, &s->survival, e) ||
           err_set(e, "--roulette: '%s' is neither on, off, nor a probability in 0.01..1", v[0]);
}

static bool read_adaptive(void *options, const char *const v[4], struct err *e)
{
    struct options *s = options;
    return cli_int("--adaptive", v[0], 1, 1 << 24, &s->adaptive_batch, e) &&
           cli_double("--adaptive", v[1], 0, 1e6, &s->adaptive_tolerance, e);
}

static bool read_output(void *options, const char *const v[4], struct err *e)
{
    struct options *s = options;
    if (!has_ending(v[0], ".exr") && !has_ending(v[0], ".png"))
        return err_set(e, "--out: '%s' ends neither in .exr nor in .png", v[0]);
    if (s->num_outputs == MAX_OUTPUTS)
        return err_set(e, "--out: at most %d files", MAX_OUTPUTS);
    s->output[s->num_outputs++] = v[0];
    return true;
}

static bool read_heatmap(void *options, const char *const v[4], struct err *e)
{
    struct options *s = options;
    s->heatmap = v[0];
    return has_ending(v[0], ".png") || err_set(e, "--heatmap: '%s' does not end in .png", v[0]);
}

static bool read_filter(void *options, const char *const v[4], struct err *e)
{
    struct options *s = options;
    return pixel_filter_parse(v[0], &s->filter, e) || err_prefix(e, "--filter");
}

static bool read_cell(void *options, const char *const v[4], struct err *e)
{
    struct options *s = options;
    for (int k = 0; k < 4; k++)
        if (!cli_int("--cell", v[k], k < 2 ? 0 : 1, 65535, &s->cell[k], e))
            return false;
    return true;
}

static bool read_seeds(void *options, const char *const v[4], struct err *e)
{
    struct options *s = options;
    const char *text = v[0];
    for (s->num_seeds = 0; text != NULL; s->num_seeds++) {
        char one[32];
        size_t n = strcspn(text, ",");
        snprintf(one, sizeof one, "%.*s", (int)n, text);
        if (s->num_seeds == MAX_SEEDS)
            return err_set(e, "--seed: at most %d", MAX_SEEDS);
        if (!cli_uint64("--seed", one, &s->seeds[s->num_seeds], e))
            return false;
        for (int k = 0; k < s->num_seeds; k++)
            if (s->seeds[k] == s->seeds[s->num_seeds])
                return err_set(e, "--seed: %s is there twice", one);
        text = text[n] == ',' ? text + n + 1 : NULL;
    }
    s->seed = s->seeds[0];
    return true;
}

static bool read_starter(void *options, const char *const v[4], struct err *e)
{
    struct options *s = options;
    int which;
    if (!cli_choice("--starter", v[0], cs184_deviation_names, &which, e))
        return false;
    s->starter |= 1u << which;
    return true;
}

#define TO(member) CLI_TO(struct options, member)

static const struct cli_option options[] = {
    {'s', "spp", "N", "samples (camera paths) per pixel; the maximum if adaptive (16)", TO(spp), 1,
     MAX_SPP},
    {0, "samples", "A:B",
     "render only sample numbers A to B-1 (0:spp); assay merge\n"
     "combines such partial renders",
     CLI_TO_RANGE(struct options, first), 0, MAX_SPP, .noun = "sample"},
    {'l', "light-samples", "N", "samples of each area light at each path vertex (1)",
     TO(light_samples), 1, 65536},
    {'t', "threads", "N", "number of threads; 0: one per processor (0)", TO(threads), 0, 1024},
    {'m', "max-bounces", "N", "maximum bounces; 0: emission only, 1: plus direct light, ... (5)",
     TO(max_bounces), 0, 10000},
    {'o', "accumulate", "0|1", "0: only light with exactly -m bounces; 1: also with fewer (1)",
     TO(accumulate), 0, 1},
    {0, "first-bounce", "N", "exclude light with fewer than N bounces (0)", TO(first_bounce), 0,
     10000},
    {0, "only", "PART", "direct: light with at most 1 bounce; indirect: with 2 or more (all)",
     .read = read_only},
    {'H', "hemisphere", "", "same as --direct hemisphere", TO(direct), DIRECT_HEMISPHERE},
    {0, "direct", "HOW", "sampling of direct light: hemisphere, light, bsdf or mis (mis)",
     TO(direct), .names = direct_kind_names},
    {0, "roulette", "on|off|P",
     "Russian roulette: on: by path throughput; P: with this fixed\n"
     "survival probability (0.7 in the assignment); unbiased (on)",
     .read = read_roulette},
    {'a', "adaptive", "N TOL",
     "every N samples, stop pixels whose 95 % confidence interval has\n"
     "a half-width of at most TOL x mean; biased (off)",
     .read = read_adaptive},
    {0, "adaptive-unbiased", "TOL",
     "choose each pixel's sample count for TOL from a pilot render\n"
     "that is not part of the result; unbiased (off)",
     TO(pilot_tolerance), 0, 1e6},
    {0, "pilot", "N", "samples per pixel of the pilot, and each pixel's minimum (32)", TO(pilot), 2,
     1 << 20},
    {0, "time", "T", "time limit: 90, 90s, 5m or 2h (off); -s then defaults to no limit",
     TO(max_seconds), 0, 1e9, .unit = cli_time_units},
    {0, "error", "P%",
     "stop when the RMS over pixels of the standard error is at most\n"
     "P % of the mean luminance (off); -s then defaults to no limit",
     TO(max_error), 0, 100, .unit = percent},
    {0, "write-every", "T", "write images and state file periodically: 60, 60s, 5m, 1h (off)",
     TO(write_every), 0, 1e9, .unit = cli_time_units},
    {0, "resume", "FILE", "continue the render that wrote FILE.state; needs the same options",
     TO(resume)},
    {0, "keep-state", "",
     "keep the state file beside the first image after the render\n"
     "is complete, to add samples later",
     TO(keep_state)},
    {'e', "environment", "FILE", "environment map, latitude-longitude, .exr or .hdr (none)",
     TO(environment_file)},
    {'b', "lens-radius", "R", "radius of the thin lens, scene units; 0: pinhole (0)",
     TO(lens_radius), 0, 1e6},
    {'d', "focal-distance", "D", "distance of the plane in focus, scene units (4.7)",
     TO(focal_distance), 1e-6, 1e9},
    {0, "slurm", "N",
     "render as about N jobs on a Slurm cluster, through the assay\n"
     "program beside this one; result is bit-identical (off)",
     TO(slurm), 1, 1000000},
    {'f', "out", "FILE",
     "output image; repeatable. .exr: 32-bit floats with moments,\n"
     ".png: 8 bits, with the dialect's tone curve",
     .read = read_output},
    {0, "aov", "",
     "add layers to .exr: variance, stderr, depth, normal, albedo,\n"
     "object id",
     TO(aov)},
    {0, "heatmap", "FILE",
     "PNG of the number of BVH nodes visited by the ray through each\n"
     "pixel's centre",
     .read = read_heatmap},
    {'r', "resolution", "W H", "image size in pixels, also as WxH (800 600)", TO(width), 1, 65535},
    {0, "filter", "HOW",
     "pixel reconstruction filter: box, box:RADIUS, tent:RADIUS or\n"
     "gauss:SIGMA:RADIUS, in pixels (box:0.5)",
     .read = read_filter},
    {'p', "cell", "X Y DX DY",
     "render only DX x DY pixels from X Y, origin at the bottom left (all)", .read = read_cell},
    {'c', "camera", "NAME",
     "name of a camera of the scene, or a camera settings file as the\n"
     "assignment's GUI writes it (the first camera)",
     TO(camera_file)},
    {0, "list-cameras", "", "print the scene's cameras and exit", TO(action), ACTION_CAMERAS},
    {0, "seed", "N[,N...]",
     "64-bit random seed (1); with several, one image for each, named\n"
     "FILE_N.exr",
     .read = read_seeds},
    {0, "sampler", "NAME", "independent, or sobol: less noise, no error estimate (independent)",
     TO(sampler), .names = sampler_kind_names},
    {0, "guiding", "on|off",
     "learn from a pilot render where indirect light comes from, and\n"
     "trace more paths there: less noise; unbiased (off)",
     TO(guiding), .names = off_on},
    {0, "integrator", "NAME", "path, or normals: the shading normals as colours (path)", TO(kind),
     .names = integrator_kind_names},
    {0, "accel", "NAME", "ray acceleration: bruteforce, centroid, sah or wide (wide)", TO(accel),
     .names = bvh_kind_names},
    {0, "isa", "NAME",
     "SIMD instructions: auto, sse4.2, avx2, avx512, or scalar: one\n"
     "path at a time; all give the same image (auto with --accel wide,\n"
     "else scalar)",
     TO(isa), .names = isa_names},
    {0, "dialect", "NAME",
     "rules for camera and lights: collada, cgl (the assignment's), or\n"
     "auto: cgl if the file has CGL extras (auto)",
     TO(dialect), .names = dialect_names},
    {0, "fresnel", "HOW", "reflectance of glass: exact, or schlick as in the assignment (exact)",
     TO(fresnel), .names = fresnel_names},
    {0, "frame", "HOW",
     "with dialect cgl: crop the view of 800 x 600 pixels to -r, as the\n"
     "assignment does, or show the whole view (crop)",
     TO(frame), .names = frame_names},
    {0, "starter", "DEFECT",
     "reproduce a defect of the assignment's starter code, for grading:\n"
     "light-pdf, turned-lamp, beckmann or normals; repeatable (none)",
     .read = read_starter},
    {'q', "quiet", "", "no progress, no statistics", TO(quiet)},
    {0, "list", "", "print the accepted values of options such as --accel", TO(action), ACTION_LIST,
     .stops = true},
    {0, "version", "", "print the versions of program and libraries", TO(action), ACTION_VERSION,
     .stops = true},
    {'h', "help", "", "print this", TO(action), ACTION_HELP, .stops = true},
    {.read = read_scene}};

/* Defaults and checks that depend on several options. */
static bool complete(struct options *s, struct err *e)
{
    if (!s->accumulate)
        s->first_bounce = s->max_bounces;
    if (s->scene == NULL)
        return err_set(e, "no scene given (see --help)");
    if (s->action == ACTION_CAMERAS)
        return true;
    if (s->camera_file != NULL && access(s->camera_file, F_OK) != 0) {
        s->camera_name = s->camera_file;
        s->camera_file = NULL;
    }
    if (s->num_outputs == 0)
        return err_set(e, "no output given: -f FILE.exr or FILE.png");
    if (s->first_bounce > s->max_bounces)
        return err_set(e, "nothing to render: light with %d bounces or more, but at most %d",
                       s->first_bounce, s->max_bounces);
    if (s->cell[2] == 0) {
        s->cell[2] = s->width;
        s->cell[3] = s->height;
    }
    if (s->cell[0] + s->cell[2] > s->width || s->cell[1] + s->cell[3] > s->height)
        return err_set(e, "--cell: %d %d %d %d reaches out of the %d x %d image", s->cell[0],
                       s->cell[1], s->cell[2], s->cell[3], s->width, s->height);
    if ((s->adaptive_batch > 0 || s->pilot_tolerance >= 0 || s->max_error > 0) &&
        s->sampler != SAMPLER_INDEPENDENT)
        return err_set(e,
                       "--adaptive, --adaptive-unbiased and --error estimate the error from samples that have to be "
                       "independent: not with --sampler %s",
                       sampler_kind_names[s->sampler]);
    if (s->adaptive_batch > 0 && s->pilot_tolerance >= 0)
        return err_set(e, "--adaptive and --adaptive-unbiased exclude each other");
    if (s->pilot_tolerance >= 0 && s->last > 0 && s->spp == 0)
        return err_set(e, "--samples: give --spp too, the most samples that the pilot may grant");
    if (s->spp == 0) {
        bool unlimited = s->max_seconds > 0 || s->max_error > 0;
        s->spp = s->last > 0 ? s->last : unlimited ? MAX_SPP : DEFAULT_SPP;
    }
    if (s->last == 0)
        s->last = s->spp;
    if (s->num_seeds > 1 && (s->resume != NULL || s->slurm > 0))
        return err_set(e, "--seed: one alone with --resume and --slurm");
    if (s->last > s->spp)
        return err_set(e, "--samples: %d:%d goes past the %d of --spp", s->first, s->last, s->spp);
    if (s->starter != 0 && s->direct == DIRECT_MIS && s->kind == INTEGRATE_PATHS)
        return err_set(
            e, "--starter is about programs that sample lights alone: give --direct light too");
    if (s->isa < 0)
        s->isa = s->accel == BVH_WIDE ? ISA_AUTO : ISA_SCALAR;
    if (s->threads == 0)
        s->threads = cli_processors();
    return true;
}

char **options_apart(int argc, char **argv)
{
    return cli_apart(options, argc, argv);
}

bool options_parse(int argc, char **argv, struct options *s, struct err *e)
{
    *s = (struct options){.width = 800,
                          .height = 600,
                          .accel = BVH_WIDE,
                          .isa = -1,
                          .direct = DIRECT_MIS,
                          .light_samples = 1,
                          .max_bounces = 5,
                          .accumulate = 1,
                          .roulette = ROULETTE_THROUGHPUT,
                          .seed = 1,
                          .pilot = 32,
                          .pilot_tolerance = -1,
                          .lens_radius = -1,
                          .focal_distance = -1};
    return cli_read(options, argc, argv, s, e) &&
           ((s->action != ACTION_RENDER && s->action != ACTION_CAMERAS) || complete(s, e));
}

static void print_names(const char *what, const char *const *names)
{
    printf("%s:", what);
    for (int i = 0; names[i] != NULL; i++)
        printf(" %s", names[i]);
    putchar('\n');
}

void options_print(const struct options *o)
{
    switch (o->action) {
    case ACTION_RENDER:
    case ACTION_CAMERAS: break;
    case ACTION_HELP:
        cli_print_help(
            "usage: pathtracer [options] -f OUT.exr SCENE.dae\n\n"
            "Renders a COLLADA scene by path tracing. Options, with defaults in parentheses:\n",
            options);
        puts(
            "\nCtrl-C (or SIGTERM) finishes the current pass, writes the images and prints how to resume.\n"
            "Exit code: 0 success; 3 error, with one line on stderr; 130 or 143 after Ctrl-C or SIGTERM.");
        break;
    case ACTION_VERSION:
        printf("pathtracer %s, %s, libxml2 %s, nettle %d.%d\n", assay_version,
               image_library_version(), LIBXML_DOTTED_VERSION, NETTLE_VERSION_MAJOR,
               NETTLE_VERSION_MINOR);
        break;
    case ACTION_LIST:
        print_names("integrators", integrator_kind_names);
        print_names("direct", direct_kind_names);
        print_names("accels", bvh_kind_names);
        print_names("isas", isa_names);
        print_names("samplers", sampler_kind_names);
        print_names("dialects", dialect_names);
        break;
    }
}
