/* The pages' pieces of HTML: escaped text, numbers, tables, base64. What
 * cannot be written shows in ferror() of the stream, which out_commit() asks. */
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
/* The same as text that may go on in another line behind each underscore. */
void html_name(FILE *f, const char *s);

/* As fprintf(), but that the text of each %s is escaped (NULL is ""). Markup stands in the format; only
 * floating-point numbers may have flags, width or precision. */
void html_print(FILE *f, const char *format, ...) __attribute__((format(printf, 2, 3)));
void html_vprint(FILE *f, const char *format, va_list values);

/* 0.0123 -> "+1.230": always three decimals and no percent sign, for a column. The minus sign is
 * U+2212. What rounds to zero has no sign. */
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

/* 0.0123, or 10 to the power of what is smaller, or "below 10 to the -12". */
void html_p_value(FILE *f, double log10_p);

void html_base64(FILE *f, const void *bytes, size_t size);

/* Up to <main>, with the style sheet of all pages and a policy that lets nothing in from elsewhere. `script`: the only
 * one that may run, or NULL; refresh_s: seconds after which the page loads itself again, or 0. */
void html_page_open(FILE *f, const char *title, const char *script, double refresh_s);
void html_page_close(FILE *f);

/* A table that scrolls by itself where it is too wide, up to <tbody>. id may be NULL. label says to those who do not
 * see it what it is; headings are divided by '|', that of a column of numbers begins with '>'; they are ours. */
void html_table_open(FILE *f, const char *id, const char *label, const char *headings);
void html_table_close(FILE *f);
/* The row's head, a red row if `bad`. */
void html_row_open(FILE *f, bool bad, const char *head);

#endif
