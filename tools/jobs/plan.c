#include "plan.h"

#include "renderer/base/fs.h"
#include "renderer/base/version.h"
#include "job_kinds.h"
#include "tools/results/results.h"

#include <ctype.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct {
    const char *name;
    bool (*plan)(int argc, char **argv, const struct plan_wishes *w, struct plan *p, struct err *e);
    int (*gather)(const struct plan *p, int argc, char **argv, struct err *e);
} kinds[] = {{"pathtracer", job_render_plan, job_render_gather},
             {"grade", job_grade_plan, job_grade_gather},
             {"validate", job_validate_plan, job_validate_gather},
             {"reference", job_reference_plan, job_reference_gather}};
enum { NUM_KINDS = sizeof kinds / sizeof kinds[0] };

static bool write_plan(const struct plan *p, struct err *e)
{
    struct out_file out;
    const struct path path = fs_path("%s/plan.jsonl", p->dir);
    char *head = json_dumps(p->head, JSON_COMPACT);
    if (head == NULL)
        return err_set(e, "%s: out of memory", path.s);
    if (!out_open(&out, path.s, e)) {
        free(head);
        return false;
    }
    fputs(head, out.f);
    free(head);
    for (int k = 0; k < p->num; k++)
        fprintf(out.f, "\n%s", p->line[k]);
    fputc('\n', out.f); /* out_commit() looks at the error flag */
    return out_commit(&out, e);
}

static int kind_of(const char *name)
{
    int i = 0;
    while (i < NUM_KINDS && strcmp(name, kinds[i].name) != 0)
        i++;
    return i;
}

static bool check_wishes(const char *kind, const struct plan_wishes *w, struct err *e)
{
    const struct {
        bool given;
        const char *name, *of, * or ;
    } wish[] = {{w->parts > 0, "--parts", "pathtracer", "reference"},
                {w->ranges > 0, "--ranges", "pathtracer", NULL},
                {w->by != PLAN_BY_DEFAULT, "--by", "validate", NULL}};
    for (size_t i = 0; i < sizeof wish / sizeof *wish; i++)
        if (wish[i].given && strcmp(kind, wish[i].of) != 0 &&
            (wish[i].or == NULL || strcmp(kind, wish[i].or) != 0))
            return err_set(e, "%s says how %s%s%s is cut, not %s", wish[i].name, wish[i].of,
                           wish[i].or != NULL ? " or " : "", wish[i].or != NULL ? wish[i].or : "",
                           kind);
    return true;
}

bool plan_make(const char *dir, int argc, char **argv, const struct plan_wishes *w,
               struct plan *out, struct err *e)
{
    struct plan p = {.dir = ""};
    int kind = argc > 0 ? kind_of(argv[0]) : NUM_KINDS;
    if (kind == NUM_KINDS)
        return err_set(
            e, "what to plan begins with pathtracer, grade, validate or reference, not '%s'",
            argc > 0 ? argv[0] : "");
    if (!check_wishes(kinds[kind].name, w, e))
        return false;
    for (int k = 1; k < argc; k++)
        if (argv[k][0] == '-' && isalpha((unsigned char)argv[k][1]) && argv[k][2] != '\0')
            return err_set(
                e,
                "'%s': in a command that is planned, short options and their arguments stand apart",
                argv[k]);
    if (dir != NULL && strlen(dir) >= sizeof p.dir)
        return err_set(e, "%.64s...: path too long", dir);
    strcpy(p.dir, dir != NULL ? dir : "");
    bool ok =
        plan_head(&p, kinds[kind].name, argc, argv, e) && kinds[kind].plan(argc, argv, w, &p, e);
    if (ok)
        ok = (json_object_get(p.head, "ends") != NULL &&
              json_object_set_new(p.head, "jobs", json_integer(p.num)) == 0) ||
             err_set(e, "out of memory for the plan");
    ok = ok && write_plan(&p, e);
    if (ok)
        *out = p;
    else
        plan_free(&p);
    return ok;
}

