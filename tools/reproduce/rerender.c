/* Makes an image again with the command that is stored in its attributes. */
#include "reference/base/process.h"
#include "reference/store/reference_render.h"
#include "renderer/base/cli.h"
#include "renderer/base/cli_rewrite.h"
#include "renderer/base/fs.h"
#include "renderer/pathtracer/options.h"
#include "renderer/base/sha256.h"
#include "renderer/base/shell_quote.h"
#include "tools/jobs/merge.h"
#include "tools/base/data_dirs.h"
#include "tools/jobs/job_kinds.h"
#include "reproduce_internal.h"
#include "tools/results/results.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MAX_PATH = 4096 };

bool reproduced_command(struct reproduced *out, const char *const *word, struct err *e)
{
    free(out->command);
    out->command = shell_quote_join(NULL, word);
    return out->command != NULL || err_set(e, "out of memory");
}

static const char *attr(const struct image *im, const char *name)
{
    const char *value = image_get_attr(im, name);
    return value != NULL ? value : "";
}

enum { MORE_WORDS = 12, NUMBER = 16 };

/* Checks that the scene file is here and has the hash that the image states. */
static bool check_scene(const char *path, const struct image *im, const char *scene, struct err *e)
{
    const char *then = attr(im, "assay:scene");
    char now[65];
    if (access(scene, R_OK) != 0)
        return err_set(e, "%s: its scene '%s' is not here: give --scene, or go where it was made",
                       path, scene);
    return sha256_file(scene, now, e) &&
           (strcmp(now, then) == 0 ||
            err_set(e,
                    "%s: %s is not the file that it was made of (SHA-256 %.12s... then, %.12s... "
                    "now)",
                    path, scene, then, now));
}

/* An image that is made again, into the file `to`, with the words of its command. */
struct remaking {
    const char *path, *to;
    const struct reproduce_options *opt;
    struct reproduced *out;
    int depth; /* of merges of merges */
    struct image im;
    char **word;
    int num;
    char threads[NUMBER], spp[NUMBER];
};

/* Fills argv with the command to be run; it has room for the words of r->word and MORE_WORDS more. Our options come
 * first, as "--" may end the options. */
static bool command_of(struct remaking *r, const char **argv, struct err *e)
{
    struct options o;
    struct err why = {""};
    const char *scene = r->opt->scene;
    if (!options_parse(r->num, r->word, &o, &why) || o.action != ACTION_RENDER)
        return err_set(e, "%s: its command is none of this program: %s", r->path, why.msg);
    if (!check_scene(r->path, &r->im, scene != NULL ? scene : o.scene, e))
        return false;
    snprintf(r->threads, sizeof r->threads, "%d", r->opt->threads);
    const char *ours[] = {r->opt->pathtracer,
                          "-q",
                          "-t",
                          r->threads,
                          "--samples",
                          attr(&r->im, "assay:samples"),
                          "-f",
                          r->to};
    int n = (int)(sizeof ours / sizeof *ours);
    memcpy(argv, ours, sizeof ours);
    /* With a pilot, --samples needs -s, the most samples that a pixel may get, which may have been left at its
     * default. */
    if (o.pilot_tolerance >= 0) {
        snprintf(r->spp, sizeof r->spp, "%d", o.spp);
        argv[n++] = "-s";
        argv[n++] = r->spp;
    }
    int kept = cli_rewrite_kept(cli_rewrite_render, r->num - 1, r->word + 1, r->word + 1);
    for (int i = 1; i <= kept; i++)
        argv[n++] = r->word[i] == o.scene && scene != NULL ? scene : r->word[i];
    return true;
}

/* Compares the metadata that says what was rendered: with another camera file, for example, it is another render. */
static bool check_same(const char *path, const struct image *a, const struct image *b,
                       struct err *e)
{
    static const char *const same[] = {"assay:unit",     "assay:spp",      "assay:scene",
                                       "assay:settings", "assay:adaptive", "assay:seed",
                                       "assay:cell",     "assay:samples",  "assay:ranges"};
    for (size_t i = 0; i < sizeof same / sizeof same[0]; i++)
        if (strcmp(attr(a, same[i]), attr(b, same[i])) != 0)
            return err_set(e, "%s: %s was '%.300s', and is '%.300s' of what its command makes now",
                           path, same[i], attr(a, same[i]), attr(b, same[i]));
    return true;
}

