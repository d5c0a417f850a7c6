#include "calibrate_check.h"

#include "tests/support/rates.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const double check_tail = 0.0005;

static void add(struct checks *c, bool holds, const char *fmt, va_list args)
{
    assert(c->num < MAX_CHECKS);
    struct check *item = &c->item[c->num++];
    vsnprintf(item->what, sizeof item->what, fmt, args);
    item->holds = holds;
    c->failed += !holds;
}

static void add_rate(struct checks *c, bool holds, double k, double n, const char *fmt,
                     va_list args)
{
    add(c, holds, fmt, args);
    char *what = c->item[c->num - 1].what;
    size_t length = strlen(what);
    snprintf(what + length, sizeof c->item->what - length, ": %.0f of %.0f", k, n);
}

#define RATE_CHECK(name, condition)                                                                \
    void name(struct checks *c, double k, double n, double rate, const char *fmt, ...)             \
    {                                                                                              \
        va_list args;                                                                              \
        va_start(args, fmt);                                                                       \
        add_rate(c, condition, k, n, fmt, args);                                                   \
        va_end(args);                                                                              \
    }
RATE_CHECK(check_at_most, rate_lower(k, n, check_tail) <= rate)
RATE_CHECK(check_at_least, rate_upper(k, n, check_tail) >= rate)
RATE_CHECK(check_proves_at_most, rate_upper(k, n, check_tail) <= rate)
RATE_CHECK(check_proves_at_least, rate_lower(k, n, check_tail) >= rate)

void check_that(struct checks *c, bool holds, const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    add(c, holds, fmt, args);
    va_end(args);
}

const char *checks_word(const struct checks *c, int from)
{
    for (int i = from; i < c->num; i++)
        if (!c->item[i].holds)
            return "**does not hold**";
    return "holds";
}