void plan_free(struct plan *p)
{
    json_decref(p->head);
    for (int k = 0; k < p->num; k++)
        free(p->line[k]);
    free(p->line);
    *p = (struct plan){.dir = ""};
}

static bool check_head(const struct plan *p)
{
    static const char *const texts[] = {"kind", "version", "cwd", "output", "product"};
    bool ok = json_integer_value(json_object_get(p->head, "assay_plan")) == 1;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        ok = ok && plan_text(p, texts[i]) != NULL;
    return ok && kind_of(plan_text(p, "kind")) < NUM_KINDS &&
           plan_are_texts(json_object_get(p->head, "command")) &&
           plan_are_texts(json_object_get(p->head, "run")) &&
           json_is_object(json_object_get(p->head, "inputs"));
}

/* Lines are kept as texts: a job needs the first and its own. */
static bool read_lines(FILE *f, struct plan *p, struct err *e)
{
    char *line = NULL;
    size_t room = 0;
    ssize_t n;
    bool ok = true, no_memory = false;
    errno = 0;
    while (ok && (n = getline(&line, &room, f)) > 0) {
        if (line[n - 1] == '\n')
            line[n - 1] = '\0';
        if (p->head == NULL) {
            json_error_t why = {.text = ""};
            p->head = json_loads(line, 0, &why);
            ok = check_head(p);
            no_memory = p->head == NULL && json_error_code(&why) == json_error_out_of_memory;
            continue;
        }
        char **more = realloc(p->line, ((size_t)p->num + 1) * sizeof *more);
        p->line = more != NULL ? more : p->line;
        char *copy = more != NULL ? strdup(line) : NULL;
        ok = copy != NULL;
        no_memory = !ok;
        if (ok)
            p->line[p->num++] = copy;
    }
    no_memory |= ok && errno == ENOMEM; /* of getline() */
    free(line);
    if (no_memory)
        return err_set(e, "%s/plan.jsonl: out of memory", p->dir);
    const json_t *jobs = json_object_get(p->head, "jobs"); /* none where all is done already */
    return (ok && json_is_integer(jobs) && json_integer_value(jobs) == p->num) ||
           err_set(e, "%s/plan.jsonl: not a whole plan", p->dir);
}

bool plan_read(const char *dir, struct plan *out, struct err *e)
{
    char full[PATH_MAX];
    struct plan p = {.dir = ""};
    if (realpath(dir, full) == NULL || strlen(full) >= sizeof p.dir)
        return err_set(e, "%s: %s", dir, strerror(errno));
    strcpy(p.dir, full);
    const struct path path = fs_path("%s/plan.jsonl", p.dir);
    FILE *f = fs_open(path.s);
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", path.s, strerror(errno));
    bool ok = read_lines(f, &p, e);
    fclose(f);
    if (ok && strcmp(plan_text(&p, "version"), assay_version) != 0)
        ok = err_set(e, "%s: of version %s, this is %s", path.s, plan_text(&p, "version"),
                     assay_version);
    if (ok)
        *out = p;
    else
        plan_free(&p);
    return ok;
}

bool plan_enter(const struct plan *p, struct err *e)
{
    const char *cwd = plan_text(p, "cwd");
    return chdir(cwd) == 0 || err_set(e, "%s: cannot go there: %s", cwd, strerror(errno));
}

int plan_gather(const struct plan *p, struct err *e)
{
    int argc = 0, code = EXIT_NOT_JUDGED;
    char **argv = plan_words(json_object_get(p->head, "command"), &argc);
    if (argv == NULL)
        err_set(e, "out of memory");
    for (int k = 0; k < p->num && e->msg[0] == '\0'; k++)
        if (!job_run_is_made(p, k))
            err_set(e, "%s: job %d of %d is not made", p->dir, k, p->num);
    if (e->msg[0] == '\0')
        code = kinds[kind_of(plan_text(p, "kind"))].gather(p, argc, argv, e);
    free(argv);
    return code;
}
