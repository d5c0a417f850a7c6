#include "output.h"

#include "renderer/base/fs.h"
#include "renderer/base/shell_quote.h"
#include "renderer/image/tone.h"
#include "renderer/base/version.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void rate_colour(double rate, uint8_t rgb8[3])
{
    double green = rate <= 0.5 ? 2 * rate : 2 - 2 * rate;
    rgb8[0] = (uint8_t)(rate <= 0.5 ? 0 : 255 * (2 * rate - 1));
    rgb8[1] = (uint8_t)(255 * green);
    rgb8[2] = (uint8_t)(rate <= 0.5 ? 255 * (1 - 2 * rate) : 0);
}

static bool is_adaptive(const struct options *o)
{
    return o->adaptive_batch > 0 || o->pilot_tolerance >= 0;
}

static struct path rates_path(const char *png)
{
    return fs_path("%.*s_rate.png", (int)(strlen(png) - strlen(".png")), png);
}

enum { NUM_TEXTS = 13 };

/* The metadata of an EXR. `command` must be freed. */
struct texts {
    char *command, samples[64], seconds[64], rays[128];
    struct image_attr attr[NUM_TEXTS];
    int num;
};

static bool make_texts(const struct output *o, uint32_t num_samples,
                       const struct render_stats *stats, struct texts *t)
{
    t->command = shell_quote_join(NULL, (const char *const *)o->argv);
    if (t->command == NULL)
        return false;
    snprintf(t->samples, sizeof t->samples, "%d:%lld", o->opt->first,
             (long long)o->opt->first + num_samples);
    if (stats != NULL) {
        snprintf(t->seconds, sizeof t->seconds, "%.3f wall, %.3f cpu", stats->wall_seconds,
                 stats->cpu_seconds);
        snprintf(t->rays, sizeof t->rays, "%llu rays, %llu box tests, %llu primitive tests",
                 (unsigned long long)stats->rays.rays, (unsigned long long)stats->rays.box_tests,
                 (unsigned long long)stats->rays.primitive_tests);
    }
    const struct image_attr attrs[NUM_TEXTS] = {
        {"assay:version", assay_version},
        {"assay:command", t->command},
        {"assay:scene", o->id->scene},
        {"assay:settings", o->id->settings},
        {"assay:adaptive", o->id->adaptive},
        {"assay:seed", o->id->seed},
        {"assay:cell", o->id->cell},
        {"assay:samples", t->samples},
        {"assay:sampler", sampler_kind_names[o->opt->sampler]},
        {"assay:accel", o->accel},
        {"assay:seconds", t->seconds},
        {"assay:rays", t->rays}};
    memcpy(t->attr, attrs, sizeof attrs);
    t->num = NUM_TEXTS - 1 - (stats == NULL ? 2 : 0);
    if (o->ranges != NULL)
        t->attr[t->num++] = (struct image_attr){"assay:ranges", o->ranges};
    return true;
}

struct output_writer {
    const struct output *o;
    const struct render_stats *stats;
    int width, height, y; /* y: the next row */
    uint32_t num_samples;
    double most;                             /* samples of a pixel, so far */
    struct moments_writer *exr[MAX_OUTPUTS]; /* NULL: a PNG, or not begun */
    uint8_t *rgb8, *rates;                   /* NULL: no PNG, not adaptive */
};

struct output_writer *output_open(const struct output *o, int width, int height,
                                  uint32_t num_samples, const struct render_stats *stats,
                                  struct err *e)
{
    struct output_writer *w = calloc(1, sizeof *w);
    bool adaptive = is_adaptive(o->opt), png = false;
    size_t bytes = 3 * (size_t)width * (size_t)height;
    if (w == NULL) {
        err_set(e, "out of memory");
        return NULL;
    }
    *w = (struct output_writer){
        .o = o, .stats = stats, .width = width, .height = height, .num_samples = num_samples};
    for (int i = 0; i < o->opt->num_outputs; i++)
        png = png || !image_is_exr(o->opt->output[i]);
    w->rgb8 = png ? malloc(bytes) : NULL;
    w->rates = png && adaptive ? malloc(bytes) : NULL;
    if (!png || (w->rgb8 != NULL && (w->rates != NULL || !adaptive)))
        return w;
    err_set(e, "%s: out of memory", o->opt->output[0]);
    output_abandon(w);
    return NULL;
}

