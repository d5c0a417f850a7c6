#include "number.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static bool is_end(char c)
{
    return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\0';
}

/* Digits up to 2^53 and a power of ten up to 10^22 are exact as doubles, so one multiplication or division
 * rounds correctly: W. D. Clinger, How to read floating point numbers accurately, PLDI 1990. The numbers of
 * meshes are nearly all that short, and strtod() takes five times as long. False: longer, or not a number. */
static bool parse_short(const char *s, const char **end, double *out)
{
    static const double power[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                   1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                   1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    const bool minus = *s == '-';
    uint64_t digits = 0;
    int num = 0, exponent = 0;
    s += *s == '-' || *s == '+';
    for (; is_digit(*s); s++, num++)
        digits = 10 * digits + (uint64_t)(*s - '0');
    if (*s == '.')
        for (s++; is_digit(*s); s++, num++, exponent--)
            digits = 10 * digits + (uint64_t)(*s - '0');
    if (*s == 'e' || *s == 'E') {
        bool down = s[1] == '-';
        int e = 0, n = 0;
        s += s[1] == '-' || s[1] == '+' ? 2 : 1;
        for (; is_digit(*s) && n < 4; s++, n++)
            e = 10 * e + (*s - '0');
        if (n == 0)
            return false;
        exponent += down ? -e : e;
    }
    if (num == 0 || num > 19 || digits > (uint64_t)1 << 53 || exponent < -22 || exponent > 22 ||
        !is_end(*s))
        return false;
    double v = (double)digits;
    v = exponent < 0 ? v / power[-exponent] : v * power[exponent];
    *out = minus ? -v : v;
    *end = s;
    return true;
}

bool number_parse(const char *s, const char **end, double *out)
{
    if (parse_short(s, end, out))
        return true;
    size_t length = strspn(s, "0123456789+-.eE");
    if (length == 0 || !is_end(s[length]))
        return false;
    char *stop;
    *out = strtod(s, &stop);
    *end = stop;
    return stop == s + length && isfinite(*out);
}
