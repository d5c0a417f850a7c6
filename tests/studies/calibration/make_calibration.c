/* make_calibration [--threads N] [--share S] OUT: measures the tester (calibrate.h) and writes the page OUT/README.md with
 * its plots. --share: that part of the pairs. Exits 0 if every acceptance line holds, 1 if not, 3 if it could not measure. */
#include "calibrate.h"

#include "renderer/base/cli.h"

#include <stdio.h>

struct arguments {
    int threads, num_out;
    bool help;
    double share;
    const char *out[1];
};

static const struct cli_option options[] = {
    {0, "threads", "N", "2", CLI_TO(struct arguments, threads), 1, 64},
    {0, "share", "S", "of the pairs (1)", CLI_TO(struct arguments, share), 1e-9, 1},
    {'h', "help", "", "print this", CLI_TO(struct arguments, help),
     .usage = "usage: make_calibration [--threads N] [--share S] OUT\n"},
    {.noun = "directories", CLI_TO_LIST(struct arguments, out, num_out)}};

static bool measure(const struct arguments *a, int *failed, struct err *e)
{
    struct settings s = settings_published(a->share);
    struct settings few = settings_short();
    static struct results r, short_r;
    static struct weak_results weak;
    static struct checks all;
    struct work w = {.threads = a->threads,
                     .total = calibrate_cost(&s) + NUM_WEAKNESSES * calibrate_cost(&few)};
    char command[256] = "make calibrate";
    if (a->share < 1)
        snprintf(command, sizeof command, "make calibrate SHARE=%g", a->share);
    bool ok = true;
    progress_start(&w.progress, "calibrating", NULL, false);
    for (int i = 0; ok && i < NUM_WEAKNESSES; i++) {
        ok = calibrate(&w, &few, "reference/scenes", (enum weakness)i, &short_r, e);
        if (ok)
            calibrate_check(&few, &short_r, &weak.checks[i]);
    }
    ok = ok && calibrate(&w, &s, "reference/scenes", WEAK_NOT, &r, e);
    progress_end(&w.progress, w.total);
    if (!ok)
        return false;
    calibrate_check(&s, &r, &all);
    for (int i = 0; i < all.num; i++)
        if (!all.item[i].holds)
            printf("does not hold: %s\n", all.item[i].what);
    printf("%d lines, %d do not hold: %s/README.md\n", all.num, all.failed, a->out[0]);
    *failed = all.failed;
    return page_write(a->out[0], command, &s, &r, &all, &weak, e);
}

int main(int argc, char **argv)
{
    struct arguments a = {.threads = 2, .share = 1};
    struct err e = {""};
    int failed = 0;
    bool ok = cli_read(options, argc, argv, &a, &e) &&
              (a.help || ((a.num_out == 1 || err_set(&e, "one directory is needed")) &&
                          measure(&a, &failed, &e)));
    if (!ok) {
        fprintf(stderr, "make_calibration: %s\n", e.msg);
        return 3;
    }
    return failed > 0;
}
