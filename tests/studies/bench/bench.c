/* bench: measures the parts named, or all: rays, paths, jobs, scaling. Tables on standard output; OUT/results.json. Exits with 1
 * where results differ, with 3 where it could not measure. */
#include "bench.h"

#include "reference/base/json_file.h"
#include "renderer/base/cli.h"
#include "renderer/base/fs.h"

#include <stdio.h>
#include <string.h>

static const struct {
    const char *name;
    json_t *(*measure)(const struct bench_options *o, bool *wrong, struct err *e);
} parts[] = {
    {"rays", bench_rays},
    {"paths", bench_paths},
    {"jobs", bench_jobs},
    {"scaling", bench_scaling},
};
enum { NUM_PARTS = sizeof parts / sizeof parts[0] };

#define TO(member) CLI_TO(struct bench_options, member)
static const struct cli_option options[] = {
    {0, "build", "DIR", "where pathtracer is (build)", TO(build)},
    {0, "out", "DIR", "of results.json (build/bench)", TO(out)},
    {0, "isa", "NAME", "instructions of ours (auto)", TO(isa), .names = isa_names},
    {0, "rounds", "N", "of which the medians are (7)", TO(rounds), 1, BENCH_MAX_ROUNDS},
    {0, "smoke", "", "one tiny case of each part, to see that it runs", TO(smoke)},
    {0, "only", "SCENE", "may be given again", CLI_TO_LIST(struct bench_options, only, num_only),
     .noun = "scenes"},
    {'h', "help", "", "print this", TO(help),
     .usage = "usage: bench [options] [rays | paths | jobs | scaling] ...\n"},
    {.noun = "parts", CLI_TO_LIST(struct bench_options, parts, num_parts)}};

static bool is_among(const char *const *names, int num, const char *name)
{
    for (int i = 0; i < num; i++)
        if (strcmp(names[i], name) == 0)
            return true;
    return num == 0;
}

bool bench_wanted(const struct bench_options *o, const char *scene)
{
    return is_among(o->only, o->num_only, scene);
}

static bool measure(struct bench_options *o, json_t *all, bool *wrong, struct err *e)
{
    const char *words[NUM_PARTS + 1] = {NULL};
    int ignored;
    for (int k = 0; k < NUM_PARTS; k++)
        words[k] = parts[k].name;
    for (int i = 0; i < o->num_parts; i++)
        if (!cli_choice("part", o->parts[i], words, &ignored, e))
            return false;
    if (!fs_make_dirs(o->out, e))
        return false;
    for (int k = 0; k < NUM_PARTS; k++) {
        if (!is_among(o->parts, o->num_parts, parts[k].name))
            continue;
        json_t *part = parts[k].measure(o, wrong, e);
        if (part == NULL)
            return false;
        json_object_set_new(all, parts[k].name, part);
        putchar('\n');
    }
    return json_write(fs_path("%s/results.json", o->out).s, all, e);
}

int main(int argc, char **argv)
{
    struct bench_options o = {.isa = ISA_AUTO, .rounds = 7, .build = "build", .out = "build/bench"};
    struct err e = {0};
    bool wrong = false, ok = cli_read(options, argc, argv, &o, &e);
    json_t *all = json_object();
    if (o.smoke)
        o.rounds = 1;
    setvbuf(stdout, NULL, _IOLBF, 0);
    ok = ok && (o.help || measure(&o, all, &wrong, &e));
    json_decref(all);
    if (!ok) {
        fprintf(stderr, "bench: %s\n", e.msg);
        return 3;
    }
    return wrong;
}
