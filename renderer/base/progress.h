/* Progress of a long job: a bar with rate and remaining time on a terminal, a plain line now and then
 * in a log. Always on stderr. */
#ifndef ASSAY_PROGRESS_H
#define ASSAY_PROGRESS_H

#include <stdbool.h>

struct progress {
    const char *what; /* "rendering" */
    const char *unit; /* "Msamples": what one million of `done` is called; NULL: no rate */
    bool quiet;
    bool terminal;
    double start, last; /* seconds */
};

/* Seconds of a monotonic clock. */
double progress_seconds(void);

void progress_start(struct progress *p, const char *what, const char *unit, bool quiet);
/* Call as often as you like; prints at most 5 times a second (terminal) or every 10 s (log). */
void progress_update(struct progress *p, double done, double total);
/* Clears the bar, or closes the log's line with the total time. */
void progress_end(struct progress *p, double total);

#endif
