#define _GNU_SOURCE
#include "html.h"

#include "page_assets.h"

#include <assert.h>
#include <math.h>
#include <string.h>
#include <time.h>

#include <nettle/base64.h>
#include <nettle/sha2.h>

static void html_byte(FILE *f, unsigned char c)
{
    switch (c) {
    case '<': fputs("&lt;", f); break;
    case '>': fputs("&gt;", f); break;
    case '&': fputs("&amp;", f); break;
    case '"': fputs("&quot;", f); break;
    case '\'': fputs("&#39;", f); break;
    default: fputc((c < 0x20 && c != '\n') || c == 0x7f ? ' ' : c, f);
    }
}

void html_text(FILE *f, const char *s)
{
    for (; s != NULL && *s != '\0'; s++)
        html_byte(f, (unsigned char)*s);
}

void html_name(FILE *f, const char *s)
{
    for (; s != NULL && *s != '\0'; s++) {
        html_byte(f, (unsigned char)*s);
        if (*s == '_')
            fputs("<wbr>", f);
    }
}

void html_vprint(FILE *f, const char *format, va_list values)
{
    va_list next;
    va_copy(next, values);
    while (*format != '\0') {
        size_t plain = strcspn(format, "%");
        fwrite(format, 1, plain, f);
        format += plain;
        if (*format == '\0')
            break;
        char one[24]; /* conversion, specifier included */
        size_t length = 2 + strspn(format + 1, "+-0123456789.zl");
        char type = format[length - 1], size = format[length - 2];
        assert(length < sizeof one && (type != 's' || length == 2));
        snprintf(one, sizeof one, "%.*s", (int)length, format);
        if (type == '%')
            fputc('%', f);
        else if (type == 's')
            html_text(f, va_arg(next, const char *));
        else if (strchr("aefg", type) != NULL)
            fprintf(f, one, va_arg(next, double));
        else
            fprintf(f, "%lld",
                    size == 'z'   ? (long long)va_arg(next, size_t)
                    : size == 'l' ? va_arg(next, long long)
                                  : va_arg(next, int));
        format += length;
    }
    va_end(next);
}

void html_print(FILE *f, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    html_vprint(f, format, values);
    va_end(values);
}

/* `text` with U+2212 for a leading hyphen, or without any sign if all its digits are zero. */
static struct number_text with_sign(const char *text)
{
    struct number_text out;
    const char *digits = text + (*text == '-' || *text == '+');
    const char *sign = *text == '-' ? "−" : *text == '+' ? "+" : "";
    if (strspn(digits, "0.") == strlen(digits))
        sign = "";
    snprintf(out.s, sizeof out.s, "%s%.40s", sign, digits);
    return out;
}

struct number_text html_percent_column(double fraction)
{
    char text[64];
    snprintf(text, sizeof text, fabs(fraction) < 1e4 ? "%+.3f" : "%+.3g", 100 * fraction);
    return with_sign(text);
}

struct number_text html_percent_prose(double fraction)
{
    char text[64];
    snprintf(text, sizeof text, "%+.3g", 100 * fraction);
    struct number_text out = with_sign(text);
    strcat(out.s, "\u00a0%");
    return out;
}

struct number_text html_percent_plain(double fraction)
{
    struct number_text out = html_number(100 * fraction);
    strcat(out.s, "\u00a0%");
    return out;
}

struct number_text html_number(double v)
{
    char text[64];
    snprintf(text, sizeof text, "%.3g", v);
    return with_sign(text);
}

struct number_text html_date(const char *utc)
{
    struct number_text text = {""};
    struct tm t = {0}, local;
    if (utc == NULL)
        return text;
    snprintf(text.s, sizeof text.s, "%s", utc);
    if (strptime(utc, "%Y-%m-%dT%H:%M:%SZ", &t) == NULL)
        return text;
    const time_t when = timegm(&t);
    if (localtime_r(&when, &local) == NULL ||
        strftime(text.s, sizeof text.s, "%Y-%m-%d %H:%M %Z", &local) == 0)
        snprintf(text.s, sizeof text.s, "%s", utc);
    return text;
}