/* Compares all values bit by bit. False if size or channels differ. */
static bool compare(const char *path, const struct image *a, const struct image *b,
                    struct reproduced *out, struct err *e)
{
    if (a->width != b->width || a->height != b->height || a->channels != b->channels)
        return err_set(e, "%s: %d x %d x %d values, made again %d x %d x %d", path, a->width,
                       a->height, a->channels, b->width, b->height, b->channels);
    size_t num = (size_t)a->width * (size_t)a->height * (size_t)a->channels;
    for (int c = 0; c < a->channels; c++)
        if (image_channel(b, a->names[c]) != c)
            return err_set(e, "%s: made again its channel %d is no %s", path, c, a->names[c]);
    for (size_t i = 0; i < num; i++) {
        size_t c = i % (size_t)a->channels, p = i / (size_t)a->channels;
        const float *x = &a->data[i], *y = &b->data[i];
        uint32_t bits[2];
        memcpy(&bits[0], x, sizeof *x);
        memcpy(&bits[1], y, sizeof *y);
        if (bits[0] != bits[1] && out->num_different++ == 0)
            snprintf(out->first, sizeof out->first, "%s at pixel %zu,%zu: %.9g there, %.9g now",
                     a->names[c], p % (size_t)a->width, p / (size_t)a->width, (double)*x,
                     (double)*y);
    }
    out->num_values += (double)num;
    return true;
}

static bool remake_render(struct remaking *r, struct err *e)
{
    const struct path log = fs_path("%s.log", r->to);
    const char **argv = calloc((size_t)r->num + MORE_WORDS, sizeof *argv);
    bool ok = (argv != NULL || err_set(e, "out of memory")) && command_of(r, argv, e);
    ok = ok && reproduced_command(r->out, argv, e);
    const struct process p = {.argv = argv, .log = log.s};
    ok = ok && (process_run(&p, NULL, e) || err_prefix(e, "%s: made again", r->path));
    free(argv);
    return ok;
}

/* The same for a sum of sample ranges: runs their jobs here one after the other, and adds them up as before. */
static bool remake_ranges(struct remaking *r, struct err *e)
{
    enum { BEFORE = 6 }; /* words that plan it */
    char ranges[NUMBER];
    struct plan p = {.dir = ""};
    struct plan_wishes w = {.parts = 1, .ranges = 1, .pathtracer = r->opt->pathtracer};
    for (const char *c = attr(&r->im, "assay:ranges"); *c != '\0'; c++)
        w.ranges += *c == ',';
    snprintf(ranges, sizeof ranges, "%d", w.ranges);
    const struct path dir = fs_path("%s.plan", r->to);
    const char **argv = calloc((size_t)r->num + BEFORE + MORE_WORDS, sizeof *argv);
    if (argv == NULL)
        return err_set(e, "out of memory");
    const char *plan[BEFORE] = {"assay", "plan", "--parts", "1", "--ranges", ranges};
    memcpy(argv, plan, sizeof plan);
    const char **render = argv + BEFORE;
    bool ok = command_of(r, render, e);
    render[0] = "pathtracer";
    char **words = (char **)render;
    int count = 0;
    while (render[count] != NULL)
        count++;
    ok = ok && reproduced_command(r->out, argv, e) && plan_make(dir.s, count, words, &w, &p, e);
    for (int k = 0; ok && k < p.num; k++) {
        bool made;
        ok = job_run(&p, k, &made, e);
    }
    ok = ok && job_render_gather_quietly(&p, count, words, e);
    plan_free(&p);
    free(argv);
    return ok || err_prefix(e, "%s: made again", r->path);
}

static bool remake(struct remaking r, struct err *e);

