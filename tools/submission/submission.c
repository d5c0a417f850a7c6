#include "submission.h"

#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MAX_PATH = 4400, MAX_ARGS = 96, TEXT = 8192 };

const char *const submission_kind_name[] = {"images", "program", "source"};
const char *const submission_state_name[] = {"graded", "not_built", "not_started", "usage"};
static const char *const endings[] = {".png", ".exr", ".pfm", ".hdr"};
enum { NUM_ENDINGS = sizeof endings / sizeof *endings };

static bool stage_file(const char *from, const char *dir, struct err *e)
{
    return fs_copy(from, fs_path("%s/%s", dir, fs_base(from)).s, e);
}

bool submission_stage(const struct rubric *r, const char *dir, struct err *e)
{
    if (!fs_make_dirs(dir, e))
        return false;
    chmod(dir, 0755);
    for (int i = 0; i < r->num_images; i++) {
        const struct rubric_image *p = &r->image[i];
        if (!stage_file(rubric_scene(r, p).s, dir, e))
            return false;
        if (p->suite != NULL && p->suite->environment[0] != '\0' &&
            !stage_file(p->suite->environment, dir, e))
            return false;
        if (p->environment[0] != '\0' &&
            !stage_file(fs_path("%s/%s", r->dir, p->environment).s, dir, e))
            return false;
    }
    return true;
}

/* Words are appended to text; the command's own are split at spaces. */
struct words {
    char *text;
    size_t used, size;
    const char **argv;
    int num, most;
    bool overflow;
};

static void add_word(struct words *w, const char *word, size_t length)
{
    if (w->num >= w->most - 1 || w->used + length + 1 > w->size) {
        w->overflow = true;
        return;
    }
    w->argv[w->num++] = w->text + w->used;
    memcpy(w->text + w->used, word, length);
    w->text[w->used + length] = '\0';
    w->used += length + 1;
}

static void add_words(struct words *w, const char *words)
{
    for (const char *at = words + strspn(words, " "); *at != '\0'; at += strspn(at, " ")) {
        size_t n = strcspn(at, " ");
        add_word(w, at, n);
        at += n;
    }
}

/* The files of an image that are staged; environment: "" if it has none. */
static void scene_names(const struct rubric_image *p, char scene[300], char environment[300])
{
    const struct suite_scene *s = p->suite;
    snprintf(scene, 300, "%.280s", s != NULL ? fs_base(s->dae) : fs_base(p->scene));
    snprintf(environment, 300, "%.280s",
             fs_base(p->environment[0] != '\0' || s == NULL ? p->environment : s->environment));
}

/* What belongs to a scene besides its file. */
static void add_scene_options(struct words *w, const struct rubric_image *p)
{
    char text[600], scene[300], environment[300];
    const struct suite_scene *s = p->suite;
    scene_names(p, scene, environment);
    if (environment[0] != '\0') {
        snprintf(text, sizeof text, "-e scene/%s", environment);
        add_words(w, text);
    }
    if (s != NULL && s->lens_radius > 0) {
        snprintf(text, sizeof text, "-b %.9g -d %.9g", s->lens_radius, s->focal_distance);
        add_words(w, text);
    }
}

