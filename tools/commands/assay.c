/* assay: one program, several verbs. */
#include "reference/base/gsl_errors.h"
#include "renderer/image/image_oiio.h"
#include "renderer/image/image.h"
#include "renderer/base/cli.h"
#include "renderer/base/version.h"
#include "tools/results/results.h"
#include "commands.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct {
    const char *name;
    int (*run)(int argc, char **argv, struct err *e);
    const char *help;
} verbs[] = {
    {"validate", command_validate, "render the suite and compare it with its references"},
    {"init", command_init, "create a working suite of your own: scene, reference, CI file"},
    {"compare", command_compare, "decide whether two renders agree; most image formats"},
    {"diagnose", command_diagnose, "identify the known bug that explains a renderer's errors"},
    {"converge", command_converge, "measure variance, convergence and efficiency of renderers"},
    {"grade", command_grade, "grade students' images and programs by a rubric"},
    {"report", command_report, "write the HTML page or the tables of a results.json"},
    {"golden", command_golden, "render, inspect and approve the stored references"},
    {"reference", command_reference, "same as golden render: by Cycles, POV-Ray or your renderer"},
    {"merge", command_merge, "combine renders of cells or sample ranges of one image"},
    {"reproduce", command_reproduce,
     "re-create a render or results, and compare with the original"},
    {"plan", command_plan, "split a render, grading, validation or references into jobs"},
    {"run-job", command_run_job, "run jobs of a plan"},
    {"gather", command_gather, "combine the results of a plan's jobs"},
    {"slurm", command_slurm, "plan, run and gather jobs on a Slurm cluster"},
    {"export", command_export, "write a scene for another renderer"},
};

static void print_help(void)
{
    puts("usage: assay VERB [options]\n");
    for (size_t i = 0; i < sizeof verbs / sizeof verbs[0]; i++)
        printf("  %-12s %s\n", verbs[i].name, verbs[i].help);
    puts("\n`assay VERB --help` lists its options.\n"
         "Exit code: 0 equivalent or as expected, 1 different or not as expected, 2 inconclusive\n"
         "or, without a margin, no difference found; 3 could not judge, with one line on stderr.");
}

/* The allocator of jansson, which is called in hundreds of places: a result that silently lacks a part would be
 * worse than none, so the program ends here if memory runs out, before the result is written. */
static void *json_memory(size_t size)
{
    void *p = malloc(size);
    if (p == NULL) {
        fputs("assay: out of memory\n", stderr);
        _exit(EXIT_NOT_JUDGED);
    }
    return p;
}

static const char *verb_name(const void *list, size_t i)
{
    (void)list;
    return i < sizeof verbs / sizeof verbs[0] ? verbs[i].name : NULL;
}

static void tell_unknown(const char *verb, struct err *e)
{
    const char *meant = cli_nearest(verb, verb_name, NULL);
    if (meant != NULL)
        err_set(e, "unknown verb '%s', did you mean %s? (see --help)", verb, meant);
    else
        err_set(e, "unknown verb '%s' (see --help)", verb);
}

int main(int argc, char **argv)
{
    json_set_alloc_funcs(json_memory, free);
    gsl_errors_of_memory_return();
    if (argc > 1 && (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0)) {
        print_help();
        return 0;
    }
    if (argc > 1 && strcmp(argv[1], "--version") == 0) {
        struct err why;
        const char *oiio = image_oiio_version(&why);
        printf("assay %s, %s, %s, jansson %s\n", assay_version, image_library_version(),
               oiio != NULL ? oiio : why.msg, JANSSON_VERSION);
        return 0;
    }
    struct err e = {0};
    int code = EXIT_NOT_JUDGED;
    bool found = false;
    for (size_t i = 0; argc > 1 && i < sizeof verbs / sizeof verbs[0]; i++)
        if (strcmp(argv[1], verbs[i].name) == 0) {
            found = true;
            code = verbs[i].run(argc - 1, argv + 1, &e);
        }
    if (argc < 2)
        err_set(&e, "no verb given (see --help)");
    else if (!found)
        tell_unknown(argv[1], &e);
    if (fflush(stdout) != 0 && e.msg[0] == '\0') {
        err_set(&e, "cannot write to standard output");
        code = EXIT_NOT_JUDGED;
    }
    if (e.msg[0] != '\0')
        fprintf(stderr, "assay: %s\n", e.msg);
    return code;
}
