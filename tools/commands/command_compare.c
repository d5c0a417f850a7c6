/* assay compare: judges two renders. */
#include "renderer/base/cli.h"
#include "tools/validate/compare_job.h"
#include "tools/compare/region.h"
#include "tools/compare/variance_ratio.h"
#include "tools/compare/verdict.h"
#include "tools/results/results.h"
#include "commands.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] =
    "usage: assay compare [options] A B\n\n"
    "A is the image under test, B is the reference. Each is one of\n"
    "  a moments EXR (written by pathtracer or assay)\n"
    "  a directory of at least 3 replicates: float EXR or PFM, each with a different seed\n"
    "  an EXR of Mitsuba 3's moment integrator, or NAME.exr with NAME_var.exr (give --spp-a, --spp-b)\n"
    "  an image without moments: EXR, HDR, PFM; noise is estimated from neighbouring pixels of A - B\n"
    "  a PNG or PPM of 8 or 16 bits (give --curve)\n"
    "Any assumptions made about them are printed with the verdict. Procedure:\n"
    "tools/docs/background/verdict.md.\n";

struct settings {
    struct compare_job job;
    int num_paths;
    const char *json, *report, *expect;
    bool quiet, help;
};

static bool read_curve(void *settings, const char *const v[4], struct err *e)
{
    struct settings *s = settings;
    (void)e;
    s->job.input[0].curve = s->job.input[1].curve = v[0];
    return true;
}

#define TO(member) CLI_TO(struct settings, member)

static const struct cli_option options[] = {
    {0, "alpha", "A",
     "probability of a wrong DIFFERENT, and of a wrong EQUIVALENT, 1e-12\n"
     "to 0.4 (1e-3)",
     TO(job.opt.alpha), 1e-12, 0.4},
    {0, "margin", "D",
     "equivalence margin: largest relative difference of the image mean\n"
     "that counts as equal. Without a margin the verdict is never\n"
     "EQUIVALENT: any difference is tested for, and the minimum\n"
     "detectable difference is printed",
     TO(job.opt.margin_global), 0, 0.99},
    {0, "margin-tile", "D", "the same for one tile (4 x --margin)", TO(job.opt.margin_tile), 0,
     0.99},
    {0, "margin-variance", "D",
     "the same for the variance of one sample or replicate; without it\n"
     "variances are not judged",
     TO(job.opt.margin_variance), 0, 100},
    {0, "accept-mdb", "X",
     "without --margin: exit code 0 if no difference is found and the\n"
     "minimum detectable bias (MDB, relative) of the image is at most X",
     TO(job.accept_mdb[0]), 1e-9, 1000},
    {0, "accept-mdb-tile", "X", "the same for the MDB of one tile (4 x --accept-mdb)",
     TO(job.accept_mdb[1]), 1e-9, 1000},
    {0, "tile", "N", "side of a reporting tile, pixels (16)", TO(job.opt.tile), 1, 65536},
    {0, "again", "A2 B2",
     "the same renders with fresh seeds: DIFFERENT only if they confirm\n"
     "what A and B show; each stage is tested at sqrt(alpha)",
     TO(job.again)},
    {0, "paired", "",
     "A and B have correlated noise (same seed, two versions of a\n"
     "program): estimate it from A - B, which shows smaller differences;\n"
     "of two folders, each render is compared with that of its name",
     TO(job.paired)},
    {0, "exchangeable", "",
     "exact permutation test: A and B are directories of replicates of\n"
     "what should be the same program; takes no margins",
     TO(job.exchangeable)},
    {0, "same-program", "",
     "exact sign-flip test: A and B are renders with equal spp by two\n"
     "versions of one program, one image each or directories. DIFFERENT\n"
     "if the distribution of any pixel changed, which a better sampler\n"
     "also does. Valid at any alpha, under fireflies, from 1 spp, for\n"
     "PNGs without --curve. The comparison of the means, with --margin\n"
     "if given, is reported as a note",
     TO(job.same_program)},
    {0, "filter-width", "N",
     "for --same-program: pixels closer than N may share noise, as with a\n"
     "pixel filter N wide; only one in N x N is tested (all; if they\n"
     "seem to share noise: INCONCLUSIVE). 1, also for images without\n"
     "moments: each pixel has samples of its own, so that what larger\n"
     "squares show is no noise",
     TO(job.filter_width), 1, 1000},
    {0, "min-side", "N",
     "side of the smallest region of --exchangeable, pixels (about 1/32 of\n"
     "the image)",
     TO(job.min_side), 1, 65536},
    {0, "curve", "CURVE",
     "encoding curve of PNG and PPM files (radiance to code): srgb, linear,\n"
     "gamma=G (0.2 to 5), exposure=E (1 - exp(-E L), then srgb: Scotty3D's), or\n"
     "cgl, the assignment's",
     .read = read_curve},
    {0, "spp-a", "N",
     "samples per pixel of A, if its file only states a variance, or of\n"
     "each render of a directory",
     TO(job.input[0].spp), 1, 1e12},
    {0, "spp-b", "N", "the same for B", TO(job.input[1].spp), 1, 1e12},
    {0, "expect", "VERDICT",
     "verdict that gives exit code 0 (EQUIVALENT; with --accept-mdb\n"
     "NO DIFFERENCE FOUND)",
     TO(expect), .names = verdict_names},
    {0, "title", "TEXT", "heading of the HTML page", TO(job.title)},
    {0, "name-a", "NAME", "label of A in page and results (its path)", TO(job.name[0])},
    {0, "name-b", "NAME", "the same for B", TO(job.name[1])},
    {0, "json", "FILE", "write the result as a results.json", TO(json)},
    {'t', "threads", "N", "number of threads; 0: one per processor (0); no effect on results",
     TO(job.opt.threads), 0, 1024},
    {'r', "report", "FILE", "write the result and its images as one HTML page", TO(report)},
    {'q', "quiet", "", "print nothing; only return the exit code", TO(quiet)},
    {'h', "help", "", "print this", TO(help), .usage = usage},
    {.args = "two images", CLI_TO_LIST(struct settings, job.path, num_paths)}};

