/* The verdict table: one list of columns for the terminal, Markdown, a page and CSV. */
#ifndef ASSAY_RESULTS_TABLE_H
#define ASSAY_RESULTS_TABLE_H

#include "results.h"

/* How a cell shows the claim's member `key`. */
enum column_kind {
    COLUMN_VERDICT,
    COLUMN_TEXT,
    COLUMN_SCENE,
    COLUMN_TESTED,
    COLUMN_REFERENCE,
    COLUMN_MARK, /* did it come out as expected? */
    /* Only for claims that could be judged: */
    COLUMN_PLOT,       /* the interval beside the margin */
    COLUMN_DIFFERENCE, /* a fraction, as signed per cent; in text followed by the interval "ci" */
    COLUMN_INTERVAL,   /* of fractions, as per cent */
    COLUMN_PERCENT,    /* a fraction, as per cent */
    COLUMN_SECONDS,
    COLUMN_NUMBER
};

struct column {
    const char *key;
    enum column_kind kind;
    /* Headings: text in terminal and Markdown, page, csv (an interval has two names); NULL: the column is not shown
     * there. */
    const char *text, *page, *csv;
    const char *help; /* explanation on the page, HTML; NULL: none */
};
extern const struct column results_columns[];
extern const size_t results_num_columns;

/* Does the column hold numbers, which are right-aligned? */
bool column_is_number(const struct column *c);

/* Scene, engines, difference with interval, MDB, margin and verdict of every claim, then a line for each that could
 * not be judged; then what there is of stated errors and of noise; as aligned text or as Markdown. */
void results_table_print(FILE *f, const json_t *results, bool markdown);

#endif
