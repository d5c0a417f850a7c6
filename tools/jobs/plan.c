#include "plan.h"

#include "reference/base/image_oiio.h"
#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"
#include "renderer/base/version.h"
#include "job_kinds.h"
#include "tools/results/results.h"
#include "tools/base/hash_tree.h"

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

const char *plan_text(const struct plan *p, const char *name)
{
    return json_string_value(json_object_get(p->head, name));
}

char **plan_words(const json_t *array, int *num)
{
    size_t n = json_array_size(array), room = (n + 1) * sizeof(char *);
    for (size_t i = 0; i < n; i++)
        room += json_string_length(json_array_get(array, i)) + 1;
    char **words = malloc(room);
    if (words == NULL)
        return NULL;
    char *at = (char *)(words + n + 1);
    for (size_t i = 0; i < n; i++) {
        words[i] = at;
        strcpy(at, json_string_value(json_array_get(array, i)));
        at += strlen(at) + 1;
    }
    words[n] = NULL;
    *num = (int)n;
    return words;
}

/* A text that jansson would not take; without memory it has ended the program. */
static bool refuse(const char *text, struct err *e)
{
    return err_set(e, "'%s' is no UTF-8 and cannot be planned", text);
}

static bool add_words(json_t *array, const char *const *word, int num, struct err *e)
{
    for (int i = 0; i < num; i++)
        if (json_array_append_new(array, json_string(word[i])) != 0)
            return refuse(word[i], e);
    return true;
}

static bool add_input(json_t *inputs, const char *path, struct err *e)
{
    char hex[65];
    if (!hash_tree(path, NULL, hex, e))
        return false;
    return json_object_set_new(inputs, path, json_string(hex)) == 0 || refuse(path, e);
}

bool plan_begin(struct plan *p, const char *output, const char *product, int cpus, struct err *e)
{
    char dir[PLAN_PATH], full[PATH_MAX];
    int n = snprintf(dir, sizeof dir, p->dir[0] != '\0' ? "%s" : "%s.plan",
                     p->dir[0] != '\0' ? p->dir : output);
    if (n < 0 || (size_t)n >= sizeof dir)
        return err_set(e, "%.64s...: path too long", output);
    if (!fs_make_dirs(dir, e))
        return false;
    if (realpath(dir, full) == NULL || strlen(full) >= sizeof p->dir)
        return err_set(e, "%s: %s", dir, strerror(errno));
    strcpy(p->dir, full);
    return (json_object_set_new(p->head, "output", json_string(output)) == 0 &&
            json_object_set_new(p->head, "product", json_string(product)) == 0 &&
            json_object_set_new(p->head, "cpus", json_integer(cpus)) == 0) ||
           refuse(output, e);
}

/* And what assay loads while it runs. */
static bool add_program(struct plan *p, const char *program, struct err *e)
{
    char module[IMAGE_OIIO_PATH];
    const char *slash = strrchr(program, '/');
    if (!plan_input(p, program, e))
        return false;
    return strcmp(slash != NULL ? slash + 1 : program, "assay") != 0 ||
           (image_oiio_file(module, e) && plan_input(p, module, e));
}

bool plan_run_words(struct plan *p, const char *const *word, int num, bool user, struct err *e)
{
    json_t *run = json_object_get(p->head, "run");
    for (int i = 0; user && i < num; i++)
        if (strcmp(word[i], "{job}") == 0 || strncmp(word[i], "{out}", 5) == 0)
            return err_set(e, "'%s' means something else in a plan", word[i]);
    if (json_array_size(run) == 0 && !add_program(p, word[0], e))
        return false;
    return add_words(run, word, num, e);
}

bool plan_user_words(struct plan *p, const struct option_words *leave_out, int num, char **word,
                     struct err *e)
{
    char **kept = calloc((size_t)num + 1, sizeof *kept);
    if (kept == NULL)
        return err_set(e, "out of memory");
    int n = cli_rewrite_kept(leave_out, num, word, kept);
    bool ok = plan_run_words(p, (const char *const *)kept, n, true, e);
    free(kept);
    return ok;
}

void plan_may_end(struct plan *p, int code)
{
    /* Without them plan_make() fails. */
    if (json_array_append_new(json_object_get(p->head, "ends"), json_integer(code)) != 0)
        json_object_del(p->head, "ends");
}

