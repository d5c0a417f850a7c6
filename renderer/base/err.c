#include "err.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

void err_hide_controls(char *text)
{
    for (char *c = text; *c != '\0'; c++)
        if ((unsigned char)*c < ' ' || *c == 127)
            *c = '?';
}

bool err_is_of_memory(const struct err *e)
{
    static const char *const says[] = {"out of memory", "Cannot allocate memory",
                                       "Unable to allocate"};
    for (size_t i = 0; i < sizeof says / sizeof says[0]; i++)
        if (strstr(e->msg, says[i]) != NULL)
            return true;
    return false;
}

bool(err_set)(struct err *e, const char *fmt, ...)
{
    if (e == NULL)
        return false;
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(e->msg, sizeof e->msg, fmt, ap);
    va_end(ap);
    err_hide_controls(e->msg);
    return false;
}

bool(err_prefix)(struct err *e, const char *fmt, ...)
{
    if (e == NULL)
        return false;
    char old[sizeof e->msg];
    memcpy(old, e->msg, sizeof old);
    va_list ap;
    va_start(ap, fmt);
    int n = vsnprintf(e->msg, sizeof e->msg, fmt, ap);
    va_end(ap);
    err_hide_controls(e->msg);
    if (n < 0 || (size_t)n + 2 >= sizeof e->msg)
        return false;
    memcpy(e->msg + n, ": ", 2);
    size_t room = sizeof e->msg - (size_t)n - 3, length = strlen(old);
    length = length < room ? length : room;
    memcpy(e->msg + n + 2, old, length);
    e->msg[(size_t)n + 2 + length] = '\0';
    return false;
}