static bool exr_rows(struct output_writer *w, const struct film *band, struct err *e)
{
    const struct options *opt = w->o->opt;
    struct image layers = {0};
    bool ok = true;
    for (int i = 0; ok && i < opt->num_outputs; i++) {
        if (!image_is_exr(opt->output[i]))
            continue;
        if (band->first != NULL && layers.data == NULL)
            ok = film_layers(band, &layers, e);
        const struct image *more = band->first != NULL ? &layers : NULL;
        if (ok && w->y == 0) {
            struct texts t;
            ok = make_texts(w->o, w->num_samples, w->stats, &t) ||
                 err_set(e, "%s: out of memory", opt->output[i]);
            if (!ok)
                break;
            w->exr[i] =
                moments_writer_open(opt->output[i], &band->m, w->height, more, t.attr, t.num, e);
            free(t.command);
        }
        ok = ok && w->exr[i] != NULL && moments_writer_rows(w->exr[i], &band->m, more, e);
    }
    image_free(&layers);
    return ok;
}

bool output_rows(struct output_writer *w, const struct film *band, struct err *e)
{
    enum tone_curve curve = w->o->scene->dialect == DIALECT_CGL ? TONE_CGL : TONE_SRGB;
    size_t pixels = (size_t)band->m.width * (size_t)band->m.height,
           at = 3 * (size_t)w->y * (size_t)w->width;
    if (!exr_rows(w, band, e))
        return false;
    for (size_t i = 0; w->rgb8 != NULL && i < 3 * pixels; i++)
        w->rgb8[at + i] = tone_map(curve, band->m.mean[i]);
    for (size_t p = 0; p < pixels; p++)
        w->most = fmax(w->most, band->m.n[p]);
    for (size_t p = 0; w->rates != NULL && p < pixels; p++)
        rate_colour(band->m.n[p] / (w->o->opt->last - w->o->opt->first), w->rates + at + 3 * p);
    w->y += band->m.height;
    return true;
}

/* Nothing in the file depends on its name, the threads or the jobs, so the same pixels give the same file. */
static bool write_png(const struct output_writer *w, const char *path, const uint8_t *rgb8,
                      struct err *e)
{
    const struct render_id *id = w->o->id;
    char samples[64];
    snprintf(samples, sizeof samples, "%d:%.0f", w->o->opt->first, w->o->opt->first + w->most);
    const struct image_attr text[] = {
        {"assay:version", assay_version}, {"assay:scene", id->scene},
        {"assay:settings", id->settings}, {"assay:adaptive", id->adaptive},
        {"assay:seed", id->seed},         {"assay:cell", id->cell},
        {"assay:samples", samples}};
    return image_write_png_texts(path, w->width, w->height, rgb8, text, sizeof text / sizeof *text,
                                 e);
}

bool output_close(struct output_writer *w, struct err *e)
{
    const struct options *opt = w->o->opt;
    bool ok = true;
    for (int i = 0; ok && i < opt->num_outputs; i++) {
        if (image_is_exr(opt->output[i])) {
            ok = moments_writer_close(w->exr[i], e);
            w->exr[i] = NULL;
            continue;
        }
        ok = write_png(w, opt->output[i], w->rgb8, e) &&
             (w->rates == NULL || write_png(w, rates_path(opt->output[i]).s, w->rates, e));
    }
    output_abandon(w);
    return ok;
}

void output_abandon(struct output_writer *w)
{
    for (int i = 0; i < MAX_OUTPUTS; i++)
        moments_writer_abandon(w->exr[i]);
    free(w->rgb8);
    free(w->rates);
    free(w);
}

bool output_images(const struct output *o, const struct film *f, const struct render_stats *stats,
                   struct err *e)
{
    struct output_writer *w = output_open(o, f->m.width, f->m.height, f->num_samples, stats, e);
    if (w == NULL)
        return false;
    if (output_rows(w, f, e))
        return output_close(w, e);
    output_abandon(w);
    return false;
}

bool output_check(const struct output *o, struct err *e)
{
    char state[CHECKPOINT_PATH];
    bool ok = output_state_path(o, NULL, state, e);
    for (int i = 0; ok && i < o->opt->num_outputs; i++) {
        const char *path = o->opt->output[i];
        ok = out_check(path, e) &&
             (image_is_exr(path) || !is_adaptive(o->opt) || out_check(rates_path(path).s, e));
    }
    return ok && out_check(state, e) && (o->opt->heatmap == NULL || out_check(o->opt->heatmap, e));
}

