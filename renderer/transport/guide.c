#include "guide.h"

#include "renderer/base/huge_alloc.h"
#include "renderer/base/parallel.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* Of the pilot's random numbers: other sample numbers of the same seed would be independent only with an independent
 * sampler. */
static const uint64_t pilot_seed_mask = 0x5851f42d4c957f2d;

/* Share of directions that are not guided: each bounce multiplies a path's weight by 1/0.2 at most. */
static const double unguided = 0.2;
/* Bins learn from their four neighbours by this weight, and from the whole square as if by one direction more. */
static const double neighbours = 0.2, whole_square = 1;

/* What a path taught at a vertex. */
struct lesson {
    int32_t bin; /* -1: nothing */
    float light; /* L */
};

struct pilot {
    struct integrator it;
    uint64_t pixels, apart; /* of the image; with paths of the same sample number */
    struct lesson *lessons; /* of BATCH_LANES paths after another, GUIDE_VERTICES each */
    struct bvh_stats rays;
    bool out_of_memory;
    pthread_mutex_t lock; /* guards the last two */
};

static void learn_batch(const struct pilot *t, size_t number, struct batch *b,
                        struct guide_notes *notes)
{
    struct lesson *lesson = t->lessons + number * BATCH_LANES * GUIDE_VERTICES;
    memset(notes->bin, 0xff, sizeof notes->bin);
    for (int i = 0; i < BATCH_LANES; i++) {
        const uint64_t path = number * BATCH_LANES + (uint64_t)i;
        b->pixel[i] = (uint32_t)(path % t->apart * t->pixels / t->apart);
        b->sample[i] = (uint32_t)(path / t->apart);
    }
    integrator_run(&t->it, b, BATCH_LANES);
    for (int i = 0; i < BATCH_LANES; i++) {
        const float all = b->radiance.r[i] + b->radiance.g[i] + b->radiance.b[i];
        for (int k = 0; k < GUIDE_VERTICES; k++, lesson++) {
            const float light = (all - notes->before[k][i]) / notes->throughput[k][i];
            *lesson = (struct lesson){notes->bin[k][i], light > 0 && light < INFINITY ? light : 0};
        }
    }
}

static void learn_batches(void *ctx, size_t first, size_t last)
{
    struct pilot *t = ctx;
    struct batch *b = calloc(1, sizeof *b);
    struct guide_notes *notes = calloc(1, sizeof *notes);
    if (b != NULL && notes != NULL) {
        b->notes = notes;
        for (size_t k = first; k < last; k++)
            learn_batch(t, k, b, notes);
    }
    pthread_mutex_lock(&t->lock);
    if (b != NULL && notes != NULL) {
        bvh_stats_add(&t->rays, &b->stats);
    } else {
        t->out_of_memory = true;
    }
    pthread_mutex_unlock(&t->lock);
    free(notes);
    free(b);
}

/* Sum over a bin and, less, its neighbours. */
static double around(const double sum[GUIDE_BINS], int x, int y)
{
    double s = sum[x * GUIDE_SIDE + y], beside = 0;
    for (int d = -1; d <= 1; d += 2) {
        beside += x + d >= 0 && x + d < GUIDE_SIDE ? sum[(x + d) * GUIDE_SIDE + y] : 0;
        beside += y + d >= 0 && y + d < GUIDE_SIDE ? sum[x * GUIDE_SIDE + y + d] : 0;
    }
    return s + neighbours * beside;
}

/* Cumulative probabilities in proportion to the weights; the last is 1. */
static void cumulate(const double weight[GUIDE_SIDE], float row[GUIDE_SIDE])
{
    double total = 0, sum = 0;
    for (int i = 0; i < GUIDE_SIDE; i++)
        total += weight[i];
    for (int i = 0; i < GUIDE_SIDE; i++)
        row[i] = (float)((sum += weight[i]) / total);
    row[GUIDE_SIDE - 1] = 1;
}