static bool check(struct settings *s, struct err *e)
{
    if (s->job.opt.threads == 0)
        s->job.opt.threads = cli_processors();
    if (s->num_paths != 2)
        return err_set(e, "compare needs two images (see --help)");
    if (!compare_job_check(&s->job, e))
        return false;
    if (s->expect != NULL && !verdict_parse(s->expect, &s->job.expected))
        return err_set(e, "--expect: '%s' is no verdict", s->expect);
    if (s->job.expected == VERDICT_NOTHING_FOUND && !(s->job.accept_mdb[0] > 0))
        return err_set(e, "--expect '%s' goes with --accept-mdb", s->expect);
    return true;
}

/* Rounds up to two digits, so that the printed bound still holds. */
static double round_up(double x)
{
    double unit = pow(10, floor(log10(x)) - 1);
    return ceil(x / unit) * unit;
}

/* Prints the ratio of the variances, if both sides state their noise. */
static void print_noise(const struct variance_ratio *v)
{
    if (v->valid)
        printf("noise: the variance of one %s of A is %.3g [%.3g, %.3g] times that of B\n",
               variance_ratio_of(v), v->ratio, v->lo, v->hi);
    else if (v->ratio > 0)
        printf("noise: the variance of one %s of A is about %.2g times that of B; %s leave no "
               "interval\n",
               variance_ratio_of(v), v->ratio,
               v->is_shared ? "pixels that share noise" : "rare bright paths");
}

static void print_result(const struct compare_job *job, const struct compared *c)
{
    const struct comparison *r = &c->r;
    const struct region *g = &r->global[3];
    char image[32], tile[32], more[128];
    region_mdb_text(r->mdb_global, image);
    region_mdb_text(r->mdb_tile, tile);
    printf("%s: %s\n", verdict_name(r->verdict), r->reason);
    if (job->exchangeable)
        printf("difference %+.3f %%, smallest detectable %s of the image; p = %.3g, smallest "
               "possible %.2g; %d regions\n",
               100 * g->difference, image, c->perm.p, c->perm.smallest_p, c->perm.num_regions);
    else if (job->same_program)
        printf("smallest detectable %s of the image, %s of a tile; p at most %.3g; %zu tests\n",
               image, tile, pow(10, c->flip.log10_p), c->flip.num_tests);
    else
        printf("difference %+.3f %% [%+.3f, %+.3f] (%s%.6g %% interval), smallest detectable %s of "
               "the image, %s of a tile; %d tests\n",
               100 * g->difference, 100 * g->ci_lo, 100 * g->ci_hi,
               g->ci_valid ? "" : "too skewed for a ", 100 - 200 * job->opt.alpha, image, tile,
               r->num_tests);
    print_noise(&r->variance);
    if (r->extra_factor > 1) {
        verdict_more_samples(r->extra_factor, "samples", verdict_is_near_margin(r), more);
        printf("%s\n", more);
    }
    for (int i = 0; i < c->notes.num; i++)
        printf("note: %s\n", c->notes.line[i]);
    if (r->verdict != VERDICT_NOTHING_FOUND || compare_job_passes(job, c))
        return;
    if (r->mdb_tile < region_mdb_none)
        printf("for CI: --accept-mdb %.2g --accept-mdb-tile %.2g makes this exit with 0%s\n",
               round_up(r->mdb_global), round_up(fmax(r->mdb_global, r->mdb_tile)),
               job->same_program || job->exchangeable
                   ? ""
                   : ", as does --margin D where both are shown to be equal within D");
    else if (!job->same_program && !job->exchangeable)
        printf("for CI: --margin D exits with 0 where both are shown to be equal within D\n");
}

int command_compare(int argc, char **argv, struct err *e)
{
    struct settings s = {.job.opt = {.alpha = 1e-3, .margin_tile = -1, .tile = 16}};
    struct compared c;
    if (!cli_read(options, argc, argv, &s, e))
        return EXIT_NOT_JUDGED;
    if (s.help)
        return 0;
    if (!check(&s, e) || !compare_job_run(&s.job, &c, e))
        return EXIT_NOT_JUDGED;
    int code = EXIT_INCONCLUSIVE;
    if (compare_job_passes(&s.job, &c))
        code = EXIT_EQUIVALENT;
    else if (verdict_decides(c.r.verdict))
        code = EXIT_DIFFERENT;
    if (!s.quiet)
        print_result(&s.job, &c);
    if (s.json != NULL && !compare_job_write_json(&s.job, &c, s.json, argc, argv, e))
        code = EXIT_NOT_JUDGED;
    if (s.report != NULL && !compare_job_write_report(&s.job, &c, s.report, argc, argv, e))
        code = EXIT_NOT_JUDGED;
    compare_job_free(&c);
    return code;
}
