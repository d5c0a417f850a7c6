#include "work.h"

#include "renderer/base/cli.h"

#include <assert.h>
#include <pthread.h>

enum { MAX_THREADS = 64 };

struct shared {
    struct work *work;
    int num, next;
    double cost;
    work_job *job;
    void *arg;
    bool failed;
    struct err err;
    pthread_mutex_t mutex;
};

static void *worker(void *arg)
{
    struct shared *s = arg;
    pthread_mutex_lock(&s->mutex);
    while (s->next < s->num && !s->failed) {
        int job = s->next++;
        struct err e;
        pthread_mutex_unlock(&s->mutex);
        bool ok = s->job(s->arg, job, &e);
        pthread_mutex_lock(&s->mutex);
        if (!ok && !s->failed) {
            s->failed = true;
            s->err = e;
        }
        s->work->done += s->cost;
        progress_update(&s->work->progress, s->work->done, s->work->total);
    }
    pthread_mutex_unlock(&s->mutex);
    return NULL;
}

bool work_run(struct work *w, int num, double cost, work_job *job, void *arg, struct err *e)
{
    assert(w->threads >= 1 && w->threads <= MAX_THREADS);
    struct shared s = {.work = w, .num = num, .cost = cost, .job = job, .arg = arg};
    pthread_t thread[MAX_THREADS];
    int started = 0;
    pthread_mutex_init(&s.mutex, NULL);
    while (started < w->threads - 1 && pthread_create(&thread[started], NULL, worker, &s) == 0)
        started++;
    worker(&s);
    for (int i = 0; i < started; i++)
        pthread_join(thread[i], NULL);
    pthread_mutex_destroy(&s.mutex);
    if (s.failed)
        return err_set(e, "%s", s.err.msg);
    return true;
}

bool work_run_all(const char *what, int num, work_job *job, void *arg, struct err *e)
{
    struct work w = {.threads = cli_processors() < MAX_THREADS ? cli_processors() : MAX_THREADS,
                     .total = num};
    progress_start(&w.progress, what, NULL, what == NULL);
    bool ok = work_run(&w, num, 1, job, arg, e);
    progress_end(&w.progress, num);
    return ok;
}
