/* Every allocation fails in turn, those of jansson and of other libraries too, in what plans work, does a job of it and puts the
 * jobs together. The program of the jobs is a script that copies what a render would have left. */
#include "tests/support/alloc_fail.h"

#include "renderer/transport/film.h"
#include "renderer/base/fs.h"
#include "renderer/pathtracer/render_id.h"
#include "renderer/pathtracer/options.h"
#include "renderer/base/sha256.h"
#include "renderer/pathtracer/checkpoint.h"
#include "tools/results/claim_result.h"
#include "tools/jobs/plan.h"

#include <fcntl.h>
#include <libxml/xmlerror.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static char dir[] = "/tmp/test_memory_plan_XXXXXX";
static char picture[128], plan_dir[128], program[128];

static int make_place(void **state)
{
    (void)state;
    struct err e;
    if (mkdtemp(dir) == NULL)
        return -1;
    snprintf(picture, sizeof picture, "%s/out/x.png", dir);
    snprintf(plan_dir, sizeof plan_dir, "%s/plan", dir);
    snprintf(program, sizeof program, "%s/program", dir);
    return fs_make_parent_dirs(picture, &e) ? 0 : -1;
}

static int remove_place(void **state)
{
    struct err e;
    alloc_fail_sum(state);
    return fs_remove_tree(dir, &e) ? 0 : -1;
}

static char *command[] = {"pathtracer", "-q", "-r", "8",     "32",
                          "-s",         "4",  "-f", picture, "reference/scenes/12_point_plane.dae",
                          NULL};
static const struct plan_wishes wishes = {.parts = 2, .ranges = 2, .pathtracer = program};
enum { WORDS = sizeof command / sizeof command[0] - 1 };

/* Writes the state that each job would leave where the script finds it, by its words. */
static void write_states(const struct plan *p)
{
    for (int k = 0; k < p->num; k++) {
        json_t *job = json_loads(p->line[k], 0, NULL);
        int num;
        char **more = plan_words(json_object_get(job, "words"), &num), *argv[WORDS + 16], path[256];
        struct options o;
        struct render_id id;
        struct film f;
        struct err e = {0};
        assert_true(num <= 16);
        memcpy(argv, command, sizeof command);
        memcpy(argv + WORDS, more, (size_t)(num + 1) * sizeof *more);
        assert_true(options_parse(WORDS + num, argv, &o, &e) && render_id_make(&o, &id, &e) &&
                    film_alloc(&f, o.cell[2], o.cell[3], false, &e));
        f.num_samples = (uint32_t)(o.last - o.first);
        for (size_t i = 0; i < (size_t)(o.cell[2] * o.cell[3]); i++)
            for (int n = o.first; n < o.last; n++)
                moments_add(&f.m, i, (double[3]){o.cell[1], 0.5, n});
        snprintf(path, sizeof path, "%s/%d_%d:%d.state", dir, o.cell[1], o.first, o.last);
        assert_true(checkpoint_write(path, &id, &f, &e));
        film_free(&f);
        free(more);
        json_decref(job);
    }
}

static void write_program(void)
{
    FILE *f = fopen(program, "w");
    assert_non_null(f);
    fprintf(
        f,
        "#!/bin/sh\nwhile [ $# -gt 0 ]; do case $1 in -f) out=$2;; -p) y=$3;; --samples) n=$2;; "
        "esac; shift; done\ncp '%s'/${y}_$n.state \"$out.state\"\n",
        dir);
    assert_int_equal(fclose(f), 0);
    assert_int_equal(chmod(program, 0755), 0);
}

static char *plan_lines(const struct plan *p)
{
    size_t room = 1;
    for (int k = 0; k < p->num; k++)
        room += strlen(p->line[k]) + 1;
    char *text = calloc(room, 1);
    assert_non_null(text);
    for (int k = 0; k < p->num; k++)
        strcat(strcat(text, p->line[k]), "\n");
    return text;
}

