#include "checkpoint.h"

#include "renderer/base/fs.h"
#include "renderer/base/version.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <nettle/sha2.h>
#include <stdlib.h>
#include <string.h>

enum { NUM_LINES = 9, LINE = 600, MAX_ARRAYS = 8 };

/* The head of the file: a line for each thing that must match. */
static void head_lines(char line[NUM_LINES][LINE], const struct render_id *id, bool first_hits)
{
    snprintf(line[0], LINE, "assay state 1\n");
    snprintf(line[1], LINE, "version %s\n", assay_version);
    snprintf(line[2], LINE, "scene %s\n", id->scene);
    snprintf(line[3], LINE, "settings %s\n", id->settings);
    snprintf(line[4], LINE, "adaptive %s\n", id->adaptive);
    snprintf(line[5], LINE, "seed %s\n", id->seed);
    snprintf(line[6], LINE, "cell %s\n", id->cell);
    snprintf(line[7], LINE, "first sample %lu\n", (unsigned long)id->first_sample);
    snprintf(line[8], LINE, "aov %s\n", first_hits ? "on" : "off");
}

struct array {
    void *data;
    size_t each; /* bytes of a pixel */
};

/* The arrays of the body, which follow num_samples and a flag for the target, both uint32_t. Returns how many. */
static int body_arrays(struct array a[MAX_ARRAYS], const struct film *f)
{
    int n = 0;
    a[n++] = (struct array){f->m.n, sizeof(double)};
    a[n++] = (struct array){f->m.mean, 3 * sizeof(double)};
    a[n++] = (struct array){f->m.m2, 3 * sizeof(double)};
    a[n++] = (struct array){f->m.m3, 3 * sizeof(double)};
    a[n++] = (struct array){f->s1, sizeof(double)};
    a[n++] = (struct array){f->s2, sizeof(double)};
    if (f->first != NULL)
        a[n++] = (struct array){f->first, sizeof *f->first};
    if (f->target != NULL)
        a[n++] = (struct array){f->target, sizeof *f->target};
    return n;
}

static void put(FILE *f, struct sha256_ctx *ctx, const void *data, size_t size)
{
    sha256_update(ctx, size, data);
    fwrite(data, 1, size, f); /* out_commit() looks at the error flag */
}

bool checkpoint_write(const char *path, const struct render_id *id, const struct film *f,
                      struct err *e)
{
    struct out_file out;
    struct sha256_ctx ctx;
    char line[NUM_LINES][LINE];
    struct array a[MAX_ARRAYS];
    if (!out_open(&out, path, e))
        return false;
    sha256_init(&ctx);
    head_lines(line, id, f->first != NULL);
    for (int i = 0; i < NUM_LINES; i++)
        put(out.f, &ctx, line[i], strlen(line[i]));
    const uint32_t counts[2] = {f->num_samples, f->target != NULL};
    put(out.f, &ctx, counts, sizeof counts);
    int n = body_arrays(a, f);
    size_t pixels = (size_t)f->m.width * (size_t)f->m.height;
    for (int i = 0; i < n; i++)
        put(out.f, &ctx, a[i].data, a[i].each * pixels);
    uint8_t digest[SHA256_DIGEST_SIZE];
    sha256_digest(&ctx, sizeof digest, digest);
    fwrite(digest, 1, sizeof digest, out.f);
    return out_commit(&out, e);
}

static bool get(FILE *f, struct sha256_ctx *ctx, void *data, size_t size)
{
    if (fread(data, 1, size, f) != size)
        return false;
    sha256_update(ctx, size, data);
    return true;
}

static bool check_head(FILE *f, struct sha256_ctx *ctx, const char *path,
                       const struct render_id *id, bool first_hits, struct err *e)
{
    char line[NUM_LINES][LINE], got[LINE];
    head_lines(line, id, first_hits);
    for (int i = 0; i < NUM_LINES; i++) {
        size_t n = 0;
        for (int c; n + 1 < sizeof got && (c = getc(f)) != EOF;) {
            got[n++] = (char)c;
            if (c == '\n')
                break;
        }
        got[n] = '\0';
        sha256_update(ctx, n, (const uint8_t *)got);
        if (strcmp(got, line[i]) == 0)
            continue;
        if (i == 0 || n == 0 || got[n - 1] != '\n')
            return err_set(e, "%s: not a state file of this program", path);
        got[n - 1] = '\0';
        return err_set(e, "%s: of another render: '%s' there, '%.*s' here", path, got,
                       (int)strlen(line[i]) - 1, line[i]);
    }
    return true;
}

