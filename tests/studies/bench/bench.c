/* bench [--build DIR] [--out DIR] [--isa NAME] [--rounds N] [--smoke] [--only SCENE]... [PART...]
 *
 * Measures the parts named, or all: rays, paths, jobs, scaling. Tables on standard output; OUT/results.json and plots as SVG.
 * Exits with 1 where results differ, with 3 where it could not measure. */
#include "bench.h"

#include "renderer/base/fs.h"

#include <stdio.h>
#include <stdlib.h>
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
enum { NUM_PARTS = sizeof parts / sizeof parts[0], MAX_ONLY = 16 };

bool bench_wanted(const struct bench_options *o, const char *scene)
{
    for (int i = 0; o->only[i] != NULL; i++)
        if (strcmp(scene, o->only[i]) == 0)
            return true;
    return o->only[0] == NULL;
}

static _Noreturn void usage(void)
{
    fputs(
        "usage: bench [--build DIR] [--out DIR] [--isa NAME] [--rounds N] [--smoke] [--only SCENE]... [PART...]; "
        "parts:",
        stderr);
    for (int i = 0; i < NUM_PARTS; i++)
        fprintf(stderr, " %s", parts[i].name);
    fputc('\n', stderr);
    exit(3);
}

/* The parts named are argv[*at] and on. */
static void parse(int argc, char **argv, struct bench_options *o, const char *only[MAX_ONLY + 1],
                  int *at)
{
    int num_only = 0, isa = ISA_AUTO;
    for (*at = 1; *at < argc && argv[*at][0] == '-'; (*at)++) {
        const char *name = argv[*at];
        if (strcmp(name, "--smoke") == 0) {
            o->smoke = true;
            o->rounds = 1;
            continue;
        }
        if (++*at == argc)
            usage();
        const char *value = argv[*at];
        if (strcmp(name, "--build") == 0)
            o->build = value;
        else if (strcmp(name, "--out") == 0)
            o->out = value;
        else if (strcmp(name, "--rounds") == 0)
            o->rounds = atoi(value);
        else if (strcmp(name, "--only") == 0 && num_only < MAX_ONLY)
            only[num_only++] = value;
        else if (strcmp(name, "--isa") == 0)
            for (isa = 0; isa_names[isa] != NULL && strcmp(isa_names[isa], value) != 0;)
                isa++;
        else
            usage();
    }
    if (o->rounds < 1 || o->rounds > BENCH_MAX_ROUNDS || isa_names[isa] == NULL)
        usage();
    o->isa = (enum isa)isa;
    for (int i = *at; i < argc; i++) {
        int k = 0;
        while (k < NUM_PARTS && strcmp(argv[i], parts[k].name) != 0)
            k++;
        if (k == NUM_PARTS)
            usage();
    }
}

int main(int argc, char **argv)
{
    const char *only[MAX_ONLY + 1] = {NULL};
    struct bench_options o = {.rounds = 7, .build = "build", .out = "build/bench", .only = only};
    struct err e = {0};
    int first;
    parse(argc, argv, &o, only, &first);
    setvbuf(stdout, NULL, _IOLBF, 0);
    char path[4096];
    snprintf(path, sizeof path, "%s/results.json", o.out);
    bool wrong = false, ok = fs_make_dirs(o.out, &e);
    json_t *all = json_object();
    for (int k = 0; ok && k < NUM_PARTS; k++) {
        bool asked = first == argc;
        for (int i = first; i < argc; i++)
            asked |= strcmp(argv[i], parts[k].name) == 0;
        if (!asked)
            continue;
        json_t *part = parts[k].measure(&o, &wrong, &e);
        ok = part != NULL && json_object_set_new(all, parts[k].name, part) == 0;
        putchar('\n');
    }
    if (ok && json_dump_file(all, path, JSON_INDENT(1)) != 0)
        ok = err_set(&e, "%s: cannot write", path);
    json_decref(all);
    if (!ok) {
        fprintf(stderr, "bench: %s\n", e.msg);
        return 3;
    }
    return wrong;
}
