/* results.json and the images beside it -> one HTML file that opens from disk without a network. */
#ifndef ASSAY_REPORT_H
#define ASSAY_REPORT_H

#include "../renderer/err.h"

/* Reads results_path and the files it names, writes out_path (by rename, with its directories). */
bool report_write(const char *results_path, const char *out_path, struct err *e)
    __attribute__((warn_unused_result));

#endif