/* Reads what follows the head: true if its length is right and it ends with its hash. */
static bool check_body(const struct checkpoint *s, struct sha256_ctx *ctx, uint32_t counts[2])
{
    uint8_t block[1 << 16], digest[SHA256_DIGEST_SIZE], stored[SHA256_DIGEST_SIZE];
    struct film shape = {0};
    struct array a[MAX_ARRAYS];
    size_t left = 0;
    if (!get(s->f, ctx, counts, 2 * sizeof *counts) || counts[1] > 1)
        return false;
    /* body_arrays() only checks whether these are NULL. */
    struct first_hit_sums some = {0};
    shape.first = s->first_hits ? &some : NULL;
    shape.target = counts[1] == 1 ? counts : NULL;
    for (int n = body_arrays(a, &shape), i = 0; i < n; i++)
        left += a[i].each * (size_t)s->width * (size_t)s->height;
    while (left > 0) {
        size_t n = left < sizeof block ? left : sizeof block;
        if (!get(s->f, ctx, block, n))
            return false;
        left -= n;
    }
    sha256_digest(ctx, sizeof digest, digest);
    return fread(stored, 1, sizeof stored, s->f) == sizeof stored && getc(s->f) == EOF &&
           memcmp(digest, stored, sizeof digest) == 0;
}

bool checkpoint_open(struct checkpoint *s, const char *path, const struct render_id *id, int width,
                     int height, bool first_hits, struct err *e)
{
    struct sha256_ctx ctx;
    uint32_t counts[2];
    *s = (struct checkpoint){.width = width, .height = height, .first_hits = first_hits};
    if (strlen(path) >= sizeof s->path)
        return err_set(e, "%.64s...: path too long", path);
    strcpy(s->path, path);
    s->f = fs_open(path);
    if (s->f == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    sha256_init(&ctx);
    bool ok = check_head(s->f, &ctx, path, id, first_hits, e);
    s->body = ok ? ftell(s->f) + (long)sizeof counts : 0;
    if (ok && !check_body(s, &ctx, counts))
        ok = err_set(e, "%s: damaged or cut short", path);
    if (!ok) {
        checkpoint_close(s);
        return false;
    }
    s->num_samples = counts[0];
    s->has_target = counts[1] == 1;
    return true;
}

void checkpoint_close(struct checkpoint *s)
{
    if (s->f != NULL)
        fclose(s->f);
    s->f = NULL;
}

/* Checks the counts, on which later code relies; the hash vouches for the sums. */
static bool counts_are_sane(const double *n, int num, uint32_t most)
{
    for (int i = 0; i < num; i++)
        if (!(n[i] >= 0 && n[i] <= most && n[i] == floor(n[i])))
            return false;
    return true;
}

bool checkpoint_rows(struct checkpoint *s, int y, int num, struct film *f, int at_x, int at_y,
                     struct err *e)
{
    struct array a[MAX_ARRAYS];
    size_t width = (size_t)s->width, before = 0;
    int n = body_arrays(a, f);
    assert(at_x + s->width <= f->m.width && at_y + num <= f->m.height && y + num <= s->height);
    assert((f->first != NULL) == s->first_hits && (f->target == NULL || s->has_target));
    if (s->f == NULL && (s->f = fs_open(s->path)) == NULL)
        return err_set(e, "%s: cannot read: %s", s->path, strerror(errno));
    for (int i = 0; i < n; i++) {
        long at = s->body + (long)(before + a[i].each * width * (size_t)y);
        if (fseek(s->f, at, SEEK_SET) != 0)
            return err_set(e, "%s: cannot read: %s", s->path, strerror(errno));
        for (int row = 0; row < num; row++) {
            size_t to = (size_t)(at_y + row) * (size_t)f->m.width + (size_t)at_x;
            if (fread((char *)a[i].data + a[i].each * to, a[i].each, width, s->f) != width ||
                (i == 0 && !counts_are_sane(f->m.n + to, s->width, s->num_samples)))
                return err_set(e, "%s: damaged or cut short", s->path);
        }
        before += a[i].each * width * (size_t)s->height;
    }
    return true;
}

bool checkpoint_read(const char *path, const struct render_id *id, struct film *film, struct err *e)
{
    struct checkpoint s;
    int width = film->m.width, height = film->m.height;
    if (!checkpoint_open(&s, path, id, width, height, film->first != NULL, e))
        return false;
    bool ok = true;
    if (s.has_target) {
        film->target = calloc((size_t)width * (size_t)height, sizeof *film->target);
        ok = film->target != NULL || err_set(e, "%s: out of memory", path);
    }
    ok = ok && checkpoint_rows(&s, 0, height, film, 0, 0, e);
    if (ok)
        film->num_samples = s.num_samples;
    checkpoint_close(&s);
    return ok;
}