void guide_tabulate(const double sum[GUIDE_BINS], const double count[GUIDE_BINS],
                    float table[GUIDE_ROWS * GUIDE_SIDE])
{
    double all = 0, num = 0, weight[GUIDE_BINS], total = 0, columns[GUIDE_SIDE] = {0};
    for (int i = 0; i < GUIDE_BINS; i++) {
        all += sum[i];
        num += count[i];
    }
    const double mean = num > 0 ? all / num : 0;
    for (int i = 0; i < GUIDE_BINS; i++) {
        const int x = i / GUIDE_SIDE, y = i % GUIDE_SIDE;
        weight[i] =
            sqrt((around(sum, x, y) + whole_square * mean) / (around(count, x, y) + whole_square));
        total += weight[i];
    }
    for (int i = 0; i < GUIDE_BINS; i++) {
        weight[i] = unguided / GUIDE_BINS +
                    (1 - unguided) * (total > 0 ? weight[i] / total : 1.0 / GUIDE_BINS);
        columns[i / GUIDE_SIDE] += weight[i];
    }
    cumulate(columns, table);
    for (int x = 0; x < GUIDE_SIDE; x++)
        cumulate(weight + x * GUIDE_SIDE, table + (1 + x) * GUIDE_SIDE);
}

/* What a place has been taught: sums of L^2 by bins, and their numbers. */
struct taught {
    double sum[GUIDE_BINS], count[GUIDE_BINS];
};

/* Lessons are added in their order, whoever learned them. */
static void tabulate_all(const struct pilot *t, size_t num, struct taught *places, float *table)
{
    for (size_t i = 0; i < num; i++) {
        const struct lesson *l = &t->lessons[i];
        if (l->bin < 0)
            continue;
        struct taught *of = &places[l->bin / GUIDE_BINS];
        of->sum[l->bin % GUIDE_BINS] += (double)l->light * (double)l->light;
        of->count[l->bin % GUIDE_BINS]++;
    }
    static const double nothing[GUIDE_BINS] = {0};
    float uniform[GUIDE_ROWS * GUIDE_SIDE];
    guide_tabulate(nothing, nothing, uniform);
    for (size_t p = 0; p < GUIDE_PLACES; p++) {
        float *of = table + p * GUIDE_ROWS * GUIDE_SIDE;
        double directions = 0;
        for (int k = 0; k < GUIDE_BINS; k++)
            directions += places[p].count[k];
        if (directions > 0)
            guide_tabulate(places[p].sum, places[p].count, of);
        else
            memcpy(of, uniform, sizeof uniform);
    }
}

struct guide *guide_learn(const struct integrator *it, int threads, struct err *e)
{
    const struct scene *s = it->scene;
    const uint64_t pixels = (uint64_t)it->camera->width * (uint64_t)it->camera->height;
    const uint64_t paths =
        pixels < GUIDE_PATHS / GUIDE_SAMPLES ? GUIDE_SAMPLES * pixels : GUIDE_PATHS;
    const size_t batches = (paths + BATCH_LANES - 1) / BATCH_LANES;
    const size_t lessons = batches * BATCH_LANES * GUIDE_VERTICES;
    struct guide *g = calloc(1, sizeof *g);
    struct taught *places = huge_calloc(GUIDE_PLACES, sizeof *places);
    struct pilot t = {.it = *it,
                      .pixels = pixels,
                      .apart = pixels < paths ? pixels : paths,
                      .lessons = huge_alloc(lessons * sizeof *t.lessons)};
    if (g != NULL)
        g->table = huge_alloc((size_t)GUIDE_PLACES * GUIDE_ROWS * GUIDE_SIDE * sizeof *g->table);
    bool ok = g != NULL && g->table != NULL && places != NULL && t.lessons != NULL;
    if (ok) {
        const vec3 size = sub(s->bounds_max, s->bounds_min);
        g->low = s->bounds_min;
        g->cells_per_unit =
            v3(size.x > 0 ? GUIDE_CELLS / size.x : 0, size.y > 0 ? GUIDE_CELLS / size.y : 0,
               size.z > 0 ? GUIDE_CELLS / size.z : 0);
        tabulate_all(&t, 0, places, g->table);
        t.it.guide = g;
        t.it.opt.sampler.seed ^= pilot_seed_mask;
        t.it.opt.first_hits = false;
        pthread_mutex_init(&t.lock, NULL);
        parallel_for(threads, batches, learn_batches, &t);
        pthread_mutex_destroy(&t.lock);
        ok = !t.out_of_memory;
    }
    if (ok) {
        tabulate_all(&t, lessons, places, g->table);
        g->paths = (double)(batches * BATCH_LANES);
        g->rays = t.rays;
    } else {
        err_set(e, "out of memory for --guiding");
        guide_free(g);
        g = NULL;
    }
    free(t.lessons);
    free(places);
    return g;
}

void guide_free(struct guide *g)
{
    if (g != NULL)
        free(g->table);
    free(g);
}
