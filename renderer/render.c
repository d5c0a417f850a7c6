#include "render.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { TILE = 16 };
_Static_assert(TILE *TILE <= BATCH_LANES, "one lane for every pixel of a tile");

struct job {
    const struct integrator *it;
    const struct render_options *opt;
    struct moments *film;
    int tiles_x, num_tiles;
    atomic_int next_tile, running;
    atomic_ullong samples_done;
    pthread_mutex_t lock; /* of stats */
    struct bvh_stats stats;
};

/* The running sums of the adaptive rule, kept apart from the film because the rule is the
 * assignment's own and in its own terms. */
struct adaptive {
    double s1[BATCH_LANES], s2[BATCH_LANES];
};

static bool has_converged(const struct render_options *o, double s1, double s2, double n)
{
    double mean = s1 / n, variance = n > 1 ? (s2 - s1 * s1 / n) / (n - 1) : 0;
    return 1.96 * sqrt(variance > 0 ? variance / n : 0) <= o->adaptive_tolerance * mean;
}

static void render_tile(struct job *j, struct batch *b, struct adaptive *a, int tile)
{
    const struct render_options *o = j->opt;
    int x0 = tile % j->tiles_x * TILE, y0 = tile / j->tiles_x * TILE;
    int x1 = x0 + TILE < o->width ? x0 + TILE : o->width;
    int y1 = y0 + TILE < o->height ? y0 + TILE : o->height;
    size_t film_index[BATCH_LANES];
    uint32_t pixel[BATCH_LANES];
    int n = 0;
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++) {
            film_index[n] = (size_t)y * (size_t)o->width + (size_t)x;
            pixel[n] = (uint32_t)(y + o->y) * (uint32_t)j->it->camera->width + (uint32_t)(x + o->x);
            a->s1[n] = a->s2[n] = 0;
            n++;
        }
    for (uint32_t k = 0; k < o->num_samples && n > 0; k++) {
        for (int i = 0; i < n; i++) {
            b->pixel[i] = pixel[i];
            b->sample[i] = o->first_sample + k;
        }
        integrate(j->it, b, n);
        atomic_fetch_add_explicit(&j->samples_done, (unsigned)n, memory_order_relaxed);
        bool check = o->adaptive_batch > 0 && (k + 1) % (uint32_t)o->adaptive_batch == 0;
        int kept = 0;
        for (int i = 0; i < n; i++) {
            double x[3] = {b->radiance.r[i], b->radiance.g[i], b->radiance.b[i]};
            moments_add(j->film, film_index[i], x);
            double illuminance = 0.2126 * x[0] + 0.7152 * x[1] + 0.0722 * x[2];
            double s1 = a->s1[i] + illuminance, s2 = a->s2[i] + illuminance * illuminance;
            if (check && has_converged(o, s1, s2, (double)(k + 1)))
                continue;
            a->s1[kept] = s1;
            a->s2[kept] = s2;
            film_index[kept] = film_index[i];
            pixel[kept++] = pixel[i];
        }
        n = kept;
    }
}

static void *worker(void *arg)
{
    struct job *j = arg;
    struct batch *b = calloc(1, sizeof *b);
    struct adaptive *a = calloc(1, sizeof *a);
    if (b != NULL && a != NULL) {
        for (int tile; (tile = atomic_fetch_add(&j->next_tile, 1)) < j->num_tiles;)
            render_tile(j, b, a, tile);
        pthread_mutex_lock(&j->lock);
        j->stats.rays += b->stats.rays;
        j->stats.box_tests += b->stats.box_tests;
        j->stats.primitive_tests += b->stats.primitive_tests;
        pthread_mutex_unlock(&j->lock);
    }
    free(b);
    free(a);
    atomic_fetch_sub(&j->running, 1);
    return NULL;
}

static double cpu_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void watch(struct job *j, struct progress *progress, double total)
{
    const struct timespec pause = {.tv_nsec = 20 * 1000 * 1000};
    while (atomic_load(&j->running) > 0) {
        nanosleep(&pause, NULL);
        progress_update(progress, (double)atomic_load(&j->samples_done), total);
    }
}

bool render(const struct scene *s, const struct camera *c, const struct bvh *bvh,
            const struct render_options *opt, struct progress *progress, struct moments *out,
            struct render_stats *stats, struct err *e)
{
    bool ok = false;
    pthread_t *threads = NULL;
    struct moments film = {0};
    struct light_table *lights = light_table_build(s, e);
    if (lights == NULL || !moments_alloc(&film, opt->width, opt->height, e))
        goto done;
    struct integrator it = {
        .opt = opt->integrator, .scene = s, .camera = c, .bvh = bvh, .lights = lights};
    if (opt->integrator.sampler.kind != SAMPLER_INDEPENDENT)
        strcpy(film.unit, "stratified");
    struct job j = {.it = &it, .opt = opt, .film = &film};
    j.tiles_x = (opt->width + TILE - 1) / TILE;
    j.num_tiles = j.tiles_x * ((opt->height + TILE - 1) / TILE);
    pthread_mutex_init(&j.lock, NULL);
    double wall = now_seconds(), cpu = cpu_seconds();
    threads = calloc((size_t)opt->threads, sizeof *threads);
    int started = 0;
    for (; threads != NULL && started < opt->threads; started++) {
        atomic_fetch_add(&j.running, 1);
        if (pthread_create(&threads[started], NULL, worker, &j) != 0) {
            atomic_fetch_sub(&j.running, 1);
            break;
        }
    }
    watch(&j, progress, (double)opt->width * opt->height * opt->num_samples);
    for (int i = 0; i < started; i++)
        pthread_join(threads[i], NULL);
    pthread_mutex_destroy(&j.lock);
    /* Fewer threads than asked for still render everything; none, or none with memory, do not. */
    if (started == 0 || atomic_load(&j.next_tile) < j.num_tiles) {
        err_set(e, "cannot start rendering: out of threads or memory");
        goto done;
    }
    *stats = (struct render_stats){.rays = j.stats,
                                   .samples = (double)atomic_load(&j.samples_done),
                                   .wall_seconds = now_seconds() - wall,
                                   .cpu_seconds = cpu_seconds() - cpu};
    *out = film;
    film = (struct moments){0};
    ok = true;
done:
    free(threads);
    moments_free(&film);
    light_table_free(lights);
    return ok;
}
