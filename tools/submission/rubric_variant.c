#define _GNU_SOURCE
#include "rubric_variant.h"

#include "renderer/base/fs.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

/* 0: there is none yet. */
static bool read_drawn(const char *path, int *variant, struct err *e)
{
    *variant = 0;
    FILE *f = fs_open(path);
    if (f == NULL)
        return errno == ENOENT || err_set(e, "%s: cannot read: %s", path, strerror(errno));
    bool ok = fscanf(f, "%9d", variant) == 1 && *variant > 0;
    fclose(f);
    return ok || err_set(e, "%s: not the number of a variant", path);
}

/* By link(): of several processes that draw at once, one wins. */
static bool write_drawn(const char *path, int variant, struct err *e)
{
    char text[16];
    const struct path temp = fs_path("%s.%ld", path, (long)getpid());
    int n = snprintf(text, sizeof text, "%d\n", variant);
    int fd = open(temp.s, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    bool ok = fd >= 0 && write(fd, text, (size_t)n) == n;
    if (fd >= 0 && close(fd) != 0)
        ok = false;
    ok = ok && (link(temp.s, path) == 0 || errno == EEXIST);
    int error = errno;
    unlink(temp.s);
    return ok || err_set(e, "%s: cannot write: %s", path, strerror(error));
}

bool rubric_variant_draw(const char *references, const struct rubric *r, int asked, int *variant,
                         struct err *e)
{
    const struct path path = fs_path("%s/variant", references);
    uint32_t random;
    *variant = 0;
    if (r->variants == 0)
        return asked == 0 || err_set(e, "%s has no variants", r->path);
    if (asked > r->variants)
        return err_set(e, "%s has no variant %d", r->path, asked);
    if (!fs_make_dirs(references, e) || !read_drawn(path.s, variant, e))
        return false;
    if (*variant == 0) {
        if (getrandom(&random, sizeof random, 0) != sizeof random)
            return err_set(e, "cannot draw a variant: %s", strerror(errno));
        if (!write_drawn(path.s, asked > 0 ? asked : 1 + (int)(random % (uint32_t)r->variants),
                         e) ||
            !read_drawn(path.s, variant, e))
            return false;
    }
    if (*variant > r->variants)
        return err_set(e, "%s: variant %d was drawn, and %s has %d", path.s, *variant, r->path,
                       r->variants);
    return asked == 0 || asked == *variant ||
           err_set(e, "%s: variant %d was drawn, not %d (other references: --references)", path.s,
                   *variant, asked);
}

bool rubric_variant_read(const char *references, const struct suite *suite, int asked,
                         struct rubric *r, struct rubric_mistakes *m, struct err *e)
{
    char path[sizeof r->path];
    int variant;
    if (!rubric_variant_draw(references, r, asked, &variant, e))
        return false;
    snprintf(path, sizeof path, "%s", r->path);
    return variant == r->variant || rubric_read(path, suite, variant, r, m, e);
}
