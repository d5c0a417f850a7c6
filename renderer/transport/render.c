#include "render.h"

#include "guide.h"
#include "integrator_simd.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { TILE = 16, ERROR_CHECK_EVERY = 16 };
_Static_assert(TILE *TILE <= BATCH_LANES, "one lane for every pixel of a tile");

/* A pass should last about this long: short enough to answer Ctrl-C, long compared with starting threads. */
static const double pass_seconds = 0.5;

/* The pilot's random numbers come from a seed of their own: other sample numbers of the same seed would
 * be independent only with an independent sampler. */
static const uint64_t pilot_seed_mask = 0x9e3779b97f4a7c15;

struct job {
    const struct integrator *it;
    const struct render_options *opt;
    struct film *film;
    uint32_t last; /* the pass renders sample numbers below this */
    int tiles_x, num_tiles;
    int stretch; /* tiles in a stretch; there are as many stretches as threads */
    atomic_int next_ticket;
    atomic_bool out_of_memory;
    atomic_ullong samples_done;
    pthread_mutex_t lock; /* guards running, stats */
    pthread_cond_t ended; /* running has become 0 */
    int running;
    struct bvh_stats stats;
};

static bool has_converged(const struct render_options *o, double s1, double s2, double n)
{
    double mean = s1 / n, variance = n > 1 ? (s2 - s1 * s1 / n) / (n - 1) : 0;
    return 1.96 * sqrt(variance > 0 ? variance / n : 0) <= o->adaptive_tolerance * mean;
}

/* True if a pixel with n samples has all that it is to get. That does not change later, so nothing but
 * the film has to be remembered between passes. */
static bool has_stopped(const struct render_options *o, const struct film *f, size_t pixel,
                        uint32_t n)
{
    if (f->target != NULL && o->first_sample + n >= f->target[pixel])
        return true;
    return o->adaptive_batch > 0 && n > 0 && n % (uint32_t)o->adaptive_batch == 0 &&
           has_converged(o, f->s1[pixel], f->s2[pixel], n);
}

static void render_tile(struct job *j, struct batch *b, int tile)
{
    const struct render_options *o = j->opt;
    struct film *f = j->film;
    int x0 = tile % j->tiles_x * TILE, y0 = tile / j->tiles_x * TILE;
    int x1 = x0 + TILE < o->width ? x0 + TILE : o->width;
    int y1 = y0 + TILE < o->height ? y0 + TILE : o->height;
    size_t at[BATCH_LANES];
    uint32_t pixel[BATCH_LANES];
    int n = 0;
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++) {
            at[n] = (size_t)y * (size_t)o->width + (size_t)x;
            pixel[n] = (uint32_t)(y + o->y) * (uint32_t)j->it->camera->width + (uint32_t)(x + o->x);
            /* A new film is not read: see film_simd.h. */
            n += (f->num_samples == 0 || f->m.n[at[n]] == f->num_samples) &&
                 !has_stopped(o, f, at[n], f->num_samples);
        }
    for (uint32_t k = f->num_samples; k < j->last && n > 0; k++) {
        for (int i = 0; i < n; i++) {
            b->pixel[i] = pixel[i];
            b->sample[i] = o->first_sample + k;
        }
        integrator_run(j->it, b, n);
        atomic_fetch_add_explicit(&j->samples_done, (unsigned)n, memory_order_relaxed);
        j->it->stages->film_add(f, at, n, b, k == 0);
        for (int i = 0; f->first != NULL && i < n; i++)
            film_add_first_hit(f, at[i], &b->first, i);
        if (f->target == NULL && o->adaptive_batch == 0)
            continue;
        int kept = 0;
        for (int i = 0; i < n; i++) {
            at[kept] = at[i];
            pixel[kept] = pixel[i];
            kept += !has_stopped(o, f, at[i], k + 1);
        }
        n = kept;
    }
}

/* The tile of a ticket; it may be past the last. Tickets go round the stretches, since two threads on neighbouring
 * tiles would take cache lines and pages from each other. */
static int tile_of(const struct job *j, int ticket)
{
    return ticket % j->opt->threads * j->stretch + ticket / j->opt->threads;
}

static void *worker(void *arg)
{
    struct job *j = arg;
    struct batch *b = calloc(1, sizeof *b);
    if (b == NULL)
        atomic_store(&j->out_of_memory, true);
    const int num_tickets = j->stretch * j->opt->threads;
    for (int t; b != NULL && (t = atomic_fetch_add(&j->next_ticket, 1)) < num_tickets;)
        if (tile_of(j, t) < j->num_tiles)
            render_tile(j, b, tile_of(j, t));
    pthread_mutex_lock(&j->lock);
    if (b != NULL)
        bvh_stats_add(&j->stats, &b->stats);
    if (--j->running == 0)
        pthread_cond_signal(&j->ended);
    pthread_mutex_unlock(&j->lock);
    free(b);
    return NULL;
}

static double cpu_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* What the passes of one render share. */
struct watch {
    const struct render_control *control;
    struct progress *progress;
    double start, last_write, total;
    bool asked;
};

