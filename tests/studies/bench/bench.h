/* `make bench`: what each part of it measures, and what all are told. Every figure is a ratio of CPU times
 * taken one right after the other in this process or in child processes, the median over rounds; before any
 * ratio what both found is checked to be the same. */
#ifndef ASSAY_BENCH_H
#define ASSAY_BENCH_H

#include "renderer/base/isa.h"

#include <jansson.h>

enum { BENCH_MAX_ROUNDS = 99 };

struct bench_options {
    enum isa isa;
    int rounds;
    bool help;
    bool smoke; /* one tiny case of each part, to see that all of it runs; figures mean nothing */
    const char *build;                /* where pathtracer is */
    const char *out;                  /* directory of results.json; exists */
    const char *only[16], *parts[16]; /* names of scenes and of parts; none: all */
    int num_only, num_parts;
};

/* True if the scene was asked for. */
bool bench_wanted(const struct bench_options *o, const char *scene);

/* Each prints its table and returns the table's data, a new reference. *wrong: results differ; this is printed too,
 * and nothing is then timed. If it cannot measure: NULL and a line in *e. */
json_t *bench_rays(const struct bench_options *o, bool *wrong, struct err *e);
json_t *bench_paths(const struct bench_options *o, bool *wrong, struct err *e);
json_t *bench_jobs(const struct bench_options *o, bool *wrong, struct err *e);
json_t *bench_scaling(const struct bench_options *o, bool *wrong, struct err *e);

#endif