struct number_text html_duration(double seconds)
{
    struct number_text out;
    double minutes = floor(seconds / 60);
    if (seconds < 9.95)
        snprintf(out.s, sizeof out.s, "%.1f s", seconds);
    else if (seconds < 60)
        snprintf(out.s, sizeof out.s, "%.0f s", seconds);
    else if (minutes < 60)
        snprintf(out.s, sizeof out.s, "%.0f min %.0f s", minutes, floor(seconds - 60 * minutes));
    else
        snprintf(out.s, sizeof out.s, "%.0f h %.0f min", floor(minutes / 60), fmod(minutes, 60));
    return out;
}

void html_p_value(FILE *f, double log10_p)
{
    if (log10_p > -4)
        fprintf(f, "%.3g", pow(10, log10_p));
    else if (log10_p > -12)
        fprintf(f, "10<sup>%s</sup>", html_number(log10_p).s);
    else
        fputs("below 10<sup>−12</sup>", f);
}

void html_base64(FILE *f, const void *bytes, size_t size)
{
    const uint8_t *p = bytes;
    enum { CHUNK = 3 * 1024 }; /* a multiple of 3, so that only the last chunk is padded */
    char text[BASE64_ENCODE_RAW_LENGTH(CHUNK)];
    while (size > 0) {
        size_t n = size < CHUNK ? size : CHUNK;
        base64_encode_raw(text, n, p);
        fwrite(text, 1, BASE64_ENCODE_RAW_LENGTH(n), f);
        p += n;
        size -= n;
    }
}

/* "sha256-<base64>" of a script's text, for a Content-Security-Policy. */
static struct number_text script_hash(const char *script)
{
    struct sha256_ctx ctx;
    uint8_t digest[SHA256_DIGEST_SIZE];
    sha256_init(&ctx);
    sha256_update(&ctx, strlen(script), (const uint8_t *)script);
    sha256_digest(&ctx, sizeof digest, digest);
    struct number_text out = {"sha256-"};
    char *end = out.s + strlen(out.s);
    base64_encode_raw(end, sizeof digest, digest);
    end[BASE64_ENCODE_RAW_LENGTH(sizeof digest)] = '\0';
    return out;
}

void html_page_open(FILE *f, const char *title, const char *script, double refresh_s)
{
    fputs(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
        "style-src 'unsafe-inline'",
        f);
    if (script != NULL)
        fprintf(f, "; script-src '%s'", script_hash(script).s);
    fputs("\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
          "<meta name=\"color-scheme\" content=\"light dark\">\n",
          f);
    if (refresh_s > 0) /* browsers read whole seconds */
        fprintf(f, "<meta http-equiv=\"refresh\" content=\"%.0f\">\n", ceil(refresh_s));
    html_print(f, "<title>%s</title>\n<style>\n", title);
    fprintf(f, "%s</style>\n</head>\n<body>\n<main>\n", page_css);
}

void html_page_close(FILE *f)
{
    fputs("</main>\n</body>\n</html>\n", f);
}

void html_table_open(FILE *f, const char *id, const char *label, const char *headings)
{
    html_print(f, "<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"%s\">\n<table",
               label);
    if (id != NULL)
        fprintf(f, " id=\"%s\"", id);
    fputs("><thead><tr>", f);
    while (*headings != '\0') {
        bool number = *headings == '>';
        size_t length = strcspn(headings += number, "|");
        fprintf(f, "<th scope=\"col\"%s>%.*s</th>", number ? " class=\"num\"" : "", (int)length,
                headings);
        headings += length + (headings[length] == '|');
    }
    fputs("</tr></thead>\n<tbody>\n", f);
}

void html_table_close(FILE *f)
{
    fputs("</tbody></table>\n</div>\n", f);
}

void html_row_open(FILE *f, bool bad, const char *head)
{
    fputs(bad ? "<tr class=\"bad\"><th scope=\"row\">" : "<tr><th scope=\"row\">", f);
    html_text(f, head);
    fputs("</th>", f);
}
