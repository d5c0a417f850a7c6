#include "reproduce_bytes.h"

#include "../renderer/fs.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

const char *base_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

void beside_file(const char *path, const char *name, char *out, size_t size)
{
    snprintf(out, size, "%.*s%s", (int)(base_of(path) - path), path, name);
}

static bool compare(FILE *a, FILE *b, struct reproduced *out)
{
    out->is_text = true;
    long line = 1, place = 1;
    for (int x, y; (x = getc(a), y = getc(b), x != EOF || y != EOF); place++) {
        out->num_values++;
        if (x != y && out->num_different++ == 0)
            snprintf(out->first, sizeof out->first, "at line %ld, byte %ld of it%s", line, place,
                     x == EOF   ? ": there it ends"
                     : y == EOF ? ": now it ends"
                                : "");
        if (x == '\n') {
            line++;
            place = 0;
        }
    }
    return !ferror(a) && !ferror(b);
}

bool reproduce_bytes(const char *path, const char *again, struct reproduced *out, struct err *e)
{
    FILE *a = fopen(path, "rb"), *b = a != NULL ? fopen(again, "rb") : NULL;
    bool ok = b != NULL ? compare(a, b, out) : false;
    if (!ok)
        err_set(e, "%s: cannot read: %s", a != NULL && b == NULL ? again : path, strerror(errno));
    if (a != NULL)
        fclose(a);
    if (b != NULL)
        fclose(b);
    return ok;
}

bool reproduce_keep(const char *from, const struct reproduce_options *opt, struct err *e)
{
    struct out_file o;
    if (opt->keep == NULL)
        return true;
    FILE *f = fopen(from, "rb");
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", from, strerror(errno));
    bool ok = out_open(&o, opt->keep, e);
    if (ok) {
        for (int c; (c = getc(f)) != EOF;)
            putc(c, o.f);
        ok = out_commit(&o, e);
    }
    fclose(f);
    return ok;
}