/* Makes each share again, then merges them; the shares' paths are those in the command. */
static bool remake_merge(const struct remaking *r, struct err *e)
{
    int shares = r->num - 3, read = 0;
    struct share whole = {0}, *share = calloc((size_t)(shares > 0 ? shares : 1), sizeof *share);
    bool ok = share != NULL || err_set(e, "out of memory");
    if (ok && shares < 2)
        ok = err_set(e, "%s: its command names no shares", r->path);
    for (int i = 0; ok && i < shares; i++) {
        const struct path part = fs_path("%s.%d.exr", r->to, i);
        const char *path = r->word[3 + i];
        ok = access(path, R_OK) == 0 ||
             err_set(e, "%s: its share '%s' is not here: go where it was made", r->path, path);
        ok = ok &&
             remake((struct remaking){.path = path,
                                      .to = part.s,
                                      .opt = r->opt,
                                      .out = r->out,
                                      .depth = r->depth + 1},
                    e) &&
             share_read(part.s, &share[i], e);
        read += ok;
    }
    ok = ok && merge_shares(share, shares, &whole, e) &&
         share_write(r->to, &whole, "assay merge", e);
    for (int i = 0; i < read; i++)
        share_free(&share[i]);
    free(share);
    share_free(&whole);
    return ok && reproduced_command(r->out, (const char *const *)r->word, e);
}

/* Makes the image at r.path again; r.im and r.word are filled in here. */
static bool remake(struct remaking r, struct err *e)
{
    enum { MOST_DEPTH = 16 };
    if (r.depth > MOST_DEPTH)
        return err_set(e, "%s: merged from itself", r.path);
    if (!image_read_exr(r.path, &r.im, NULL, e))
        return false;
    const char *command = image_get_attr(&r.im, "assay:command");
    bool ok = command != NULL || err_set(e, "%s: does not say by what command it was made", r.path);
    if (ok && (r.word = shell_quote_split(command, &r.num, e)) == NULL)
        ok = err_prefix(e, "%s", r.path);
    if (ok && r.num >= 2 && strcmp(r.word[0], "assay") == 0 && strcmp(r.word[1], "merge") == 0)
        ok = remake_merge(&r, e);
    else if (ok && image_get_attr(&r.im, "assay:ranges") != NULL)
        ok = remake_ranges(&r, e);
    else if (ok)
        ok = remake_render(&r, e);
    free(r.word);
    image_free(&r.im);
    return ok;
}

/* DIR of DIR/SCENE/ENGINE.exr; "." where that is the current one. */
static bool directory_of(const char *path, const char *scene, const char *engine,
                         char dir[MAX_PATH], struct err *e)
{
    char end[512];
    int n = snprintf(end, sizeof end, "%.200s/%.200s.exr", scene, engine);
    size_t length = strlen(path);
    if (length < (size_t)n || length >= MAX_PATH || strcmp(path + length - (size_t)n, end) != 0 ||
        (length > (size_t)n && path[length - (size_t)n - 1] != '/'))
        return err_set(e, "%s: a stored reference is made again where it is stored, as .../%s",
                       path, end);
    snprintf(dir, MAX_PATH, "%.*s", (int)(length - (size_t)n), path);
    if (dir[0] == '\0')
        strcpy(dir, ".");
    return true;
}

/* Notes a possible cause of differences: another version or build of the engine, or another processor that rounds
 * differently. */
static void compare_engines(const json_t *then, const json_t *now, struct reproduced *out)
{
    const char *a = member_text(then, "version"), *b = member_text(now, "version");
    if (strcmp(a, b) != 0)
        snprintf(out->note, sizeof out->note, "the reference is by %.100s, this is %.100s", a, b);
    else if (strcmp(member_text(then, "binary_sha256"), member_text(now, "binary_sha256")) != 0)
        snprintf(out->note, sizeof out->note, "the reference is by another build of %.100s", a);
    else
        snprintf(out->note, sizeof out->note,
                 "it is the same %.100s, which may round otherwise on another kind of processor",
                 a);
}

