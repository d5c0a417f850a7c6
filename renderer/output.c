#include "output.h"

#include "shell_words.h"
#include "tone.h"
#include "version.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool write_png(const char *path, const struct moments *m, enum tone_curve curve,
                      struct err *e)
{
    size_t n = 3 * (size_t)m->width * (size_t)m->height;
    uint8_t *bytes = malloc(n);
    if (bytes == NULL)
        return err_set(e, "%s: out of memory", path);
    for (size_t i = 0; i < n; i++)
        bytes[i] = tone_map(curve, m->mean[i]);
    bool ok = image_write_png(path, m->width, m->height, bytes, e);
    free(bytes);
    return ok;
}

void rate_colour(double rate, uint8_t rgb8[3])
{
    double green = rate <= 0.5 ? 2 * rate : 2 - 2 * rate;
    rgb8[0] = (uint8_t)(rate <= 0.5 ? 0 : 255 * (2 * rate - 1));
    rgb8[1] = (uint8_t)(255 * green);
    rgb8[2] = (uint8_t)(rate <= 0.5 ? 255 * (1 - 2 * rate) : 0);
}

static bool write_rates(const char *png, const struct film *f, int most, struct err *e)
{
    char path[4096];
    size_t pixels = (size_t)f->m.width * (size_t)f->m.height;
    if (strlen(png) + sizeof "_rate" > sizeof path)
        return err_set(e, "%.64s...: path too long", png);
    snprintf(path, sizeof path, "%.*s_rate.png", (int)(strlen(png) - strlen(".png")), png);
    uint8_t *bytes = malloc(3 * pixels);
    if (bytes == NULL)
        return err_set(e, "%s: out of memory", path);
    for (size_t p = 0; p < pixels; p++)
        rate_colour(f->m.n[p] / most, bytes + 3 * p);
    bool ok = image_write_png(path, f->m.width, f->m.height, bytes, e);
    free(bytes);
    return ok;
}

static bool write_exr(const struct output *o, const char *path, const struct film *f,
                      const struct render_stats *stats, struct err *e)
{
    char samples[64], seconds[64] = "", rays[128] = "";
    char *command = shell_join(NULL, (const char *const *)o->argv);
    if (command == NULL)
        return err_set(e, "%s: out of memory", path);
    snprintf(samples, sizeof samples, "%d:%lld", o->opt->first,
             (long long)o->opt->first + f->num_samples);
    if (stats != NULL) {
        snprintf(seconds, sizeof seconds, "%.3f wall, %.3f cpu", stats->wall_seconds,
                 stats->cpu_seconds);
        snprintf(rays, sizeof rays, "%llu rays, %llu box tests, %llu primitive tests",
                 (unsigned long long)stats->rays.rays, (unsigned long long)stats->rays.box_tests,
                 (unsigned long long)stats->rays.primitive_tests);
    }
    const struct image_attr attrs[] = {{"assay:version", assay_version},
                                       {"assay:command", command},
                                       {"assay:scene", o->id->scene},
                                       {"assay:settings", o->id->settings},
                                       {"assay:adaptive", o->id->adaptive},
                                       {"assay:seed", o->id->seed},
                                       {"assay:cell", o->id->cell},
                                       {"assay:samples", samples},
                                       {"assay:sampler", sampler_kind_names[o->opt->sampler]},
                                       {"assay:accel", o->accel},
                                       {"assay:seconds", seconds},
                                       {"assay:rays", rays}};
    int num_attrs = (int)(sizeof attrs / sizeof attrs[0]) - (stats == NULL ? 2 : 0);
    struct image layers = {0};
    bool ok =
        (f->first == NULL || film_layers(f, &layers, e)) &&
        moments_write_layers(path, &f->m, f->first != NULL ? &layers : NULL, attrs, num_attrs, e);
    image_free(&layers);
    free(command);
    return ok;
}

bool output_pictures(const struct output *o, const struct film *f, const struct render_stats *stats,
                     struct err *e)
{
    bool adaptive = o->opt->adaptive_batch > 0 || o->opt->pilot_tolerance >= 0;
    for (int i = 0; i < o->opt->num_outputs; i++) {
        const char *path = o->opt->output[i];
        enum tone_curve curve = o->scene->dialect == DIALECT_CGL ? TONE_CGL : TONE_SRGB;
        if (is_exr(path) ? !write_exr(o, path, f, stats, e) : !write_png(path, &f->m, curve, e))
            return false;
        if (adaptive && !is_exr(path) && !write_rates(path, f, o->opt->last - o->opt->first, e))
            return false;
    }
    return true;
}

bool output_state_path(const struct output *o, const char *picture, char path[STATE_PATH],
                       struct err *e)
{
    if (picture == NULL)
        picture = o->opt->output[0];
    int n = snprintf(path, STATE_PATH, "%s.state", picture);
    return (n > 0 && n < STATE_PATH) || err_set(e, "%.64s...: path too long", picture);
}

void print_summary(const struct output *o, const struct film *f, const struct render_stats *stats)
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
    if (stats->end == RENDER_TIME || stats->end == RENDER_ERROR)
        fprintf(stderr, "stopped by --%s after %lu samples per pixel, relative error %.3g %%\n",
                stats->end == RENDER_TIME ? "time" : "error", (unsigned long)f->num_samples,
                100 * film_relative_error(f));
}

void print_how_to_resume(const struct output *o, const struct film *f)
{
    const char *const picture[] = {o->opt->output[0], NULL};
    char *command = shell_join(NULL, (const char *const *)o->argv);
    char *more = o->opt->resume == NULL ? shell_join("--resume", picture) : NULL;
    fprintf(stderr,
            "pathtracer: interrupted after %lu of %d samples per pixel; to go on:\n%s%s%s\n",
            (unsigned long)f->num_samples, o->opt->last - o->opt->first,
            command != NULL ? command : "the same command", more != NULL ? " " : "",
            more != NULL ? more : "");
    free(command);
    free(more);
}