static bool make_plan(void *ctx, struct err *e)
{
    char **right = ctx, path[200];
    struct plan p = {.dir = "", .head = NULL};
    bool ok = plan_make(plan_dir, WORDS, command, &wishes, &p, e);
    alloc_fail_off();
    assert_int_equal(ok, p.head != NULL);
    snprintf(path, sizeof path, "%s/plan.jsonl", plan_dir);
    if (ok && right != NULL) {
        char *lines = plan_lines(&p);
        if (*right == NULL)
            *right = strdup(lines);
        assert_string_equal(*right, lines);
        free(lines);
    }
    if (ok) {
        plan_free(&p);
        assert_true(plan_read(plan_dir, &p, e));
        assert_int_equal(p.num, 4);
        plan_free(&p);
    }
    alloc_fail_output(path, ok);
    return ok;
}

static bool read_plan(void *ctx, struct err *e)
{
    const char *right = ctx;
    struct plan p = {.dir = "", .head = NULL};
    bool ok = plan_read(plan_dir, &p, e);
    alloc_fail_off();
    if (ok) {
        char *lines = plan_lines(&p);
        assert_string_equal(right, lines);
        free(lines);
        plan_free(&p);
    }
    return ok;
}

static bool do_job(void *ctx, struct err *e)
{
    const struct plan *p = ctx;
    char path[PLAN_PATH + 256];
    struct err none = {0};
    bool made = false, ok = job_run(p, 0, &made, e);
    alloc_fail_off();
    assert_int_equal(ok, made);
    assert_int_equal(ok, job_run_is_made(p, 0));
    assert_true(!ok || job_run_verify(p, 0, &none));
    job_run_artefact(p, 0, NULL, path);
    if (ok)
        assert_true(fs_remove_tree(path, &none));
    snprintf(path, sizeof path, "%s/jobs", plan_dir);
    assert_true(rmdir(path) == 0 || access(path, F_OK) != 0); /* nothing else is in it */
    return ok;
}

static bool verify_job(void *ctx, struct err *e)
{
    return job_run_is_made(ctx, 0) ? job_run_verify(ctx, 0, e)
                                   : err_set(e, "out of memory or missing");
}

static bool gather(void *ctx, struct err *e)
{
    int code = plan_gather(ctx, e);
    alloc_fail_off();
    assert_int_equal(code == 0, access(picture, F_OK) == 0);
    static char right[65];
    char hex[65];
    if (code == 0) {
        assert_true(sha256_file(picture, hex, e));
        if (right[0] == '\0')
            strcpy(right, hex);
        assert_string_equal(hex, right);
    }
    alloc_fail_output(picture, code == 0);
    xmlResetLastError();
    return code == 0;
}

static void plans(void **state)
{
    (void)state;
    struct err e = {0};
    struct plan p;
    char *lines = NULL;
    bool made;
    write_program();
    alloc_json(ALLOC_JSON_ENDS, NULL);
    alloc_fail_each("plan_make", ALLOC_ALL, make_plan, &lines);
    /* json_dumps() itself leaves out parts where it has no memory (2.14), so that what comes out is not looked at. */
    alloc_json(ALLOC_JSON_FAILS, NULL);
    alloc_fail_each("plan_make, jansson too", ALLOC_ALL, make_plan, NULL);
    assert_true(plan_make(plan_dir, WORDS, command, &wishes, &p, &e));
    alloc_fail_each("plan_read", ALLOC_ALL, read_plan, lines);
    free(lines);
    write_states(&p);
    /* A job that cannot be read in whole is none: here the program ends instead (tools/commands/assay.c). */
    alloc_json(ALLOC_JSON_ENDS, NULL);
    alloc_fail_each("plan_run_job", ALLOC_ALL, do_job, &p);
    for (int k = 0; k < p.num; k++)
        assert_true(job_run(&p, k, &made, &e));
    alloc_fail_each("plan_is_made, job_run_verify", ALLOC_ALL, verify_job, &p);
    int out = dup(STDOUT_FILENO), nowhere = open("/dev/null", O_WRONLY);
    assert_true(out >= 0 && nowhere >= 0 && fflush(stdout) == 0);
    dup2(nowhere, STDOUT_FILENO); /* it says what it wrote */
    alloc_fail_each("plan_gather", ALLOC_ALL, gather, &p);
    fflush(stdout);
    dup2(out, STDOUT_FILENO);
    close(out);
    close(nowhere);
    plan_free(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(plans, alloc_fail_tell),
    };
    return cmocka_run_group_tests(tests, make_place, remove_place);
}
