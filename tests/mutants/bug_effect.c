#include "bug_effect.h"

#include "renderer/base/fs.h"
#include "tests/tools/diagnose/catalogue_write.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_BUGS = 512 };

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct bug *)a)->name, ((const struct bug *)b)->name);
}

bool bug_list(const char *dir, struct catalogue *c, struct err *e)
{
    DIR *d = opendir(dir);
    bool ok = d != NULL || err_set(e, "%s: cannot be read", dir);
    if (c->bug == NULL)
        c->bug = calloc(MOST_BUGS, sizeof *c->bug);
    ok = ok && (c->bug != NULL || err_set(e, "out of memory"));
    for (struct dirent *entry; ok && (entry = readdir(d)) != NULL;) {
        const char *dot = strrchr(entry->d_name, '.');
        if (dot != NULL && strcmp(dot, ".patch") == 0 && c->num_bugs < MOST_BUGS)
            ok = catalogue_bug_of_patch(fs_path("%s/%s", dir, entry->d_name).s,
                                        &c->bug[c->num_bugs++], e);
    }
    if (d != NULL)
        closedir(d);
    if (ok)
        qsort(c->bug, (size_t)c->num_bugs, sizeof *c->bug, by_name);
    return ok && (c->num_bugs > 0 || err_set(e, "%s: no patch", dir));
}

/* Variance of the differences over the batches, relative to that of independent renders. */
static double level_of(const struct signature *bug, const struct signature *correct, int batches,
                       const struct signature *a, const struct signature *c)
{
    double level = 0;
    int noisy = 0;
    for (int i = 0; i < 3 * a->columns * a->rows; i++) {
        double shape = a->var[i] + c->var[i], squares = 0;
        for (int k = 0; k < batches; k++)
            squares += pow(bug[k].mean[i] - correct[k].mean[i] - (a->mean[i] - c->mean[i]), 2);
        if (shape > 0) {
            level += squares / (batches - 1) / batches / shape;
            noisy++;
        }
    }
    return fmax(noisy > 0 ? level / noisy : 0, 1e-3);
}

void bug_effect(const struct signature *bug, const struct signature *correct, int batches,
                double level, const double *more, const struct signature *a, struct effect *out)
{
    struct signature c = signature_average(correct, batches);
    int values = 3 * a->columns * a->rows;
    double chi2 = 0;
    if (level <= 0)
        level = level_of(bug, correct, batches, a, &c);
    *out = (struct effect){0};
    for (int i = 0; i < values; i++) {
        double mean = a->mean[i] - c.mean[i], var = level * (a->var[i] + c.var[i]);
        double rounding = 1e-6 * (a->mean[i] + c.mean[i]);
        chi2 += mean * mean / (var + rounding * rounding + 1e-300);
        out->mean[i] = (float)mean;
        out->var[i] = (float)(var + (more != NULL ? more[i] : 0));
    }
    out->pixels = chi2 > values + 6 * sqrt(2.0 * 3 * values);
    if (!out->pixels) {
        memset(out->mean, 0, sizeof out->mean);
        memset(out->var, 0, sizeof out->var);
    }
    for (int f = 0; f < NUM_FACTS; f++) {
        out->fact[f] = a->fact[f];
        out->fact_sd[f] = a->fact_sd[f];
    }
}
