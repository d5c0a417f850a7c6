#include "csv_link.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <string.h>

struct csv csv_link_open(FILE *f, const char *name, const char *header)
{
    fprintf(f,
            "<a class=\"csv\" download=\"%s\" aria-label=\"%s\" "
            "href=\"data:text/csv;charset=utf-8,%s%%0D%%0A",
            name, name, header);
    return (struct csv){.f = f};
}

static void separate(struct csv *c)
{
    if (c->in_line)
        fputc(',', c->f);
    c->in_line = true;
}

void csv_link_text(struct csv *c, const char *s)
{
    separate(c);
    fputs("%22", c->f);
    if (s != NULL && *s != '\0' && strchr("=+-@\t\r", *s) != NULL)
        fputs("%27", c->f);
    for (; s != NULL && *s != '\0'; s++) {
        unsigned char byte = (unsigned char)*s;
        if (byte == '"')
            fputs("%22%22", c->f);
        else if (isalnum(byte) || strchr("._-", byte) != NULL)
            fputc(byte, c->f);
        else
            fprintf(c->f, "%%%02X", byte);
    }
    fputs("%22", c->f);
}

static void write_number(struct csv *c, double v)
{
    separate(c);
    if (isfinite(v))
        fprintf(c->f, "%.6g", v);
}

void csv_link_member(struct csv *c, const json_t *object, const char *name)
{
    const json_t *v = json_object_get(object, name);
    write_number(c, json_is_number(v) ? json_number_value(v) : NAN);
}

void csv_link_interval(struct csv *c, const json_t *object, const char *name)
{
    const json_t *ends = json_object_get(object, name);
    for (size_t n = 0; n < 2; n++)
        write_number(c,
                     json_array_size(ends) == 2 ? json_number_value(json_array_get(ends, n)) : NAN);
}

void csv_link_line(struct csv *c)
{
    fputs("%0D%0A", c->f);
    c->in_line = false;
}

void csv_link_row(struct csv *c, const char *letters, ...)
{
    va_list values;
    va_start(values, letters);
    for (; *letters != '\0'; letters++) {
        if (*letters == 't') {
            csv_link_text(c, va_arg(values, const char *));
        } else if (*letters == 'n') {
            write_number(c, va_arg(values, double));
        } else {
            const json_t *object = va_arg(values, const json_t *);
            (*letters == 'm' ? csv_link_member : csv_link_interval)(c, object,
                                                                    va_arg(values, const char *));
        }
    }
    va_end(values);
    csv_link_line(c);
}

void csv_link_close(struct csv *c)
{
    fputs("\">CSV</a>", c->f);
}
