#include "history.h"

#include "noise_results.h"
#include "results.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <gsl/gsl_cdf.h>

enum { DEEPEST = 8, MOST_RUNS = 400 };

static bool add_run(struct history *h, const char *path, size_t root, struct err *e)
{
    if (h->num_runs == MOST_RUNS)
        return err_set(e, "%s: more than %d runs", path, MOST_RUNS);
    struct history_run *grown = realloc(h->run, (h->num_runs + 1) * sizeof *grown);
    if (grown == NULL)
        return err_set(e, "out of memory for the history");
    h->run = grown;
    struct history_run *r = &grown[h->num_runs];
    *r = (struct history_run){.path = strdup(path + root)};
    if (r->path == NULL)
        return err_set(e, "out of memory for the history");
    if (!results_read(path, &r->results, e)) {
        free(r->path);
        return false;
    }
    h->num_runs++;
    return true;
}

/* Adds the runs below dir. root: length of the prefix of every path that is the directory asked for. */
static bool walk(struct history *h, const char *dir, size_t root, int depth, struct err *e)
{
    DIR *d = opendir(dir);
    if (d == NULL)
        return err_set(e, "%s: not a directory that can be read: %s", dir, strerror(errno));
    bool ok = true;
    for (struct dirent *entry; ok && (entry = readdir(d)) != NULL;) {
        char path[4096];
        struct stat st;
        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0)
            continue;
        int n = snprintf(path, sizeof path, "%s/%s", dir, entry->d_name);
        if (n < 0 || (size_t)n >= sizeof path || lstat(path, &st) != 0)
            ok = err_set(e, "%s: cannot be read", dir);
        else if (S_ISDIR(st.st_mode))
            ok = depth == DEEPEST || walk(h, path, root, depth + 1, e);
        else if (S_ISREG(st.st_mode) && strcmp(entry->d_name, "results.json") == 0)
            ok = add_run(h, path, root, e);
    }
    closedir(d);
    return ok;
}

static int compare_runs(const void *a, const void *b)
{
    const struct history_run *x = a, *y = b;
    int order = strcmp(member_text(x->results, "date"), member_text(y->results, "date"));
    return order != 0 ? order : strcmp(x->path, y->path);
}

static double number_or_nan(const json_t *object, const char *name)
{
    return json_object_get(object, name) != NULL ? member_number(object, name) : NAN;
}

static struct history_point point_of(const json_t *claim, size_t run)
{
    struct history_point p = {
        .run = run,
        .alpha = results_interval_alpha(claim),
        .difference = member_number(claim, "difference"),
        .low = member_end(claim, "ci", 0),
        .high = member_end(claim, "ci", 1),
        .variance_ratio = number_or_nan(json_object_get(claim, "variance_ratio"), "ratio"),
        .seconds = number_or_nan(claim, "seconds_a"),
    };
    double n = number_or_nan(claim, "n_a");
    p.efficiency = p.seconds > 0 && p.variance_ratio > 0 ? n / (p.seconds * p.variance_ratio) : NAN;
    return p;
}

static const char *quantity_of(const json_t *claim)
{
    const char *quantity = member_text(claim, "quantity");
    return quantity != NULL ? quantity : "mean";
}

static bool is_of(const struct history_series *s, const json_t *claim)
{
    return strcmp(s->scene, member_text(claim, "scene")) == 0 &&
           strcmp(s->a, member_text(claim, "a")) == 0 &&
           strcmp(s->b, member_text(claim, "b")) == 0 &&
           strcmp(s->quantity, quantity_of(claim)) == 0;
}

static struct history_series *series_of(struct history *h, const json_t *claim, struct err *e)
{
    for (size_t i = 0; i < h->num_series; i++)
        if (is_of(&h->series[i], claim))
            return &h->series[i];
    struct history_series *grown = realloc(h->series, (h->num_series + 1) * sizeof *grown);
    if (grown != NULL) {
        h->series = grown;
        grown[h->num_series] = (struct history_series){.scene = member_text(claim, "scene"),
                                                       .a = member_text(claim, "a"),
                                                       .b = member_text(claim, "b"),
                                                       .quantity = quantity_of(claim)};
        grown[h->num_series].point = calloc(h->num_runs, sizeof *grown->point);
        if (grown[h->num_series].point != NULL)
            return &grown[h->num_series++];
    }
    err_set(e, "out of memory for the history");
    return NULL;
}

