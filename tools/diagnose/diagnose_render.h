/* Renders what a diagnosis looks at: a view of the catalogue, by any program with our command line. */
#ifndef ASSAY_DIAGNOSE_RENDER_H
#define ASSAY_DIAGNOSE_RENDER_H

#include "catalogue.h"

struct diagnose_job {
    const char *program;
    const struct suite_scene *scene;
    const struct suite_variant *variant; /* NULL: none */
    const char *const *options;          /* instead of the variant's, NULL at the end; NULL: none */
    int columns;                         /* of cells (signature.h) */
    int width, height, spp;
    int renders;   /* averaged; with 4 or more FACT_PIXELS and FACT_IMAGE are set */
    uint64_t seed; /* of the first; the others follow from it */
    int threads;
    double timeout_s;
    const char *work_dir; /* for images, which are removed; exists */
};

/* consistent (may be NULL): false if a claim of consistency (stated_error.h) comes out DIFFERENT at `alpha`. */
NODISCARD bool diagnose_render(const struct diagnose_job *job, double alpha, struct signature *out,
                               bool *consistent, struct err *e);

#endif
