#include "reproduce.h"

#include "reference/base/process.h"
#include "renderer/base/cli_rewrite.h"
#include "renderer/base/fs.h"
#include "renderer/pathtracer/options.h"
#include "renderer/base/shell_quote.h"
#include "tools/jobs/merge.h"
#include "tools/jobs/job_kinds.h"
#include "reproduce_class.h"
#include "reproduce_golden.h"
#include "reproduce_page.h"
#include "reproduce_internal.h"
#include "reproduce_png.h"
#include "reproduce_results.h"
#include "tools/base/temp_dir.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MAX_PATH = 4096 };

static const char *attr(const struct image *im, const char *name)
{
    const char *value = image_get_attr(im, name);
    return value != NULL ? value : "";
}

enum { MORE_WORDS = 12, NUMBER = 16 };

/* The words of the render, as they are to be run; memory of the caller's, as long as `word` and MORE_WORDS more. Ours come
 * first, as "--" may end the options. heatmap: NULL for none. spp: room for a number, to live as long. */
static bool command_of(const char *path, const struct image *im,
                       const struct reproduce_options *opt, char **word, int num,
                       const char *samples, const char *threads, const char *out,
                       const char *heatmap, char spp[NUMBER], const char **argv, struct err *e)
{
    struct options o;
    struct err why = {""};
    if (!options_parse(num, word, &o, &why) || o.action != ACTION_RENDER)
        return err_set(e, "%s: its command is none of this program: %s", path, why.msg);
    if (!reproduce_input(path, "scene", opt->scene != NULL ? opt->scene : o.scene,
                         attr(im, "assay:scene"), "give --scene, or ", e))
        return false;
    const char *ours[] = {opt->pathtracer, "-q", "-t", threads, "--samples", samples, "-f", out};
    int n = (int)(sizeof ours / sizeof *ours);
    memcpy(argv, ours, sizeof ours);
    if (heatmap != NULL) {
        argv[n++] = "--heatmap";
        argv[n++] = heatmap;
    }
    /* Where it was the default, the most that a pilot grants would now be the last of the samples. */
    if (o.pilot_tolerance >= 0) {
        snprintf(spp, NUMBER, "%d", o.spp);
        argv[n++] = "-s";
        argv[n++] = spp;
    }
    int kept = cli_rewrite_kept(cli_rewrite_render, num - 1, word + 1, word + 1);
    for (int i = 1; i <= kept; i++)
        argv[n++] = word[i] == o.scene && opt->scene != NULL ? opt->scene : word[i];
    return true;
}

/* The same render by metadata: another camera file, say, is another picture. */
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

