#include "parallel.h"

#include <pthread.h>
#include <stdlib.h>

enum { MAX_THREADS = 256 };

/* Runs `main` on up to `threads` threads (and at most MAX_THREADS + 1), this one included, and waits for all. If
 * fewer can be created, those do all the work. */
static void run(int threads, void *(*main)(void *), void *arg)
{
    pthread_t thread[MAX_THREADS];
    int started = 0;
    while (started + 1 < threads && started < MAX_THREADS &&
           pthread_create(&thread[started], NULL, main, arg) == 0)
        started++;
    main(arg);
    while (started > 0)
        pthread_join(thread[--started], NULL);
}

struct range {
    pthread_mutex_t lock;
    size_t next, step, end;
    void (*work)(void *ctx, size_t first, size_t last);
    void *ctx;
};

static void *take_parts(void *arg)
{
    struct range *r = arg;
    for (;;) {
        pthread_mutex_lock(&r->lock);
        size_t first = r->next, last = r->end - first > r->step ? first + r->step : r->end;
        r->next = last;
        pthread_mutex_unlock(&r->lock);
        if (first == last)
            return NULL;
        r->work(r->ctx, first, last);
    }
}

void parallel_for(int threads, size_t n, void (*work)(void *ctx, size_t first, size_t last),
                  void *ctx)
{
    if (threads <= 1) {
        if (n > 0)
            work(ctx, 0, n);
        return;
    }
    /* Several parts per thread, since some take longer than others. */
    struct range r = {.step = n / (8 * (size_t)threads) + 1, .end = n, .work = work, .ctx = ctx};
    pthread_mutex_init(&r.lock, NULL);
    run(threads, take_parts, &r);
    pthread_mutex_destroy(&r.lock);
}

struct pool {
    pthread_mutex_t lock;
    pthread_cond_t change;
    struct parallel_task *task;
    size_t num, room, busy; /* tasks waiting; threads at work on one */
    bool failed;
    int (*work)(void *ctx, const struct parallel_task *t, struct parallel_task more[2]);
    void *ctx;
};

static struct parallel_task take_largest(struct pool *p)
{
    size_t best = 0;
    for (size_t i = 1; i < p->num; i++)
        if (p->task[i].size > p->task[best].size)
            best = i;
    struct parallel_task t = p->task[best];
    p->task[best] = p->task[--p->num];
    return t;
}

static void add(struct pool *p, const struct parallel_task *t)
{
    if (p->num == p->room) {
        size_t room = 2 * p->room + 64;
        struct parallel_task *larger = aligned_alloc(32, room * sizeof *larger);
        if (larger == NULL) {
            p->failed = true;
            return;
        }
        for (size_t i = 0; i < p->num; i++)
            larger[i] = p->task[i];
        free(p->task);
        p->task = larger;
        p->room = room;
    }
    p->task[p->num++] = *t;
}

static void *take_tasks(void *arg)
{
    struct pool *p = arg;
    pthread_mutex_lock(&p->lock);
    for (;;) {
        while (p->num == 0 && p->busy > 0 && !p->failed)
            pthread_cond_wait(&p->change, &p->lock);
        if (p->num == 0 || p->failed)
            break;
        struct parallel_task t = take_largest(p), more[2];
        p->busy++;
        pthread_mutex_unlock(&p->lock);
        int n = p->work(p->ctx, &t, more);
        pthread_mutex_lock(&p->lock);
        p->busy--;
        p->failed |= n < 0;
        for (int i = 0; i < n; i++)
            add(p, &more[i]);
        pthread_cond_broadcast(&p->change);
    }
    pthread_mutex_unlock(&p->lock);
    return NULL;
}

bool parallel_divide(int threads, const struct parallel_task *first,
                     int (*work)(void *ctx, const struct parallel_task *t,
                                 struct parallel_task more[2]),
                     void *ctx)
{
    struct pool p = {.work = work, .ctx = ctx};
    pthread_mutex_init(&p.lock, NULL);
    pthread_cond_init(&p.change, NULL);
    add(&p, first);
    run(threads, take_tasks, &p);
    pthread_cond_destroy(&p.change);
    pthread_mutex_destroy(&p.lock);
    free(p.task);
    return !p.failed;
}