bool output_rescue(const struct output *o, const struct film *f, const struct render_stats *stats,
                   struct err *e)
{
    const char *first = o->opt->output[0], *tmp = getenv("TMPDIR");
    const struct path dirs[] = {fs_beside_file(first, ""),
                                {""},
                                fs_path("%s/", tmp != NULL && *tmp != '\0' ? tmp : "/tmp")};
    const size_t num = strlen(e->msg);
    struct path name[MAX_OUTPUTS];
    struct options opt = *o->opt;
    struct output there = *o;
    there.opt = &opt;
    for (size_t d = 0; d < sizeof dirs / sizeof *dirs; d++) {
        struct err again;
        for (int i = 0; i < opt.num_outputs; i++) {
            name[i] =
                fs_path("%srescued-%ld-%s", dirs[d].s, (long)getpid(), fs_base(o->opt->output[i]));
            opt.output[i] = name[i].s;
        }
        if (!output_images(&there, f, stats, &again))
            continue;
        snprintf(e->msg + num, sizeof e->msg - num, "; the render is in %s instead", name[0].s);
        return false;
    }
    return false;
}

bool output_state_path(const struct output *o, const char *image, char path[CHECKPOINT_PATH],
                       struct err *e)
{
    if (image == NULL)
        image = o->opt->output[0];
    int n = snprintf(path, CHECKPOINT_PATH, "%s.state", image);
    return (n > 0 && n < CHECKPOINT_PATH) || err_set(e, "%.64s...: path too long", image);
}

void output_print_summary(const struct output *o, const struct film *f,
                          const struct render_stats *stats)
{
    const struct moments *m = &f->m;
    size_t pixels = (size_t)m->width * (size_t)m->height;
    double mean[3] = {0}, var[3] = {0};
    for (size_t p = 0; p < pixels; p++)
        for (int c = 0; c < 3; c++) {
            mean[c] += m->mean[3 * p + (size_t)c] / (double)pixels;
            double v = moments_var_of_mean(m, p, c);
            var[c] += v > 0 ? v / (double)pixels / (double)pixels : 0;
        }
    printf("mean radiance %.6g %.6g %.6g", mean[0], mean[1], mean[2]);
    if (o->opt->sampler == SAMPLER_INDEPENDENT)
        printf(" +- %.2g %.2g %.2g\n", sqrt(var[0]), sqrt(var[1]), sqrt(var[2]));
    else
        puts(", error unknown");
    if (o->opt->quiet)
        return;
    double rays = stats->rays.rays > 0 ? (double)stats->rays.rays : 1;
    fprintf(stderr,
            "%.3g paths, %.3g rays in %.2f s (%.2f CPU s); per ray %.1f box and %.1f primitive "
            "tests; %s\n",
            stats->samples, (double)stats->rays.rays, stats->wall_seconds, stats->cpu_seconds,
            (double)stats->rays.box_tests / rays, (double)stats->rays.primitive_tests / rays,
            o->accel);
    fputs("written:", stderr);
    for (int i = 0; i < o->opt->num_outputs; i++) {
        const char *path = o->opt->output[i];
        fprintf(stderr, " %s", path);
        if (!image_is_exr(path) && is_adaptive(o->opt))
            fprintf(stderr, " %s", rates_path(path).s);
    }
    fputc('\n', stderr);
    if (stats->end == RENDER_TIME || stats->end == RENDER_ERROR)
        fprintf(stderr, "stopped by --%s after %lu samples per pixel, relative error %.3g %%\n",
                stats->end == RENDER_TIME ? "time" : "error", (unsigned long)f->num_samples,
                100 * film_relative_error(f));
}

void output_print_how_to_resume(const struct output *o, const struct film *f)
{
    /* --resume goes right after the program's name, since "--" may end the options. */
    const char **word = calloc((size_t)o->argc + 3, sizeof *word);
    char *command = NULL;
    int n = 0;
    if (word != NULL) {
        word[n++] = o->argv[0];
        if (o->opt->resume == NULL) {
            word[n++] = "--resume";
            word[n++] = o->opt->output[0];
        }
        memcpy(word + n, o->argv + 1, (size_t)(o->argc - 1) * sizeof *word);
        command = shell_quote_join(NULL, word);
    }
    fprintf(stderr, "pathtracer: interrupted after %lu of %d samples per pixel; to go on:\n%s\n",
            (unsigned long)f->num_samples, o->opt->last - o->opt->first,
            command != NULL ? command : "the same command, with --resume");
    free(command);
    free(word);
}
