/* make_calibration [--threads N] [--share S | --short] [--scenes DIR] OUT: measures the tester (calibrate.h)
 * and writes the page OUT/README.md with its plots. --share: that part of the pairs. Exits 0 if every
 * acceptance line holds, 1 if not, 3 if it could not measure. */
#include "calibrate.h"

#include <stdlib.h>
#include <string.h>

struct arguments {
    int threads;
    double share;
    bool is_short;
    const char *scenes, *out;
};

static bool parse(int argc, char **argv, struct arguments *a, struct err *e)
{
    *a = (struct arguments){.threads = 2, .share = 1, .scenes = "reference/scenes"};
    for (int i = 1; i < argc; i++) {
        const char *value = i + 1 < argc ? argv[i + 1] : "";
        char *end = "";
        if (strcmp(argv[i], "--threads") == 0) {
            long threads = strtol(value, &end, 10);
            if (*value == '\0' || *end != '\0' || threads < 1 || threads > 64)
                return err_set(e, "--threads: '%s' is not a number from 1 to 64", value);
            a->threads = (int)threads;
            i++;
        } else if (strcmp(argv[i], "--share") == 0) {
            a->share = strtod(value, &end);
            if (*value == '\0' || *end != '\0' || !(a->share > 0 && a->share <= 1))
                return err_set(e, "--share: '%s' is not in (0, 1]", value);
            i++;
        } else if (strcmp(argv[i], "--scenes") == 0) {
            if (*value == '\0')
                return err_set(e, "--scenes: which directory?");
            a->scenes = value;
            i++;
        } else if (strcmp(argv[i], "--short") == 0) {
            a->is_short = true;
        } else if (argv[i][0] == '-' || a->out != NULL) {
            return err_set(e, "unknown argument '%s'", argv[i]);
        } else {
            a->out = argv[i];
        }
    }
    if (a->out == NULL)
        return err_set(e, "usage: make_calibration [--threads N] [--share S | --short] OUT");
    return true;
}

static bool measure(const struct arguments *a, int *failed, struct err *e)
{
    struct settings s = a->is_short ? settings_short() : settings_published(a->share);
    struct settings few = settings_short();
    struct results *r = calloc(1, sizeof *r), *short_r = calloc(1, sizeof *short_r);
    struct weak_results *weak = calloc(1, sizeof *weak);
    struct checks *all = calloc(1, sizeof *all);
    struct work w = {.threads = a->threads,
                     .total = calibrate_cost(&s) + NUM_WEAKNESSES * calibrate_cost(&few)};
    char command[256] = "make calibrate";
    if (a->is_short)
        snprintf(command, sizeof command, "make_calibration --short");
    else if (a->share < 1)
        snprintf(command, sizeof command, "make calibrate SHARE=%g", a->share);
    bool ok = (r != NULL && short_r != NULL && weak != NULL && all != NULL) ||
              err_set(e, "out of memory for the results");
    progress_start(&w.progress, "calibrating", NULL, false);
    for (int i = 0; ok && i < NUM_WEAKNESSES; i++) {
        ok = calibrate(&w, &few, a->scenes, (enum weakness)i, short_r, e);
        if (ok)
            calibrate_check(&few, short_r, &weak->checks[i]);
    }
    ok = ok && calibrate(&w, &s, a->scenes, WEAK_NOT, r, e);
    progress_end(&w.progress, w.total);
    ok = ok && page_write(a->out, command, &s, r, weak, e);
    if (ok) {
        calibrate_check(&s, r, all);
        for (int i = 0; i < all->num; i++)
            if (!all->item[i].holds)
                printf("does not hold: %s\n", all->item[i].what);
        printf("%d lines, %d do not hold: %s/README.md\n", all->num, all->failed, a->out);
        *failed = all->failed;
    }
    free(r);
    free(short_r);
    free(weak);
    free(all);
    return ok;
}

int main(int argc, char **argv)
{
    struct arguments a;
    struct err e;
    int failed = 0;
    if (!parse(argc, argv, &a, &e) || !measure(&a, &failed, &e)) {
        fprintf(stderr, "make_calibration: %s\n", e.msg);
        return 3;
    }
    return failed > 0;
}
