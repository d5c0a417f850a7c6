/* The table of claims: what each said, in a row that leads to its evidence, and the same as CSV. */
#ifndef ASSAY_REPORT_TABLE_H
#define ASSAY_REPORT_TABLE_H

#include "report_internal.h"

/* <section id="table"> of num claims in the order given; table#claims is what page_table.js finds and sorts. */
void report_table(FILE *f, const struct claim_ref *claim, size_t num, bool folded);

#endif
