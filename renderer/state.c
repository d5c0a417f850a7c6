#include "state.h"

#include "fs.h"
#include "version.h"

#include <errno.h>
#include <nettle/sha2.h>
#include <stdlib.h>
#include <string.h>

enum { NUM_LINES = 9, LINE = 600, MAX_ARRAYS = 8 };

/* The head: what has to be the same, a line each. */
static void head_lines(char line[NUM_LINES][LINE], const struct identity *id, const struct film *f)
{
    snprintf(line[0], LINE, "assay state 1\n");
    snprintf(line[1], LINE, "version %s\n", assay_version);
    snprintf(line[2], LINE, "scene %s\n", id->scene);
    snprintf(line[3], LINE, "settings %s\n", id->settings);
    snprintf(line[4], LINE, "adaptive %s\n", id->adaptive);
    snprintf(line[5], LINE, "seed %s\n", id->seed);
    snprintf(line[6], LINE, "cell %s\n", id->cell);
    snprintf(line[7], LINE, "first sample %lu\n", (unsigned long)id->first_sample);
    snprintf(line[8], LINE, "aov %s\n", f->first != NULL ? "on" : "off");
}

struct array {
    void *data;
    size_t size;
};

/* The body, after num_samples and whether there is a target, both uint32_t. */
static int body_arrays(struct array a[MAX_ARRAYS], const struct film *f)
{
    size_t pixels = (size_t)f->m.width * (size_t)f->m.height;
    int n = 0;
    a[n++] = (struct array){f->m.n, pixels * sizeof(double)};
    a[n++] = (struct array){f->m.mean, 3 * pixels * sizeof(double)};
    a[n++] = (struct array){f->m.m2, 3 * pixels * sizeof(double)};
    a[n++] = (struct array){f->m.m3, 3 * pixels * sizeof(double)};
    a[n++] = (struct array){f->s1, pixels * sizeof(double)};
    a[n++] = (struct array){f->s2, pixels * sizeof(double)};
    if (f->first != NULL)
        a[n++] = (struct array){f->first, pixels * sizeof *f->first};
    if (f->target != NULL)
        a[n++] = (struct array){f->target, pixels * sizeof *f->target};
    return n;
}

static void put(FILE *f, struct sha256_ctx *ctx, const void *data, size_t size)
{
    sha256_update(ctx, size, data);
    fwrite(data, 1, size, f); /* out_commit() looks at the error flag */
}

bool state_write(const char *path, const struct identity *id, const struct film *f, struct err *e)
{
    struct out_file out;
    struct sha256_ctx ctx;
    char line[NUM_LINES][LINE];
    struct array a[MAX_ARRAYS];
    if (!out_open(&out, path, e))
        return false;
    sha256_init(&ctx);
    head_lines(line, id, f);
    for (int i = 0; i < NUM_LINES; i++)
        put(out.f, &ctx, line[i], strlen(line[i]));
    const uint32_t counts[2] = {f->num_samples, f->target != NULL};
    put(out.f, &ctx, counts, sizeof counts);
    int n = body_arrays(a, f);
    for (int i = 0; i < n; i++)
        put(out.f, &ctx, a[i].data, a[i].size);
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

static bool check_head(FILE *f, struct sha256_ctx *ctx, const char *path, const struct identity *id,
                       const struct film *film, struct err *e)
{
    char line[NUM_LINES][LINE], got[LINE];
    head_lines(line, id, film);
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

/* Counts that later code relies on; the sums may be anything that the hash vouches for. */
static bool counts_are_sane(const struct film *f)
{
    size_t pixels = (size_t)f->m.width * (size_t)f->m.height;
    for (size_t p = 0; p < pixels; p++)
        if (!(f->m.n[p] >= 0 && f->m.n[p] <= f->num_samples && f->m.n[p] == floor(f->m.n[p])))
            return false;
    return true;
}

bool state_read(const char *path, const struct identity *id, struct film *film, struct err *e)
{
    struct sha256_ctx ctx;
    struct array a[MAX_ARRAYS];
    uint32_t counts[2];
    uint8_t digest[SHA256_DIGEST_SIZE], stored[SHA256_DIGEST_SIZE];
    size_t pixels = (size_t)film->m.width * (size_t)film->m.height;
    FILE *f = fopen(path, "rb");
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    sha256_init(&ctx);
    bool ok = check_head(f, &ctx, path, id, film, e);
    if (!ok)
        goto done;
    ok = get(f, &ctx, counts, sizeof counts) && counts[1] <= 1;
    film->num_samples = ok ? counts[0] : 0;
    if (ok && counts[1] == 1 && (film->target = calloc(pixels, sizeof *film->target)) == NULL) {
        ok = err_set(e, "%s: out of memory", path);
        goto done;
    }
    int n = body_arrays(a, film);
    for (int i = 0; ok && i < n; i++)
        ok = get(f, &ctx, a[i].data, a[i].size);
    sha256_digest(&ctx, sizeof digest, digest);
    ok = ok && fread(stored, 1, sizeof stored, f) == sizeof stored && getc(f) == EOF &&
         memcmp(digest, stored, sizeof digest) == 0 && counts_are_sane(film);
    if (!ok)
        err_set(e, "%s: damaged or cut short", path);
done:
    fclose(f);
    return ok;
}
