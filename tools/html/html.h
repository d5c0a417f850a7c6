/* The report's pieces of HTML: escaped text, numbers, base64. What
 * cannot be written shows in ferror() of the stream, which out_commit() asks. */
#ifndef ASSAY_HTML_H
#define ASSAY_HTML_H

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

void html_base64(FILE *f, const void *bytes, size_t size);

/* "sha256-<base64>" of a script's text, as a Content-Security-Policy wants it. */
struct number_text html_script_hash(const char *script);

#endif
