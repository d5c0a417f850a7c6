#include "html.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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

struct number_text html_script_hash(const char *script)
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
