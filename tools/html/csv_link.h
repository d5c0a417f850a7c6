/* A figure's numbers as a CSV file (RFC 4180) inside the page: a link that saves it, no network needed. */
#ifndef ASSAY_CSV_LINK_H
#define ASSAY_CSV_LINK_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

struct csv {
    FILE *f;
    bool in_line; /* a field of the line is written */
};

/* "<a download=name ..>" up to its data; `name` and `header` are ours: letters, digits, "._-," only. */
struct csv csv_link_open(FILE *f, const char *name, const char *header);
/* Fields of a line in their order, then its end. Text is quoted; where a spreadsheet would take it for a
 * formula it gets an apostrophe before it. What is not finite is an empty field. */
void csv_link_text(struct csv *c, const char *s);
/* The number that is the member `name`, or an empty field. */
void csv_link_member(struct csv *c, const json_t *object, const char *name);
/* The two numbers of the member `name`, or two empty fields. */
void csv_link_interval(struct csv *c, const json_t *object, const char *name);
void csv_link_line(struct csv *c);
/* A whole line, by a letter for each: t a text, n a double, m and i an object and a name, as above. */
void csv_link_row(struct csv *c, const char *letters, ...);
/* The link's text: "CSV". */
void csv_link_close(struct csv *c);

#endif
