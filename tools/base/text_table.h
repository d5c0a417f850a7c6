/* Tables of text: aligned, for a terminal, or as Markdown. */
#ifndef ASSAY_TEXT_TABLE_H
#define ASSAY_TEXT_TABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

enum { TEXT_TABLE_COLUMNS = 32, TEXT_TABLE_CELL = 320 };

struct text_column {
    const char *heading;
    bool is_number;  /* right-aligned */
    bool is_foreign; /* untrusted text: Markdown's markup is escaped */
};

struct text_table {
    const struct text_column *column;
    size_t num_columns, num_rows; /* columns: TEXT_TABLE_COLUMNS at most */
    /* The text of a cell: borrowed, or in `buffer`. */
    const char *(*cell)(const void *of, size_t row, size_t column, bool markdown,
                        char buffer[TEXT_TABLE_CELL]);
    const void *of;
};
void text_table_print(FILE *f, const struct text_table *t, bool markdown);

/* Columns that UTF-8 text fills, taking each code point as one column wide. */
size_t text_table_width(const char *text);

/* Prints text with whatever would end a cell or start markup escaped. */
void text_table_escape(FILE *f, const char *text);

#endif