bool submission_command(const struct rubric *r, const struct rubric_image *p, const char *program,
                        uint64_t seed, int threads, char *text, size_t size, const char **argv,
                        int most)
{
    struct words w = {.text = text, .size = size, .argv = argv, .most = most};
    char file[300], environment[300], scene[320], number[7][24];
    scene_names(p, file, environment);
    snprintf(scene, sizeof scene, "scene/%s", file);
    snprintf(number[0], sizeof *number, "%d", p->width);
    snprintf(number[1], sizeof *number, "%d", p->height);
    snprintf(number[2], sizeof *number, "%d", p->spp);
    snprintf(number[3], sizeof *number, "%d", p->lights);
    snprintf(number[4], sizeof *number, "%d", p->bounces);
    snprintf(number[5], sizeof *number, "%d", threads);
    snprintf(number[6], sizeof *number, "%llu", (unsigned long long)seed);
    const struct {
        const char *name, *value;
    } tokens[] = {{"{program}", program},  {"{scene}", scene},       {"{out}", r->output},
                  {"{width}", number[0]},  {"{height}", number[1]},  {"{spp}", number[2]},
                  {"{lights}", number[3]}, {"{bounces}", number[4]}, {"{threads}", number[5]},
                  {"{seed}", number[6]}};
    for (const char *at = r->command + strspn(r->command, " \t"); *at != '\0';
         at += strspn(at, " \t")) {
        size_t n = strcspn(at, " \t");
        char word[1200];
        size_t used = 0;
        if (n == strlen("{options}") && strncmp(at, "{options}", n) == 0) {
            add_words(&w, p->options);
            add_scene_options(&w, p);
            at += n;
            continue;
        }
        for (const char *c = at; c < at + n;) {
            size_t t = 0, count = sizeof tokens / sizeof *tokens;
            while (t < count && strncmp(c, tokens[t].name, strlen(tokens[t].name)) != 0)
                t++;
            const char *value = t < count ? tokens[t].value : c;
            size_t length = t < count ? strlen(value) : 1;
            if (used + length >= sizeof word)
                return false;
            /* NOLINTNEXTLINE(bugprone-not-null-terminated-result): into a longer text. */
            memcpy(word + used, value, length);
            used += length;
            c += t < count ? strlen(tokens[t].name) : 1;
        }
        add_word(&w, word, used);
        at += n;
    }
    if (w.num < most)
        argv[w.num] = NULL;
    return !w.overflow && w.num > 0;
}

/* The file of an image in a directory of images, looked for by ending; not through a link. */
static bool find_image(const struct submission *s, const char *name, const char *ending, char *path,
                       size_t size)
{
    struct stat st;
    for (int i = 0; i < NUM_ENDINGS; i++) {
        if (ending != NULL && strcmp(ending, endings[i]) != 0)
            continue;
        snprintf(path, size, "%s/%s%s", s->path, name, endings[i]);
        if (lstat(path, &st) == 0 && S_ISREG(st.st_mode))
            return true;
    }
    path[0] = '\0';
    return false;
}

/* The last part of a path, without slashes at its end. *length: of it, without the ending of an
 * archive. */
static const char *name_of(const char *path, int *length, bool *archive)
{
    static const char *const ends[] = {".zip", ".tar",    ".tgz",     ".tbz",    ".txz",    ".7z",
                                       ".rar", ".tar.gz", ".tar.bz2", ".tar.xz", ".tar.zst"};
    int n = (int)strlen(path);
    while (n > 1 && path[n - 1] == '/')
        n--;
    const char *at = path + n;
    while (at > path && at[-1] != '/')
        at--;
    *length = (int)(path + n - at);
    *archive = false;
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
        int k = (int)strlen(ends[i]);
        if (!*archive && *length > k && strncasecmp(at + *length - k, ends[i], (size_t)k) == 0) {
            *archive = true;
            *length -= k;
        }
    }
    return at;
}

void submission_id(const char *path, char id[128])
{
    int n;
    bool archive;
    char full[PATH_MAX];
    const char *at = name_of(path, &n, &archive);
    if (((n == 1 && at[0] == '.') || (n == 2 && strncmp(at, "..", 2) == 0)) &&
        realpath(path, full) != NULL)
        at = name_of(full, &n, &archive);
    snprintf(id, 128, "%.*s", n, at);
}

static bool has(const struct submission *s, const char *name)
{
    return access(fs_path("%s/%s", s->path, name).s, F_OK) == 0;
}

/* Also sets s->program. A program handed in without sources is not built. */
static enum submission_kind kind_of(const struct rubric *r, struct submission *s, bool is_directory,
                                    bool is_archive)
{
    char path[MAX_PATH];
    snprintf(s->program, sizeof s->program, "./%.150s",
             is_directory || is_archive ? r->program : fs_base(s->path));
    /* Images beside a program show what it can do; they are not what is graded. */
    bool runs = has(s, r->program) ||
                (r->build[0] != '\0' &&
                 (has(s, "CMakeLists.txt") || has(s, "Makefile") || has(s, fs_base(r->program))));
    for (int i = 0; is_directory && (r->images || !runs) && i < r->num_images; i++)
        if (find_image(s, r->image[i].name, NULL, path, sizeof path))
            return SUBMISSION_IMAGES;
    if (r->build[0] == '\0' || !(is_directory || is_archive))
        return SUBMISSION_PROGRAM;
    if (is_archive || has(s, "CMakeLists.txt") || has(s, "Makefile") ||
        (!has(s, r->program) && !has(s, fs_base(r->program))))
        return SUBMISSION_SOURCE;
    if (!has(s, r->program))
        snprintf(s->program, sizeof s->program, "./%.150s", fs_base(r->program));
    return SUBMISSION_PROGRAM;
}

