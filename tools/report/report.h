/* results.json and the images beside it -> one HTML file that opens from disk without a network. */
#ifndef ASSAY_REPORT_H
#define ASSAY_REPORT_H

#include "renderer/base/err.h"

/* Reads results_path and the files it names, writes out_path (by rename, with its directories). */
NODISCARD bool report_write(const char *results_path, const char *out_path, struct err *e);

/* The same with the "convergence" of another results.json (NULL: none), after the scenes. Fails if that has none,
 * or if both have one. */
NODISCARD bool report_write_with(const char *results_path, const char *converge_path,
                                 const char *out_path, struct err *e);

#endif
