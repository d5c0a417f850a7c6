/* assay import-check: our loader against Blender's. */
#include "reference/base/json_file.h"
#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "tools/validate/import_result.h"
#include "tools/results/results.h"
#include "commands.h"

enum { MAX_SCENES = 64 };
enum option { OPT_ONLY, OPT_SUITE, OPT_SHARE, OPT_WORK, OPT_JSON, OPT_TIMEOUT, OPT_HELP };

static const struct cli_option options[] = {
    [OPT_ONLY] = {0, "only", 1, "SCENE", "only this scene; may be given again"},
    [OPT_SUITE] = {0, "suite", 1, "DIR", "the scenes (reference/scenes)"},
    [OPT_SHARE] = {0, "share", 1, "DIR", "where blender_import.py is (reference)"},
    [OPT_WORK] = {0, "work", 1, "DIR", "temporary files (build/work)"},
    [OPT_JSON] = {0, "json", 1, "FILE", "write all numbers there too"},
    [OPT_TIMEOUT] = {0, "timeout", 1, "S", "seconds for Blender (3600)"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

struct settings {
    const char *only[MAX_SCENES], *suite, *json;
    int num_only;
    struct import_options opt;
    bool done;
};

static bool parse(int argc, char **argv, struct settings *s, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    bool ok = true;
    for (int i; ok && (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return false;
        const char *v = c.value[0];
        if (i == CLI_POSITIONAL)
            return err_set(e, "import-check takes no argument '%s'", v);
        switch ((enum option)i) {
        case OPT_ONLY:
            if (s->num_only == MAX_SCENES)
                return err_set(e, "--only: at most %d scenes", MAX_SCENES);
            s->only[s->num_only++] = v;
            break;
        case OPT_SUITE: s->suite = v; break;
        case OPT_SHARE: s->opt.share_dir = v; break;
        case OPT_WORK: s->opt.work_dir = v; break;
        case OPT_JSON: s->json = v; break;
        case OPT_TIMEOUT: ok = cli_double("--timeout", v, 1, 1e6, &s->opt.timeout_s, e); break;
        case OPT_HELP:
            puts("usage: assay import-check [options]\n");
            cli_print_options(stdout, options);
            s->done = true;
            return true;
        }
    }
    return ok;
}

int command_import_check(int argc, char **argv, struct err *e)
{
    struct settings s = {
        .suite = "reference/scenes",
        .opt = {.work_dir = "build/work", .share_dir = "reference", .timeout_s = 3600}};
    struct suite suite;
    if (!parse(argc, argv, &s, e))
        return EXIT_NOT_JUDGED;
    if (s.done)
        return 0;
    if (!fs_make_dirs(s.opt.work_dir, e) || !suite_load(s.suite, &suite, e))
        return EXIT_NOT_JUDGED;
    int code = EXIT_NOT_JUDGED;
    json_t *reports;
    if (import_result_check_suite(&suite, s.only, s.num_only, &s.opt, &reports, e)) {
        import_result_print(stdout, reports);
        if (s.json == NULL || json_write(s.json, reports, e))
            code = import_result_exit_code(reports);
        if (code == EXIT_NOT_JUDGED && e->msg[0] == '\0')
            err_set(e, "Blender's importer: a scene could not be judged, see above");
        json_decref(reports);
    }
    suite_free(&suite);
    return code;
}