bool submission_open(const struct rubric *r, const char *path, const char *work,
                     struct submission *out, struct err *e)
{
    struct stat st;
    struct err why;
    *out = (struct submission){0};
    snprintf(out->path, sizeof out->path, "%s", path);
    for (size_t n = strlen(out->path); n > 1 && out->path[n - 1] == '/';)
        out->path[--n] = '\0';
    bool archive;
    int length;
    name_of(out->path, &length, &archive);
    submission_id(out->path, out->id);
    if (stat(out->path, &st) != 0)
        return err_set(e, "%s: %s", path, strerror(errno));
    if (!fs_make_dirs(work, e))
        return false;
    chmod(work, 0755);
    out->kind = kind_of(r, out, S_ISDIR(st.st_mode), archive);
    const struct path program = fs_path("%s/%s", out->path, out->program);
    /* A program whose mode was lost on the way here, by a web form or Windows, gets it back. */
    out->packed = S_ISDIR(st.st_mode) ? access(program.s, X_OK) != 0
                                      : archive || access(out->path, X_OK) != 0;
    if ((size_t)snprintf(out->tree, sizeof out->tree, "%s/tree.tar", work) >= sizeof out->tree)
        return err_set(e, "%s: path too long", work);
    bool too_large;
    if (!sandbox_pack(out->path, out->tree, r->limit.disk, &too_large, &why)) {
        if (!too_large)
            return err_set(e, "%s", why.msg);
        const char *text = strstr(why.msg, ": "); /* without our path */
        snprintf(out->why, sizeof out->why, "It %.500s", text != NULL ? text + 2 : why.msg);
        out->state = SUBMISSION_NOT_BUILT;
        return true;
    }
    return sha256_file(out->tree, out->sha256, e);
}

static bool move_file(const char *from_dir, const char *name, const char *to, bool *moved,
                      struct err *e)
{
    const struct path from = fs_path("%s/%s", from_dir, name);
    *moved = access(from.s, R_OK) == 0;
    return !*moved || fs_copy(from.s, to, e);
}

/* struct made. A program has no more than its limit, and no more than its threads can use. */
static bool is_starved(const struct sandbox_limits *limit, int threads,
                       const struct sandbox_result *run)
{
    const double most = fmin(limit->cpu_s, limit->wall_s * fmax(1, threads));
    return run->end == SANDBOX_WALL && run->cpu_s > 0.1 * most && run->cpu_s < 0.9 * most;
}

