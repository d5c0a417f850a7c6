#include "reproduce_internal.h"

#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"
#include "renderer/base/shell_quote.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool reproduced_command(struct reproduced *out, const char *const *word, struct err *e)
{
    free(out->command);
    out->command = shell_quote_join(NULL, word);
    return out->command != NULL || err_set(e, "out of memory");
}

bool reproduce_input(const char *path, const char *what, const char *file, const char *then,
                     const char *otherwise, struct err *e)
{
    char now[65];
    if (access(file, R_OK) != 0)
        return err_set(e, "%s: its %s '%s' is not here: %sgo where it was made", path, what, file,
                       otherwise);
    return sha256_file(file, now, e) &&
           (strcmp(now, then) == 0 ||
            err_set(e,
                    "%s: %s is not the file that it was made of (SHA-256 %.12s... then, %.12s... "
                    "now)",
                    path, file, then, now));
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
