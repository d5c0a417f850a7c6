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

enum option {
    OPT_SPP,
    OPT_SAMPLES,
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
    OPT_ADAPTIVE_UNBIASED,
    OPT_PILOT,
    OPT_TIME,
    OPT_ERROR,
    OPT_WRITE_EVERY,
    OPT_RESUME,
    OPT_KEEP_STATE,
    OPT_ENVIRONMENT,
    OPT_LENS,
    OPT_FOCUS,
    OPT_SLURM,
    OPT_OUT,
    OPT_AOV,
    OPT_HEATMAP,
    OPT_RESOLUTION,
    OPT_CELL,
    OPT_CAMERA,
    OPT_SEED,
    OPT_SAMPLER,
    OPT_INTEGRATOR,
    OPT_ACCEL,
    OPT_ISA,
    OPT_DIALECT,
    OPT_FRESNEL,
    OPT_FRAME,
    OPT_STARTER,
    OPT_QUIET,
    OPT_LIST,
    OPT_VERSION,
    OPT_HELP
};

static const struct cli_option options[] = {
    [OPT_SPP] = {'s', "spp", 1, "N", "paths per pixel (16)"},
    [OPT_SAMPLES] = {0, "samples", 1, "A:B",
                     "only sample numbers A to B-1 of those (0:spp); assay merge\n"
                     "adds such shares"},
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
    [OPT_ROULETTE] = {0, "roulette", 1, "on|off|P",
                      "end paths at random, without bias: dim ones, or all, which\n"
                      "go on with probability P, 0.7 in the assignment (on)"},
    [OPT_ADAPTIVE] = {'a', "adaptive", 2, "N TOL",
                      "every N samples a pixel stops if its 95 % interval\n"
                      "is within TOL of its mean; biased (off)"},
    [OPT_ADAPTIVE_UNBIASED] = {0, "adaptive-unbiased", 1, "TOL",
                               "a pilot that is not averaged in decides how many samples\n"
                               "a pixel needs for that; unbiased (off)"},
    [OPT_PILOT] = {0, "pilot", 1, "N", "samples per pixel of the pilot (32)"},
    [OPT_TIME] = {0, "time", 1, "T", "stop after 90, 90s, 5m or 2h (off; -s is then unlimited)"},
    [OPT_ERROR] = {0, "error", 1, "P%",
                   "stop when the root mean square standard error of a pixel is\n"
                   "P % of the mean luminance (off; -s is then unlimited)"},
    [OPT_WRITE_EVERY] = {0, "write-every", 1, "T",
                         "write pictures and state meanwhile, every 60, 60s, 5m, 1h (off)"},
    [OPT_RESUME] = {0, "resume", 1, "FILE",
                    "go on with the render that left FILE.state; same options"},
    [OPT_KEEP_STATE] = {0, "keep-state", 0, "",
                        "leave the state beside the first picture even when done,\n"
                        "to add samples later"},
    [OPT_ENVIRONMENT] = {'e', "environment", 1, "FILE",
                         "environment map in latitude and longitude, .exr or .hdr"},
    [OPT_LENS] = {'b', "lens-radius", 1, "R", "thin lens, scene units; 0: pinhole (0)"},
    [OPT_FOCUS] = {'d', "focal-distance", 1, "D", "distance in focus, scene units (4.7)"},
    [OPT_SLURM] = {0, "slurm", 1, "N",
                   "in N jobs on a Slurm cluster, by the assay beside this program;\n"
                   "the same bits (off)"},
    [OPT_OUT] = {'f', "out", 1, "FILE",
                 "picture; may be given again. .exr: float32 with moments,\n"
                 ".png: 8 bits by the dialect's tone curve"},
    [OPT_AOV] = {0, "aov", 0, "",
                 "add to .exr: variance, stderr, depth, normal, albedo, object id"},
    [OPT_HEATMAP] = {0, "heatmap", 1, "FILE",
                     "PNG of the BVH nodes that the ray through each pixel's\n"
                     "centre visits"},
    [OPT_RESOLUTION] = {'r', "resolution", 2, "W H", "pixels (800 600)"},
    [OPT_CELL] = {'p', "cell", 4, "X Y DX DY", "render only this cell, origin at the bottom left"},
    [OPT_CAMERA] = {'c', "camera", 1, "FILE",
                    "camera settings as the assignment's GUI writes them"},
    [OPT_SEED] = {0, "seed", 1, "N", "64-bit seed of all samples (1)"},
    [OPT_SAMPLER] = {0, "sampler", 1, "NAME",
                     "independent or sobol: less noise, but unknown error (independent)"},
    [OPT_INTEGRATOR] = {0, "integrator", 1, "NAME", "path or normals (path)"},
    [OPT_ACCEL] = {0, "accel", 1, "NAME", "bruteforce, centroid, sah or wide (wide)"},
    [OPT_ISA] = {0, "isa", 1, "NAME",
                 "vector instructions: auto, sse4.2, avx2, avx512, or scalar\n"
                 "paths; all give the same picture (auto; scalar with another\n"
                 "--accel than wide)"},
    [OPT_DIALECT] = {0, "dialect", 1, "NAME",
                     "auto, collada or cgl: whose rules for camera and lights;\n"
                     "auto: cgl if the file has CGL extras (auto)"},
    [OPT_FRESNEL] = {0, "fresnel", 1, "HOW",
                     "of glass: exact, or schlick as in the assignment (exact)"},
    [OPT_FRAME] = {0, "frame", 1, "HOW",
                   "dialect cgl: crop the assignment's 800 x 600 to -r as it\n"
                   "does, or the whole of it (crop)"},
    [OPT_STARTER] = {0, "starter", 1, "DEFECT",
                     "do wrong what the assignment's starter code does: light-pdf,\n"
                     "turned-lamp, beckmann; for grading; may be given again"},
    [OPT_QUIET] = {'q', "quiet", 0, "", "no progress, no statistics"},
    [OPT_LIST] = {0, "list", 0, "", "print the names that options take"},
    [OPT_VERSION] = {0, "version", 0, "", "print version and libraries"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

static const char *const fresnel_names[] = {"exact", "schlick", NULL};
static const char *const frame_names[] = {"crop", "whole", NULL};
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

static void print_help(void)
{
    puts("usage: pathtracer [options] -f OUT.exr SCENE.dae\n\n"
         "Renders a COLLADA scene by path tracing. Every option with its default:\n");
    cli_print_options(stdout, options);
    puts("\nCtrl-C (or SIGTERM) ends the pass, writes what there is and says how to go on.\n"
         "Exit code: 0; 3 with one line on stderr; 130 or 143 after Ctrl-C or SIGTERM.");
}

static bool parse_only(struct options *s, const char *text, struct err *e)
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

static bool parse_roulette(const char *text, struct options *s, struct err *e)
{
    s->roulette = strcmp(text, "off") == 0  ? ROULETTE_OFF
                  : strcmp(text, "on") == 0 ? ROULETTE_THROUGHPUT
                                            : ROULETTE_FIXED;
    return s->roulette != ROULETTE_FIXED ||
           (cli_double("--roulette", text, 0.01, 1, &s->survival, e) ||
            err_set(e, "--roulette: '%s' is neither on, off, nor a probability in 0.01..1", text));
}

static bool add_output(struct options *s, const char *path, struct err *e)
{
    if (!has_ending(path, ".exr") && !has_ending(path, ".png"))
        return err_set(e, "--out: '%s' ends neither in .exr nor in .png", path);
    if (s->num_outputs == MAX_OUTPUTS)
        return err_set(e, "--out: at most %d files", MAX_OUTPUTS);
    s->output[s->num_outputs++] = path;
    return true;
}

static const struct cli_unit percent[] = {{"%", 0.01}, {NULL, 0.01}};

static bool parse_range(struct options *s, const char *text, struct err *e)
{
    char first[32] = "";
    const char *colon = strchr(text, ':');
    if (colon == NULL || colon - text >= (ptrdiff_t)sizeof first)
        return err_set(e, "--samples: '%s' is not a range A:B", text);
    memcpy(first, text, (size_t)(colon - text));
    if (!cli_int("--samples", first, 0, MAX_SPP - 1, &s->first, e) ||
        !cli_int("--samples", colon + 1, 1, MAX_SPP, &s->last, e))
        return false;
    return s->first < s->last || err_set(e, "--samples: no sample in '%s'", text);
}

static bool parse_cell(struct options *s, const char *const value[4], struct err *e)
{
    for (int k = 0; k < 4; k++)
        if (!cli_int("--cell", value[k], k < 2 ? 0 : 1, 65535, &s->cell[k], e))
            return false;
    return true;
}

static bool parse_starter(struct options *s, const char *v, struct err *e)
{
    int which;
    if (!cli_choice("--starter", v, cs184_deviation_names, &which, e))
        return false;
    s->starter |= 1u << which;
    return true;
}

/* One option; *accumulate is -o, which counts only after all of them are read. */
static bool parse_option(struct options *s, enum option o, const struct cli *c, int *accumulate,
                         struct err *e)
{
    const char *v = c->value[0];
    switch (o) {
    case OPT_SPP: return cli_int("--spp", v, 1, MAX_SPP, &s->spp, e);
    case OPT_SAMPLES: return parse_range(s, v, e);
    case OPT_LIGHT_SAMPLES: return cli_int("--light-samples", v, 1, 65536, &s->light_samples, e);
    case OPT_THREADS: return cli_int("--threads", v, 0, 1024, &s->threads, e);
    case OPT_BOUNCES: return cli_int("--max-bounces", v, 0, 10000, &s->max_bounces, e);
    case OPT_ACCUMULATE: return cli_int("--accumulate", v, 0, 1, accumulate, e);
    case OPT_FIRST_BOUNCE: return cli_int("--first-bounce", v, 0, 10000, &s->first_bounce, e);
    case OPT_ONLY: return parse_only(s, v, e);
    case OPT_HEMISPHERE: s->direct = DIRECT_HEMISPHERE; return true;
    case OPT_DIRECT: return cli_choice("--direct", v, direct_kind_names, &s->direct, e);
    case OPT_ROULETTE: return parse_roulette(v, s, e);
    case OPT_ADAPTIVE:
        return cli_int("--adaptive", v, 1, 1 << 24, &s->adaptive_batch, e) &&
               cli_double("--adaptive", c->value[1], 0, 1e6, &s->adaptive_tolerance, e);
    case OPT_ADAPTIVE_UNBIASED:
        return cli_double("--adaptive-unbiased", v, 0, 1e6, &s->pilot_tolerance, e);
    case OPT_PILOT: return cli_int("--pilot", v, 2, 1 << 20, &s->pilot, e);
    case OPT_TIME: return cli_with_unit("--time", v, cli_time_units, 1e9, &s->max_seconds, e);
    case OPT_ERROR: return cli_with_unit("--error", v, percent, 100, &s->max_error, e);
    case OPT_WRITE_EVERY:
        return cli_with_unit("--write-every", v, cli_time_units, 1e9, &s->write_every, e);
    case OPT_RESUME: s->resume = v; return true;
    case OPT_KEEP_STATE: s->keep_state = true; return true;
    case OPT_ENVIRONMENT: s->environment_file = v; return true;
    case OPT_LENS: return cli_double("--lens-radius", v, 0, 1e6, &s->lens_radius, e);
    case OPT_FOCUS: return cli_double("--focal-distance", v, 1e-6, 1e9, &s->focal_distance, e);
    case OPT_SLURM: return cli_int("--slurm", v, 1, 1000000, &s->slurm, e);
    case OPT_OUT: return add_output(s, v, e);
    case OPT_AOV: s->aov = true; return true;
    case OPT_HEATMAP:
        s->heatmap = v;
        return has_ending(v, ".png") || err_set(e, "--heatmap: '%s' does not end in .png", v);
    case OPT_RESOLUTION:
        return cli_int("--resolution", v, 1, 65535, &s->width, e) &&
               cli_int("--resolution", c->value[1], 1, 65535, &s->height, e);
    case OPT_CELL: return parse_cell(s, c->value, e);
    case OPT_CAMERA: s->camera_file = v; return true;
    case OPT_SEED: return cli_uint64("--seed", v, &s->seed, e);
    case OPT_SAMPLER: return cli_choice("--sampler", v, sampler_kind_names, &s->sampler, e);
    case OPT_FRESNEL: return cli_choice("--fresnel", v, fresnel_names, &s->fresnel, e);
    case OPT_FRAME: return cli_choice("--frame", v, frame_names, &s->frame, e);
    case OPT_STARTER: return parse_starter(s, v, e);
    case OPT_INTEGRATOR: return cli_choice("--integrator", v, integrator_kind_names, &s->kind, e);
    case OPT_ACCEL: return cli_choice("--accel", v, bvh_kind_names, &s->accel, e);
    case OPT_ISA: return cli_choice("--isa", v, isa_names, &s->isa, e);
    case OPT_DIALECT: return cli_choice("--dialect", v, dialect_names, &s->dialect, e);
    case OPT_QUIET: s->quiet = true; return true;
    case OPT_LIST: s->action = ACTION_LIST; return true;
    case OPT_VERSION: s->action = ACTION_VERSION; return true;
    case OPT_HELP: s->action = ACTION_HELP; return true;
    }
    return false;
}

/* What only all options together tell. */
static bool complete(struct options *s, int accumulate, struct err *e)
{
    if (!accumulate)
        s->first_bounce = s->max_bounces;
    if (s->scene == NULL)
        return err_set(e, "no scene given (see --help)");
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
        return err_set(e, "--cell: %d %d %d %d reaches out of the %d x %d picture", s->cell[0],
                       s->cell[1], s->cell[2], s->cell[3], s->width, s->height);
    if ((s->adaptive_batch > 0 || s->pilot_tolerance >= 0 || s->max_error > 0) &&
        s->sampler != SAMPLER_INDEPENDENT)
        return err_set(e,
                       "--adaptive and --error estimate the error from samples that have to be "
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
                          .roulette = ROULETTE_THROUGHPUT,
                          .seed = 1,
                          .pilot = 32,
                          .pilot_tolerance = -1,
                          .lens_radius = -1,
                          .focal_distance = -1};
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
        if (s->action != ACTION_RENDER)
            return true;
    }
    return complete(s, accumulate, e);
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
    case ACTION_RENDER: break;
    case ACTION_HELP: print_help(); break;
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