static bool run_program(const struct rubric *r, const struct sandbox *box,
                        const struct submission *sub, const struct rubric_image *p,
                        const char *stage, const char *work, const char *out_dir, uint64_t seed,
                        int threads, struct made *made, struct err *e)
{
    char text[TEXT], rates[80];
    const char *argv[MAX_ARGS];
    const char *dot = strrchr(r->output, '.');
    if (!submission_command(r, p, sub->program, seed, threads, text, sizeof text, argv, MAX_ARGS))
        return err_set(e, "%s: the command of image '%s' is too long", r->path, p->name);
    snprintf(rates, sizeof rates, "%.*s_rate.png", (int)(dot - r->output), r->output);
    const struct path out = fs_path("%s/run-%s", work, p->name); /* not "box": sandbox.h */
    const struct path log = fs_path("%s/%s.log", out_dir, p->name);
    const char *const keep[] = {r->output, rates, NULL};
    const struct sandbox_job job = {.argv = argv,
                                    .tree = sub->tree,
                                    .scene = stage,
                                    .keep = keep,
                                    .out = out.s,
                                    .log = log.s,
                                    .library = sub->library[0] != '\0' ? sub->library : NULL,
                                    .limit = r->limit};
    struct sandbox_result result;
    char usage[300], scene[300], environment[300];
    scene_names(p, scene, environment);
    const char *const inputs[] = {scene, environment[0] != '\0' ? environment : NULL, NULL};
    if (!submission_run(r, box, sub, &job, inputs, &result, e))
        return false;
    made->end = result.end;
    made->cpu_s = result.cpu_s;
    made->wall_s = result.wall_s;
    made->starved = is_starved(&r->limit, threads, &result);
    bool there = false, has_rates = false;
    snprintf(made->path, sizeof made->path, "%s/%s%s", out_dir, p->name, dot);
    snprintf(made->rates, sizeof made->rates, "%s/%s_rate.png", out_dir, p->name);
    bool ok = move_file(out.s, r->output, made->path, &there, e) &&
              move_file(out.s, rates, made->rates, &has_rates, e) && fs_remove_tree(out.s, e);
    made->usage = !there && (result.end == SANDBOX_FAILED || result.end == SANDBOX_OK) &&
                  submission_printed_usage(log.s, usage, sizeof usage);
    if (made->usage)
        snprintf(made->why, sizeof made->why, "the program printed its usage text: %s", usage);
    else if (result.end == SANDBOX_FAILED && there) /* what it wrote is judged for what it is */
        snprintf(made->after, sizeof made->after, "%.250s", result.why);
    else if (result.end == SANDBOX_FAILED && (result.status == 126 || result.status == 127))
        snprintf(made->why, sizeof made->why, "the program does not start: %s", result.why);
    else if (made->starved)
        snprintf(made->why, sizeof made->why,
                 "the program: no end after %g s, of which it computed for %.2g s%s",
                 r->limit.wall_s, result.cpu_s, result.why + strcspn(result.why, ":"));
    else if (result.end != SANDBOX_OK)
        snprintf(made->why, sizeof made->why, "the program: %s", result.why);
    else if (!there)
        snprintf(made->why, sizeof made->why, "the program ended well but wrote no %s", r->output);
    if (made->why[0] != '\0')
        made->path[0] = '\0';
    if (!has_rates)
        made->rates[0] = '\0';
    return ok;
}

/* Copies an image that was handed in to out_dir, as `to`; if there is none `to` is "" and `why` the
 * reason. */
static bool take_image(const struct rubric *r, const struct submission *s, const char *name,
                       const char *ending, const char *out_dir, char *to, char *why, size_t size,
                       struct err *e)
{
    char from[MAX_PATH];
    struct stat st;
    to[0] = '\0';
    if (!find_image(s, name, ending, from, sizeof from)) {
        snprintf(why, size, "there is no %s.png, .exr, .pfm or .hdr", name);
        return true;
    }
    if (stat(from, &st) != 0 || (size_t)st.st_size > r->limit.file) {
        snprintf(why, size, "%s is larger than %zu MiB", fs_base(from), r->limit.file >> 20);
        return true;
    }
    snprintf(to, MAX_PATH, "%.4000s/%.300s", out_dir, fs_base(from));
    return fs_copy(from, to, e);
}

static bool take_rates(const struct rubric *r, const struct submission *s, const char *name,
                       const char *out_dir, char *to, struct err *e)
{
    char rates[80], why[400];
    snprintf(rates, sizeof rates, "%s_rate", name);
    return take_image(r, s, rates, ".png", out_dir, to, why, sizeof why, e);
}

bool submission_image(const struct rubric *r, const struct sandbox *s, const struct submission *sub,
                      const struct rubric_image *p, const char *stage, const char *work,
                      const char *out_dir, uint64_t seed, int threads, struct made *made,
                      struct err *e)
{
    *made = (struct made){.end = SANDBOX_OK};
    if (sub->state != SUBMISSION_GRADED) {
        snprintf(made->why, sizeof made->why, "%s", submission_not_made);
        return true;
    }
    if (sub->kind != SUBMISSION_IMAGES)
        return run_program(r, s, sub, p, stage, work, out_dir, seed, threads, made, e);
    return take_image(r, sub, p->name, NULL, out_dir, made->path, made->why, sizeof made->why, e) &&
           take_rates(r, sub, p->name, out_dir, made->rates, e);
}