bool plan_input(struct plan *p, const char *path, struct err *e)
{
    return add_input(json_object_get(p->head, "inputs"), path, e);
}

/* What all jobs have in common and their bits depend on. */
static bool hash_common(const struct plan *p, char hex[65])
{
    json_t *common = json_pack(
        "{ss, sO, sO, sO}", "version", assay_version, "run", json_object_get(p->head, "run"),
        "inputs", json_object_get(p->head, "inputs"), "cwd", json_object_get(p->head, "cwd"));
    char *text = json_dumps(common, JSON_COMPACT | JSON_SORT_KEYS);
    if (text != NULL)
        sha256_text(text, hex);
    free(text);
    json_decref(common);
    return text != NULL;
}

/* The line of a job, to free(); NULL out of memory. */
static char *job_line(const struct plan *p, json_t *words, json_t *inputs)
{
    char common[65], key[65];
    if (!hash_common(p, common))
        return NULL;
    json_t *job = json_pack("{ss, sO, sO}", "common", common, "words", words, "inputs", inputs);
    char *text = json_dumps(job, JSON_COMPACT | JSON_SORT_KEYS);
    json_decref(job);
    if (text == NULL)
        return NULL;
    sha256_text(text, key);
    free(text);
    job =
        json_pack("{si, ss, sO, sO}", "job", p->num, "key", key, "words", words, "inputs", inputs);
    text = json_dumps(job, JSON_COMPACT);
    json_decref(job);
    return text;
}

bool plan_job(struct plan *p, const char *const *word, int num, const char *const *input,
              struct err *e)
{
    json_t *words = json_array(), *inputs = json_object();
    char **line = realloc(p->line, ((size_t)p->num + 1) * sizeof *line);
    bool ok = line != NULL || err_set(e, "out of memory");
    if (line != NULL)
        p->line = line;
    ok = ok && add_words(words, word, num, e);
    for (; ok && *input != NULL; input++)
        ok = add_input(inputs, *input, e);
    if (ok) {
        p->line[p->num] = job_line(p, words, inputs);
        ok = p->line[p->num] != NULL || err_set(e, "out of memory for the plan");
        p->num += ok;
    }
    json_decref(words);
    json_decref(inputs);
    return ok;
}

static bool write_plan(const struct plan *p, struct err *e)
{
    char path[PLAN_PATH + 32];
    struct out_file out;
    snprintf(path, sizeof path, "%s/plan.jsonl", p->dir);
    if (!out_open(&out, path, e))
        return false;
    if (json_dumpf(p->head, out.f, JSON_COMPACT) != 0 && !ferror(out.f)) {
        out_abandon(&out);
        return err_set(e, "%s: out of memory", path);
    }
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
    char cwd[PATH_MAX];
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
    if (getcwd(cwd, sizeof cwd) == NULL)
        return err_set(e, "no current directory: %s", strerror(errno));
    if (dir != NULL && strlen(dir) >= sizeof p.dir)
        return err_set(e, "%.64s...: path too long", dir);
    strcpy(p.dir, dir != NULL ? dir : "");
    p.head = json_pack("{si, ss, ss, ss?, s[], s[i], s[], s{}}", "assay_plan", 1, "kind",
                       kinds[kind].name, "version", assay_version, "cwd", cwd, "command", "ends", 0,
                       "run", "inputs");
    bool ok = (p.head != NULL || refuse(cwd, e)) &&
              add_words(json_object_get(p.head, "command"), (const char *const *)argv, argc, e) &&
              kinds[kind].plan(argc, argv, w, &p, e);
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

bool plan_are_texts(const json_t *array)
{
    size_t i;
    json_t *v;
    json_array_foreach(array, i, v)
    {
        if (!json_is_string(v))
            return false;
    }
    return json_is_array(array);
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
    char path[PLAN_PATH + 32], full[PATH_MAX];
    struct plan p = {.dir = ""};
    if (realpath(dir, full) == NULL || strlen(full) >= sizeof p.dir)
        return err_set(e, "%s: %s", dir, strerror(errno));
    strcpy(p.dir, full);
    snprintf(path, sizeof path, "%s/plan.jsonl", p.dir);
    FILE *f = fopen(path, "r");
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    bool ok = read_lines(f, &p, e);
    fclose(f);
    if (ok && strcmp(plan_text(&p, "version"), assay_version) != 0)
        ok = err_set(e, "%s: of version %s, this is %s", path, plan_text(&p, "version"),
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