static bool render_golden(const struct suite_scene *scene, const struct suite_reference *ref,
                          const struct reproduce_options *opt, const char *golden_dir,
                          const char *dir, const char *to, struct reproduced *out, struct err *e)
{
    const struct data_dirs at = data_dirs_find();
    char seed[24];
    struct moments then, now;
    json_t *was = NULL, *is = NULL;
    if (!golden_read(golden_dir, scene, ref, &then, &was, e))
        return false;
    moments_free(&then);
    const struct reference_options how = {.seed = (uint32_t)member_number(was, "seed"),
                                          .threads =
                                              opt->threads == 0 ? cli_processors() : opt->threads,
                                          .timeout_s = 7200,
                                          .work_dir = dir,
                                          .share_dir = at.share.s};
    snprintf(seed, sizeof seed, "%u", (unsigned)how.seed);
    const struct path again = fs_path("%s/%s/%s.exr", dir, scene->name, ref->engine);
    const char *const word[] = {"assay",    "reference", "--fresh", "--only", scene->name,
                                "--engine", ref->engine, "--seed",  seed,     NULL};
    bool ok = reproduced_command(out, word, e);
    if (ok && reference_render(scene, ref, &how, &now, &is, e)) {
        compare_engines(was, is, out);
        ok = golden_write(dir, scene->name, ref->engine, &now, is, e) &&
             (rename(again.s, to) == 0 || err_set(e, "%s: %s", to, strerror(errno)));
        moments_free(&now);
        json_decref(is);
    } else {
        ok = false;
    }
    json_decref(was);
    return ok;
}

static bool remake_golden(const char *path, const struct image *im,
                          const struct reproduce_options *opt, const char *dir, const char *to,
                          struct reproduced *out, struct err *e)
{
    const struct data_dirs at = data_dirs_find();
    char golden_dir[MAX_PATH];
    const char *name = image_get_attr(im, "assay:scene"),
               *engine = image_get_attr(im, "assay:engine");
    struct suite suite = {0};
    if (name == NULL)
        return err_set(e, "%s: does not say of what scene it is", path);
    if (opt->scene != NULL || opt->pathtracer != NULL)
        return err_set(e, "%s: --scene and --pathtracer are for renders of pathtracer", path);
    const char *from = at.suite.s;
    if (!directory_of(path, name, engine, golden_dir, e) || !suite_load(from, &suite, e))
        return false;
    const struct suite_scene *scene = suite_find(&suite, name);
    const struct suite_reference *ref = scene != NULL ? suite_reference_of(scene, engine) : NULL;
    bool ok = ref != NULL || err_set(e, "%s: %s has no scene '%.100s' with a reference by '%.100s'",
                                     path, from, name, engine);
    ok = ok && render_golden(scene, ref, opt, golden_dir, dir, to, out, e);
    suite_free(&suite);
    return ok;
}

bool rerender(const char *path, const struct reproduce_options *opt, const char *dir,
              struct reproduced *out, struct err *e)
{
    struct image then = {0}, now = {0};
    struct reproduce_options with = *opt;
    const struct path beside = fs_beside_program("pathtracer");
    if (with.pathtracer == NULL)
        with.pathtracer = beside.s;
    if (!image_read_exr(path, &then, NULL, e))
        return false;
    const struct path to = fs_path("%s/again.exr", dir);
    bool golden = image_get_attr(&then, "assay:engine") != NULL;
    if (!golden)
        snprintf(out->made_by, sizeof out->made_by, "%s", attr(&then, "assay:version"));
    bool ok =
        golden ? remake_golden(path, &then, opt, dir, to.s, out, e)
               : remake((struct remaking){.path = path, .to = to.s, .opt = &with, .out = out}, e);
    ok = ok && image_read_exr(to.s, &now, NULL, e) && check_same(path, &then, &now, e) &&
         compare(path, &then, &now, out, e);
    if (ok && opt->keep != NULL)
        ok = image_write_exr(opt->keep, &now, e);
    image_free(&then);
    image_free(&now);
    return ok;
}
