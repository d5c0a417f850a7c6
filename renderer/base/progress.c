#include "progress.h"

#include <stdio.h>
#include <time.h>
#include <unistd.h>

double progress_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void progress_start(struct progress *p, const char *what, const char *unit, bool quiet)
{
    *p = (struct progress){.what = what,
                           .unit = unit,
                           .quiet = quiet,
                           .terminal = isatty(STDERR_FILENO) == 1,
                           .start = progress_seconds()};
    p->last = p->start;
}

static void print_rate(const struct progress *p, double done, double seconds)
{
    if (p->unit != NULL && seconds > 0)
        fprintf(stderr, "  %.2f %s/s", done * 1e-6 / seconds, p->unit);
}

void progress_update(struct progress *p, double done, double total)
{
    double now = progress_seconds();
    if (p->quiet || now - p->last < (p->terminal ? 0.2 : 10))
        return;
    p->last = now;
    double seconds = now - p->start, part = total > 0 ? done / total : 0;
    if (p->terminal) {
        char bar[31];
        for (int i = 0; i < 30; i++)
            bar[i] = i < (int)(part * 30) ? '#' : '-';
        bar[30] = '\0';
        fprintf(stderr, "\r%s [%s] %3.0f %%", p->what, bar, 100 * part);
    } else {
        fprintf(stderr, "%s: %.0f %%", p->what, 100 * part);
    }
    print_rate(p, done, seconds);
    if (part > 0)
        fprintf(stderr, "  %.0f s left", seconds * (1 - part) / part);
    fputs(p->terminal ? "\033[K" : "\n", stderr);
    fflush(stderr);
}

void progress_end(struct progress *p, double total)
{
    if (p->quiet)
        return;
    double seconds = progress_seconds() - p->start;
    fprintf(stderr, "%s%s: %.1f s", p->terminal ? "\r" : "", p->what, seconds);
    print_rate(p, total, seconds);
    fputs(p->terminal ? "\033[K\n" : "\n", stderr);
}
