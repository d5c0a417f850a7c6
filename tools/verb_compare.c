#include "../renderer/cli.h"
#include "../renderer/fs.h"
#include "claim.h"
#include "results.h"
#include "verbs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum option {
    OPT_ALPHA,
    OPT_MARGIN,
    OPT_MARGIN_TILE,
    OPT_TILE,
    OPT_EXPECT,
    OPT_JSON,
    OPT_QUIET,
    OPT_HELP
};

static const struct cli_option options[] = {
    [OPT_ALPHA] = {0, "alpha", 1, "A",
                   "chance of a wrong DIFFERENT, and of a wrong EQUIVALENT (1e-3)"},
    [OPT_MARGIN] = {0, "margin", 1, "D",
                    "largest relative difference of the image mean that\n"
                    "counts as equal; 0: any difference counts (0)"},
    [OPT_MARGIN_TILE] = {0, "margin-tile", 1, "D", "the same for one tile (4 x --margin)"},
    [OPT_TILE] = {0, "tile", 1, "N", "side of a reporting tile, pixels (16, or the whole image)"},
    [OPT_EXPECT] = {0, "expect", 1, "VERDICT", "what exit code 0 stands for (EQUIVALENT)"},
    [OPT_JSON] = {0, "json", 1, "FILE", "write the claim as results.json"},
    [OPT_QUIET] = {'q', "quiet", 0, "", "print nothing; the exit code says it"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

struct settings {
    const char *path[2];
    int num_paths;
    const char *json;
    struct compare_options opt;
    enum verdict expect;
    bool quiet, done;
};

static bool parse(int argc, char **argv, struct settings *s, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    bool ok = true, has_tile_margin = false;
    for (int i; ok && (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return false;
        const char *v = c.value[0];
        if (i == CLI_POSITIONAL) {
            if (s->num_paths == 2)
                return err_set(e, "compare takes two images, '%s' is one more", v);
            s->path[s->num_paths++] = v;
            continue;
        }
        switch ((enum option)i) {
        case OPT_ALPHA: ok = cli_double("--alpha", v, 1e-12, 0.4, &s->opt.alpha, e); break;
        case OPT_MARGIN: ok = cli_double("--margin", v, 0, 0.99, &s->opt.margin_global, e); break;
        case OPT_MARGIN_TILE:
            ok = cli_double("--margin-tile", v, 0, 0.99, &s->opt.margin_tile, e);
            has_tile_margin = true;
            break;
        case OPT_TILE: ok = cli_int("--tile", v, 1, 65536, &s->opt.tile, e); break;
        case OPT_EXPECT:
            if (!verdict_parse(v, &s->expect))
                return err_set(e, "--expect: '%s' is none of: EQUIVALENT, DIFFERENT, INCONCLUSIVE",
                               v);
            break;
        case OPT_JSON: s->json = v; break;
        case OPT_QUIET: s->quiet = true; break;
        case OPT_HELP:
            puts("usage: assay compare [options] A.exr B.exr\n\n"
                 "A is tested, B is the reference; both are moments images.\n");
            cli_print_options(stdout, options);
            s->done = true;
            return true;
        }
    }
    if (!ok)
        return false;
    if (s->num_paths != 2)
        return err_set(e, "compare needs two images (see --help)");
    if (!has_tile_margin)
        s->opt.margin_tile = fmin(4 * s->opt.margin_global, 0.99);
    return true;
}

static void print_result(const struct comparison *r)
{
    const struct region *g = &r->global[3];
    printf("%s: %s\n", verdict_name(r->verdict), r->reason);
    printf("difference %+.3f %% [%+.3f, %+.3f], smallest detectable %.3f %% of the image, %.2f %% "
           "of a tile; %d tests\n",
           100 * g->difference, 100 * g->ci_lo, 100 * g->ci_hi, 100 * r->mdb_global,
           100 * r->mdb_tile, r->num_tests);
    if (r->verdict == VERDICT_INCONCLUSIVE && r->extra_factor > 1)
        printf("about %.1f times the samples would decide\n", r->extra_factor);
}

/* The z and difference maps stand beside the JSON file and the report can be made of it. */
static bool write_json(const struct settings *s, const struct comparison *r,
                       const struct moments m[2], int argc, char **argv, struct err *e)
{
    const struct claim_context c = {
        .a = s->path[0], .b = s->path[1], .expected = s->expect, .opt = s->opt};
    char z[4096], relative[4096];
    const char *slash = strrchr(s->json, '/');
    const char *base = slash ? slash + 1 : s->json;
    snprintf(z, sizeof z, "%s.z.exr", s->json);
    snprintf(relative, sizeof relative, "%s.relative.exr", s->json);
    if (!make_parent_dirs(s->json, e) || !image_write_exr(z, &r->z, e) ||
        !image_write_exr(relative, &r->relative, e))
        return false;
    char *path[2] = {realpath(s->path[0], NULL), realpath(s->path[1], NULL)};
    json_t *root = results_new(argc, argv, s->opt.alpha);
    json_t *claim = claim_judged(&c, r);
    bool ok = root != NULL && claim != NULL && path[0] != NULL && path[1] != NULL;
    if (ok) {
        claim_add_observations(claim, "a", &m[0]);
        claim_add_observations(claim, "b", &m[1]);
        json_object_set_new(claim, "files",
                            json_pack("{s:s, s:s, s:s+, s:s+}", "a", path[0], "b", path[1], "z",
                                      base, ".z.exr", "relative", base, ".relative.exr"));
        json_array_append(json_object_get(root, "claims"), claim);
        ok = json_write(s->json, root, e);
    } else {
        err_set(e, "%s: out of memory, or an image's full path is not known", s->json);
    }
    free(path[0]);
    free(path[1]);
    json_decref(claim);
    json_decref(root);
    return ok;
}

int verb_compare(int argc, char **argv, struct err *e)
{
    struct settings s = {.opt = {.alpha = 1e-3}, .expect = VERDICT_EQUIVALENT};
    struct moments m[2] = {{0}};
    struct comparison r = {0};
    int code = EXIT_NOT_JUDGED;
    if (!parse(argc, argv, &s, e))
        return code;
    if (s.done)
        return 0;
    if (!moments_read(s.path[0], &m[0], NULL, e) || !moments_read(s.path[1], &m[1], NULL, e))
        goto done;
    if (s.opt.tile == 0) {
        s.opt.tile = 16;
        if (m[1].width % 16 != 0 || m[1].height % 16 != 0)
            s.opt.tile = m[1].width == m[1].height ? m[1].width : 1;
    }
    if (!compare_moments(&m[0], &m[1], &s.opt, &r, e))
        goto done;
    if (!s.quiet)
        print_result(&r);
    if (s.json != NULL && !write_json(&s, &r, m, argc, argv, e))
        goto done;
    if (r.verdict == s.expect)
        code = EXIT_EQUIVALENT;
    else if (r.verdict == VERDICT_INCONCLUSIVE)
        code = EXIT_INCONCLUSIVE;
    else
        code = EXIT_DIFFERENT;
done:
    comparison_free(&r);
    moments_free(&m[0]);
    moments_free(&m[1]);
    return code;
}