static void look(struct job *j, struct watch *w)
{
    const struct render_control *c = w->control;
    progress_update(w->progress, (double)atomic_load(&j->samples_done), w->total);
    if (!w->asked && c->asked_to_stop != NULL)
        w->asked = c->asked_to_stop(c->arg);
}

/* Renders samples film->num_samples .. last-1 of every pixel that has not stopped. */
static bool render_pass(struct job *j, struct watch *w, uint32_t last, struct err *e)
{
    pthread_t *threads = calloc((size_t)j->opt->threads, sizeof *threads);
    int started = 0;
    j->last = last;
    atomic_store(&j->next_ticket, 0);
    for (; threads != NULL && started < j->opt->threads; started++) {
        pthread_mutex_lock(&j->lock);
        j->running++;
        pthread_mutex_unlock(&j->lock);
        if (pthread_create(&threads[started], NULL, worker, j) != 0) {
            pthread_mutex_lock(&j->lock);
            j->running--;
            pthread_mutex_unlock(&j->lock);
            break;
        }
    }
    pthread_mutex_lock(&j->lock);
    while (j->running > 0) {
        struct timespec until;
        clock_gettime(CLOCK_MONOTONIC, &until);
        until.tv_nsec += 50 * 1000 * 1000;
        until.tv_sec += until.tv_nsec / 1000000000;
        until.tv_nsec %= 1000000000;
        pthread_cond_timedwait(&j->ended, &j->lock, &until);
        pthread_mutex_unlock(&j->lock);
        look(j, w);
        pthread_mutex_lock(&j->lock);
    }
    pthread_mutex_unlock(&j->lock);
    for (int i = 0; i < started; i++)
        pthread_join(threads[i], NULL);
    free(threads);
    look(j, w);
    /* Fewer threads than asked for still render everything; none, or none with memory, do not. */
    if (started == 0 || atomic_load(&j->next_ticket) < j->stretch * j->opt->threads)
        return err_set(e, "cannot start rendering: out of threads or memory");
    j->film->num_samples = last;
    return true;
}

static bool wants_more(const struct job *j)
{
    const struct film *f = j->film;
    size_t pixels = (size_t)f->m.width * (size_t)f->m.height;
    if (f->target == NULL && j->opt->adaptive_batch == 0)
        return true;
    for (size_t p = 0; p < pixels; p++)
        if (f->m.n[p] == f->num_samples && !has_stopped(j->opt, f, p, f->num_samples))
            return true;
    return false;
}

/* Passes until the samples are done or the control ends them. */
static bool render_passes(struct job *j, struct watch *w, enum render_end *end, struct err *e)
{
    const struct render_control *c = w->control;
    struct film *f = j->film;
    uint32_t step = 1;
    for (*end = RENDER_DONE; f->num_samples < j->opt->num_samples && wants_more(j);) {
        uint32_t left = j->opt->num_samples - f->num_samples;
        if (c->max_error > 0) {
            uint32_t to_check = ERROR_CHECK_EVERY - f->num_samples % ERROR_CHECK_EVERY;
            if (f->num_samples > 0 && to_check == ERROR_CHECK_EVERY &&
                film_relative_error(f) <= c->max_error) {
                *end = RENDER_ERROR;
                return true;
            }
            left = left < to_check ? left : to_check;
        }
        uint32_t count = step < left ? step : left;
        double before = progress_seconds();
        if (!render_pass(j, w, f->num_samples + count, e))
            return false;
        double now = progress_seconds(), each = (now - before) / count;
        if (c->write != NULL && c->write_every > 0 && now - w->last_write >= c->write_every) {
            if (!c->write(c->arg, f, e))
                return false;
            w->last_write = progress_seconds();
        }
        if (w->asked && f->num_samples < j->opt->num_samples) {
            *end = RENDER_ASKED;
            return true;
        }
        double room = pass_seconds;
        if (c->max_seconds > 0) {
            double rest = c->max_seconds - (now - w->start);
            if (rest <= 0 && f->num_samples < j->opt->num_samples && wants_more(j)) {
                *end = RENDER_TIME;
                return true;
            }
            room = rest < room ? rest : room;
        }
        double fit = room / (each > 1e-9 ? each : 1e-9), most = 4.0 * step;
        step = (uint32_t)(fit < 1 ? 1 : fit < most ? fit : most < 1e6 ? most : 1e6);
    }
    return true;
}

static bool run_job(struct job *j, struct watch *w, enum render_end *end, struct err *e)
{
    j->tiles_x = (j->opt->width + TILE - 1) / TILE;
    j->num_tiles = j->tiles_x * ((j->opt->height + TILE - 1) / TILE);
    j->stretch = (j->num_tiles + j->opt->threads - 1) / j->opt->threads;
    pthread_mutex_init(&j->lock, NULL);
    pthread_condattr_t monotonic; /* setting the wall clock must not prolong a wait */
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&j->ended, &monotonic);
    pthread_condattr_destroy(&monotonic);
    bool ok = render_passes(j, w, end, e);
    pthread_cond_destroy(&j->ended);
    pthread_mutex_destroy(&j->lock);
    return ok;
}