static double std_error(const struct history_point *p)
{
    return (p->high - p->low) / 2 / gsl_cdf_ugaussian_Qinv(fmin(p->alpha, 0.4));
}

/* Fills earlier and z. Weights: 1/variance, and 0 for points without noise; equal if none has any. */
static void find_move(const struct history *h, struct history_series *s)
{
    if (s->num < 2 || s->point[s->num - 1].run != h->num_runs - 1)
        return;
    const struct history_point *last = &s->point[s->num - 1];
    double weights = 0, sum = 0, plain = 0, se = std_error(last);
    for (size_t i = 0; i + 1 < s->num; i++) {
        double one = std_error(&s->point[i]);
        double weight = one > 0 ? 1 / (one * one) : 0;
        weights += weight;
        sum += weight * s->point[i].difference;
        plain += s->point[i].difference / (double)(s->num - 1);
    }
    s->earlier = weights > 0 ? sum / weights : plain;
    double noise = sqrt(se * se + (weights > 0 ? 1 / weights : 0)),
           d = last->difference - s->earlier;
    if (d != 0)
        s->z = noise > 0 ? d / noise : copysign(1e4, d);
}

static int compare_series(const void *a, const void *b)
{
    const struct history_series *x = a, *y = b;
    if (fabs(x->z) != fabs(y->z))
        return fabs(x->z) > fabs(y->z) ? -1 : 1;
    int order = strcmp(x->scene, y->scene);
    order = order != 0 ? order : strcmp(x->a, y->a);
    order = order != 0 ? order : strcmp(x->b, y->b);
    return order != 0 ? order : strcmp(x->quantity, y->quantity);
}

static bool gather_list(struct history *h, size_t r, const json_t *claims, struct err *e)
{
    json_each(c, claims) {
        if (results_claim_outcome(c) == OUTCOME_NOT_JUDGED || json_object_get(c, "ci") == NULL)
            continue;
        struct history_series *s = series_of(h, c, e);
        if (s == NULL)
            return false;
        if (s->num > 0 && s->point[s->num - 1].run == r)
            return err_set(e, "%s: %s: %s against %s is there twice", h->run[r].path, s->scene,
                           s->a, s->b);
        s->point[s->num++] = point_of(c, r);
    }
    return true;
}

static bool gather(struct history *h, struct err *e)
{
    bool ok = true;
    for (size_t r = 0; ok && r < h->num_runs; r++) {
        json_t *root = h->run[r].results,
               *noise = noise_results_claims(json_object_get(root, "noise"));
        json_object_set_new(root, "noise_claims", noise); /* series borrow their texts */
        ok = gather_list(h, r, json_object_get(root, "claims"), e) && gather_list(h, r, noise, e);
    }
    return ok;
}

bool history_read(const char *dir, double alpha, struct history *out, struct err *e)
{
    *out = (struct history){.alpha = alpha};
    bool ok = walk(out, dir, strlen(dir) + 1, 0, e);
    if (ok && out->num_runs == 0)
        ok = err_set(e, "%s: no results.json in it or below it", dir);
    if (ok) {
        qsort(out->run, out->num_runs, sizeof *out->run, compare_runs);
        ok = gather(out, e);
    }
    if (!ok) {
        history_free(out);
        return false;
    }
    for (size_t i = 0; i < out->num_series; i++)
        find_move(out, &out->series[i]);
    if (out->num_series > 0) {
        qsort(out->series, out->num_series, sizeof *out->series, compare_series);
        out->critical = gsl_cdf_ugaussian_Qinv(alpha / 2 / (double)out->num_series);
    }
    while (out->moved < out->num_series && fabs(out->series[out->moved].z) > out->critical)
        out->moved++;
    return true;
}

void history_free(struct history *h)
{
    for (size_t i = 0; i < h->num_series; i++)
        free(h->series[i].point);
    for (size_t i = 0; i < h->num_runs; i++) {
        free(h->run[i].path);
        json_decref(h->run[i].results);
    }
    free(h->series);
    free(h->run);
    *h = (struct history){0};
}

void history_version(const struct history_run *run, char *out, size_t size)
{
    json_each(claim, json_object_get(run->results, "claims")) {
        if (member_text(claim, "version_a") != NULL) {
            snprintf(out, size, "%s", member_text(claim, "version_a"));
            return;
        }
    }
    const char *version = member_text(run->results, "version"), *at = strstr(version, "commit ");
    snprintf(out, size, "%s", at != NULL ? at + strlen("commit ") : version);
    if (at != NULL)
        out[strcspn(out, ")")] = '\0';
}
