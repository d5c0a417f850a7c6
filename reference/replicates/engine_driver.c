#include "engine_driver.h"

#include "reference/base/utc_date.h"

#include <assert.h>
#include <stdio.h>
#include <sys/resource.h>
#include <time.h>

/* One round of mixing 31 bits; each step is invertible, so different x stay different. */
static uint32_t mix31(uint32_t x, uint32_t key)
{
    const uint32_t mask = 0x7fffffff;
    x = (x + key) & mask;
    x ^= x >> 15;
    x = (x * 0x2c1b3c6d) & mask;
    x ^= x >> 12;
    x = (x * 0x297a2d39) & mask;
    return x ^ x >> 15;
}

/* A permutation of the 31-bit numbers that depends on the seed. */
static uint32_t permute31(uint32_t x, uint32_t seed)
{
    x = mix31(x, (seed & 0xffff) + 0x3c6ef372);
    x = mix31(x, (seed >> 16) + 0x1b873593);
    return mix31(x, (seed * 0x9e3779b1) >> 8);
}

uint32_t replicate_seed(uint32_t seed, int k)
{
    assert(k >= 0 && k < INT32_MAX);
    uint32_t x = permute31((uint32_t)k, seed);
    return x != 0 ? x : permute31(INT32_MAX, seed); /* a value that no k has */
}

static double clock_s(clockid_t id)
{
    struct timespec t;
    clock_gettime(id, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* CPU seconds of this process and of all children that were waited for. */
static double cpu_s(void)
{
    struct rusage r;
    getrusage(RUSAGE_CHILDREN, &r);
    return clock_s(CLOCK_PROCESS_CPUTIME_ID) + (double)(r.ru_utime.tv_sec + r.ru_stime.tv_sec) +
           1e-6 * (double)(r.ru_utime.tv_usec + r.ru_stime.tv_usec);
}

struct timing timing_start(void)
{
    struct timing t = {.wall_s = clock_s(CLOCK_MONOTONIC), .cpu_s = cpu_s()};
    snprintf(t.date, sizeof t.date, "%s", utc_date_now().s);
    return t;
}

void timing_stop(struct timing *t)
{
    t->wall_s = clock_s(CLOCK_MONOTONIC) - t->wall_s;
    t->cpu_s = cpu_s() - t->cpu_s;
}

struct here {
    const struct engine_driver *driver;
    const char *dir;
};

static void path_here(const void *ctx, int k, char path[REPLICATE_IMAGE_PATH])
{
    const struct here *h = ctx;
    replicate_images_path(h->dir, h->driver->prefix, k, path);
}

bool engine_driver_render(const struct engine_driver *driver, const struct reference_job *job,
                          struct moments *out, json_t *manifest, struct err *e)
{
    const struct here here = {driver, job->dir};
    const struct replicate_images images = {path_here, &here};
    int num;
    json_t *said = json_object();
    bool ok = driver->count(job, &num, e) && driver->render(job, 0, num, said, e) &&
              driver->fold(job, &images, said, out, manifest, e);
    json_decref(said);
    return ok;
}