bool reproduce_compare(const char *path, const struct image *a, const struct image *b,
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

bool reproduce_render(const char *path, const struct image *im, char **word, int num,
                      const char *samples, const struct reproduce_options *opt, const char *to,
                      const char *heatmap, struct reproduced *out, struct err *e)
{
    char threads[NUMBER], spp[NUMBER], log[MAX_PATH];
    snprintf(threads, sizeof threads, "%d", opt->threads);
    snprintf(log, sizeof log, "%s.log", to);
    const char **argv = calloc((size_t)num + MORE_WORDS, sizeof *argv);
    bool ok = (argv != NULL || err_set(e, "out of memory")) &&
              command_of(path, im, opt, word, num, samples, threads, to, heatmap, spp, argv, e);
    ok = ok && reproduced_command(out, argv, e);
    const struct process p = {.argv = argv, .log = log};
    ok = ok && (process_run(&p, NULL, e) || err_prefix(e, "%s: made again", path));
    free(argv);
    return ok;
}

bool reproduce_ranges(const char *path, const struct image *im, char **word, int num,
                      const struct reproduce_options *opt, const char *to, struct reproduced *out,
                      struct err *e)
{
    enum { BEFORE = 6 }; /* words that plan it */
    char threads[NUMBER], spp[NUMBER], ranges[NUMBER], dir[MAX_PATH];
    struct plan p = {.dir = ""};
    struct plan_wishes w = {.parts = 1, .ranges = 1, .pathtracer = opt->pathtracer};
    for (const char *c = attr(im, "assay:ranges"); *c != '\0'; c++)
        w.ranges += *c == ',';
    snprintf(threads, sizeof threads, "%d", opt->threads);
    snprintf(ranges, sizeof ranges, "%d", w.ranges);
    snprintf(dir, sizeof dir, "%.4000s.plan", to);
    const char **argv = calloc((size_t)num + BEFORE + MORE_WORDS, sizeof *argv);
    if (argv == NULL)
        return err_set(e, "out of memory");
    const char *plan[BEFORE] = {"assay", "plan", "--parts", "1", "--ranges", ranges};
    memcpy(argv, plan, sizeof plan);
    const char **render = argv + BEFORE;
    bool ok = command_of(path, im, opt, word, num, attr(im, "assay:samples"), threads, to, NULL,
                         spp, render, e);
    render[0] = "pathtracer";
    char **words = (char **)render;
    int count = 0;
    while (render[count] != NULL)
        count++;
    ok = ok && reproduced_command(out, argv, e) && plan_make(dir, count, words, &w, &p, e);
    for (int k = 0; ok && k < p.num; k++) {
        bool made;
        ok = job_run(&p, k, &made, e);
    }
    ok = ok && job_render_gather_quietly(&p, count, words, e);
    plan_free(&p);
    free(argv);
    return ok || err_prefix(e, "%s: made again", path);
}

static bool remake(const char *path, const struct reproduce_options *opt, const char *to, int depth,
                   struct reproduced *out, struct err *e);

/* Shares are made again each and then put together; their paths are those of the command. */
static bool remake_merge(const char *path, char **word, int num,
                         const struct reproduce_options *opt, const char *to, int depth,
                         struct reproduced *out, struct err *e)
{
    int shares = num - 3, read = 0;
    struct share whole = {0}, *share = calloc((size_t)(shares > 0 ? shares : 1), sizeof *share);
    bool ok = share != NULL || err_set(e, "out of memory");
    if (ok && shares < 2)
        ok = err_set(e, "%s: its command names no shares", path);
    for (int i = 0; ok && i < shares; i++) {
        char part[MAX_PATH];
        snprintf(part, sizeof part, "%.4000s.%d.exr", to, i);
        ok = access(word[3 + i], R_OK) == 0 ||
             err_set(e, "%s: its share '%s' is not here: go where it was made", path, word[3 + i]);
        ok = ok && remake(word[3 + i], opt, part, depth + 1, out, e) &&
             share_read(part, &share[i], e);
        read += ok;
    }
    ok = ok && merge_shares(share, shares, &whole, e) && share_write(to, &whole, "assay merge", e);
    for (int i = 0; i < read; i++)
        share_free(&share[i]);
    free(share);
    share_free(&whole);
    return ok && reproduced_command(out, (const char *const *)word, e);
}

/* Into the file `to`. */
static bool remake(const char *path, const struct reproduce_options *opt, const char *to, int depth,
                   struct reproduced *out, struct err *e)
{
    enum { MOST_DEPTH = 16 };
    struct image im = {0};
    int num = 0;
    if (depth > MOST_DEPTH)
        return err_set(e, "%s: merged from itself", path);
    if (!image_read_exr(path, &im, NULL, e))
        return false;
    const char *command = image_get_attr(&im, "assay:command");
    char **word = NULL;
    bool ok = command != NULL || err_set(e, "%s: does not say by what command it was made", path);
    if (ok && (word = shell_quote_split(command, &num, e)) == NULL)
        ok = err_prefix(e, "%s", path);
    snprintf(out->made_by, sizeof out->made_by, "%s", attr(&im, "assay:version"));
    if (ok && num >= 2 && strcmp(word[0], "assay") == 0 && strcmp(word[1], "merge") == 0)
        ok = remake_merge(path, word, num, opt, to, depth, out, e);
    else if (ok && image_get_attr(&im, "assay:ranges") != NULL)
        ok = reproduce_ranges(path, &im, word, num, opt, to, out, e);
    else if (ok)
        ok = reproduce_render(path, &im, word, num, attr(&im, "assay:samples"), opt, to, NULL, out,
                              e);
    free(word);
    image_free(&im);
    return ok;
}

void reproduced_free(struct reproduced *r)
{
    free(r->command);
    *r = (struct reproduced){0};
}

static bool reproduce_picture(const char *path, const struct reproduce_options *opt,
                              const char *dir, struct reproduced *out, struct err *e)
{
    struct image then = {0}, now = {0};
    struct reproduce_options with = *opt;
    char to[MAX_PATH], beside[4096];
    fs_beside_program(beside, sizeof beside, "pathtracer");
    if (with.pathtracer == NULL)
        with.pathtracer = beside;
    if (image_is_png(path))
        return reproduce_png(path, &with, dir, out, e);
    if (!image_read_exr(path, &then, NULL, e))
        return false;
    snprintf(to, sizeof to, "%s/again.exr", dir);
    bool ok = image_get_attr(&then, "assay:engine") != NULL
                  ? reproduce_golden(path, &then, opt, dir, to, out, e)
                  : remake(path, &with, to, 0, out, e);
    ok = ok && image_read_exr(to, &now, NULL, e) && check_same(path, &then, &now, e) &&
         reproduce_compare(path, &then, &now, out, e);
    if (ok && opt->keep != NULL)
        ok = image_write_exr(opt->keep, &now, e);
    image_free(&then);
    image_free(&now);
    return ok;
}

/* JSON is told by its first byte. */
static bool is_results(const char *path)
{
    FILE *f = fopen(path, "rb");
    int first = f != NULL ? getc(f) : EOF;
    if (f != NULL)
        fclose(f);
    return first == '{' || first == '[';
}

enum kind { OF_CLASS, PAGE, RESULTS, PICTURE };

static enum kind kind_of(const char *path)
{
    return reproduce_is_of_class(path) ? OF_CLASS
           : reproduce_is_page(path)   ? PAGE
           : is_results(path)          ? RESULTS
                                       : PICTURE;
}

static bool remake_kind(enum kind kind, const char *path, const struct reproduce_options *opt,
                        const char *dir, struct reproduced *out, struct err *e)
{
    bool for_picture = opt->scene != NULL || opt->pathtracer != NULL;
    if (for_picture && kind != PICTURE)
        return err_set(e, "%s: --scene and --pathtracer are for pictures", path);
    switch (kind) {
    case OF_CLASS: return reproduce_class(path, opt, dir, out, e);
    case PAGE: return reproduce_page(path, opt, dir, out, e);
    case RESULTS: return reproduce_results(path, opt, dir, out, e);
    case PICTURE: return reproduce_picture(path, opt, dir, out, e);
    }
    return false;
}

bool reproduce(const char *path, const struct reproduce_options *opt, struct reproduced *out,
               struct err *e)
{
    struct err ignored;
    struct temp_dir dir;
    *out = (struct reproduced){0};
    if (!temp_dir_open(&dir, "reproduce", e))
        return false;
    bool ok = remake_kind(kind_of(path), path, opt, dir.path, out, e);
    if (!ok)
        reproduced_free(out);
    bool removed = temp_dir_close(&dir, &ignored);
    (void)removed; /* the next run does it */
    return ok;
}
