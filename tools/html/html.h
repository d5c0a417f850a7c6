/* Building blocks of HTML pages: escaped text, numbers, tables, base64. A failed write
 * shows in ferror() of the stream, which out_commit() checks. */
#ifndef ASSAY_HTML_H
#define ASSAY_HTML_H

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>

/* A short formatted number, returned by value so that it can stand in a fprintf call. */
struct number_text {
    char s[64];
};

/* Text or attribute value: < > & " ' escaped, control characters replaced by a space. NULL is "".
 */
void html_text(FILE *f, const char *s);
/* The same, with a possible line break (<wbr>) after each underscore. */
void html_name(FILE *f, const char *s);

/* As fprintf(), but the text of each %s is escaped (NULL is ""). Markup belongs in the format; flags, width and
 * precision are allowed for floating-point numbers only. */
void html_print(FILE *f, const char *format, ...) __attribute__((format(printf, 2, 3)));
void html_vprint(FILE *f, const char *format, va_list values);

/* 0.0123 -> "+1.230": per cent with three decimals (from 1e4 on three digits) and no percent sign, for a
 * column. The minus sign is U+2212. What rounds to zero has no sign. */
struct number_text html_percent_column(double fraction);
/* 0.0123 -> "+1.23 %": three digits and a no-break space. */
struct number_text html_percent_prose(double fraction);
/* 0.0123 -> "1.23 %". */
struct number_text html_percent_plain(double fraction);
/* Three significant digits with U+2212. */
struct number_text html_number(double v);
/* "0.5 s", "12 s", "3 min 5 s", "2 h 3 min". */
struct number_text html_duration(double seconds);

/* "2026-11-23T04:42:12Z" as "2026-11-23 05:42 CET", in the time zone of this machine; any other text as it stands. */
struct number_text html_date(const char *utc);

/* Writes p as 0.0123, from 1e-4 down as a power of ten, from 1e-12 down as "below 10^-12". */
void html_p_value(FILE *f, double log10_p);

void html_base64(FILE *f, const void *bytes, size_t size);

/* Writes a page up to <main>, with the common style sheet and a Content-Security-Policy that loads nothing from
 * elsewhere. script: the only one that the policy lets run, or NULL; refresh_s: seconds until the page reloads
 * itself, or 0. */
void html_page_open(FILE *f, const char *title, const char *script, double refresh_s);
void html_page_close(FILE *f);

/* Opens a table, up to <tbody>, that scrolls on its own where it is too wide. id may be NULL. label: its name for
 * screen readers. headings: separated by '|', with '>' in front of a column of numbers; not escaped. */
void html_table_open(FILE *f, const char *id, const char *label, const char *headings);
void html_table_close(FILE *f);
/* Opens a row with its heading cell; bad: the row is red. */
void html_row_open(FILE *f, bool bad, const char *head);

#endif