/* Renders the pilot and fills film->target; if it is stopped early, film->target stays NULL. */
static bool run_pilot(const struct integrator *it, const struct render_options *opt,
                      struct watch *w, struct film *film, struct render_stats *stats,
                      enum render_end *end, struct err *e)
{
    struct film pilot = {0};
    struct integrator pilot_it = *it;
    pilot_it.opt.sampler.seed ^= pilot_seed_mask;
    pilot_it.opt.first_hits = false;
    struct render_options o = *opt;
    o.first_sample = 0;
    o.num_samples = opt->pilot_samples;
    o.adaptive_batch = 0;
    struct job j = {.it = &pilot_it, .opt = &o, .film = &pilot};
    struct render_control c = *w->control;
    c.write_every = c.max_error = 0;
    struct watch pw = *w;
    pw.control = &c;
    size_t pixels = (size_t)opt->width * (size_t)opt->height;
    bool ok = film_alloc(&pilot, opt->width, opt->height, false, e) && run_job(&j, &pw, end, e);
    w->asked = pw.asked;
    bvh_stats_add(&stats->rays, &j.stats);
    stats->samples += (double)atomic_load(&j.samples_done);
    if (ok && *end == RENDER_DONE) {
        film->target = calloc(pixels, sizeof *film->target);
        ok = film->target != NULL || err_set(e, "out of memory for the sample counts");
    }
    for (size_t p = 0; ok && film->target != NULL && p < pixels; p++) {
        double n = o.num_samples, mean = pilot.s1[p] / n;
        double variance = n > 1 ? (pilot.s2[p] - pilot.s1[p] * mean) / (n - 1) : 0;
        double sd = sqrt(variance > 0 ? variance : 0), bound = opt->pilot_tolerance * mean;
        double root = sd > 0 ? 1.96 * sd / (bound > 0 ? bound : 1e-300) : 0;
        double want = ceil(root * root);
        want = want < n ? n : want;
        film->target[p] = want < opt->pilot_max ? (uint32_t)want : opt->pilot_max;
    }
    film_free(&pilot);
    return ok;
}

bool render_film(const struct scene *s, const struct camera *c, const struct bvh *bvh,
                 const struct render_options *opt, const struct render_control *control,
                 struct progress *progress, struct film *film, struct render_stats *stats,
                 struct err *e)
{
    static const struct render_control uncontrolled = {0};
    struct light_table *lights = light_table_build(s, e);
    if (lights == NULL)
        return false;
    struct integrator it = {
        .opt = opt->integrator, .scene = s, .camera = c, .bvh = bvh, .lights = lights};
    it.opt.first_hits = film->first != NULL;
    film_set_sampler(film, opt->integrator.sampler.kind);
    if (!integrator_prepare(&it, e)) {
        integrator_free(&it);
        light_table_free(lights);
        return false;
    }
    struct job j = {.it = &it, .opt = opt, .film = film};
    struct guide *guide = NULL;
    double wall = progress_seconds(), cpu = cpu_seconds();
    double pixels = (double)opt->width * opt->height;
    struct watch w = {.control = control != NULL ? control : &uncontrolled,
                      .progress = progress,
                      .start = wall,
                      .last_write = wall,
                      .total = pixels * (opt->num_samples - film->num_samples)};
    *stats = (struct render_stats){0};
    bool ok = true;
    if (it.opt.guiding && it.opt.kind == INTEGRATE_PATHS) {
        it.guide = guide = guide_learn(&it, opt->threads, e);
        ok = guide != NULL;
        if (ok) {
            stats->rays = guide->rays;
            stats->samples = guide->paths;
        }
    }
    if (ok && opt->pilot_samples > 0 && film->target == NULL)
        ok = run_pilot(&it, opt, &w, film, stats, &stats->end, e);
    if (film->target != NULL) {
        w.total = 0;
        for (size_t p = 0; p < (size_t)pixels; p++) {
            uint32_t target = film->target[p], first = opt->first_sample + film->num_samples;
            uint32_t last = opt->first_sample + opt->num_samples;
            target = target < last ? target : last;
            w.total += target > first ? target - first : 0;
        }
    }
    if (ok && stats->end == RENDER_DONE)
        ok = run_job(&j, &w, &stats->end, e);
    bvh_stats_add(&stats->rays, &j.stats);
    stats->samples += (double)atomic_load(&j.samples_done);
    stats->wall_seconds = progress_seconds() - wall;
    stats->cpu_seconds = cpu_seconds() - cpu;
    guide_free(guide);
    integrator_free(&it);
    light_table_free(lights);
    return ok;
}

bool render(const struct scene *s, const struct camera *c, const struct bvh *bvh,
            const struct render_options *opt, struct progress *progress, struct moments *out,
            struct render_stats *stats, struct err *e)
{
    struct film film;
    if (!film_alloc(&film, opt->width, opt->height, false, e))
        return false;
    bool ok = render_film(s, c, bvh, opt, NULL, progress, &film, stats, e);
    if (ok) {
        *out = film.m;
        film.m = (struct moments){0};
    }
    film_free(&film);
    return ok;
}
