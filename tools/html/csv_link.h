/* A figure's numbers as a CSV file (RFC 4180) inside the page: a link that saves it, no network needed. */
#ifndef ASSAY_CSV_LINK_H
#define ASSAY_CSV_LINK_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

struct csv {
    FILE *f;
    bool in_line; /* the current line has a field */
};

/* Writes "<a download=name ..>" up to its data. name and header are not escaped: letters, digits, "._-," only. */
struct csv csv_link_open(FILE *f, const char *name, const char *header);
/* Write a field each; csv_link_line() ends the line. Text is quoted, and gets an apostrophe in front where a
 * spreadsheet would take it for a formula. A number that is not finite becomes an empty field. */
void csv_link_text(struct csv *c, const char *s);
/* The number that is the member `name`, or an empty field. */
void csv_link_member(struct csv *c, const json_t *object, const char *name);
/* The two numbers of the member `name`, or two empty fields. */
void csv_link_interval(struct csv *c, const json_t *object, const char *name);
void csv_link_line(struct csv *c);
/* A whole line, a letter for each value: t text, n double, m member, i interval (m, i: object and name, as above). */
void csv_link_row(struct csv *c, const char *letters, ...);
/* The link's text: "CSV". */
void csv_link_close(struct csv *c);

#endif
