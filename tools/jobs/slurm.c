#define _GNU_SOURCE
#include "slurm.h"

#include "reference/base/process.h"
#include "renderer/base/fs.h"
#include "renderer/base/progress.h"
#include "renderer/base/sha256.h"
#include "renderer/base/shell_quote.h"

#include <dirent.h>
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum {
    MOST_TASKS = 1000, /* of an array: one less than MaxArraySize where nobody has set it */
    MOST_TRIES = 3,
    LOOKS_BEFORE_LOST =
        2, /* out of the queue and without artefact: files may take a moment to be seen */
};
static const double patience_s = 60; /* for a controller that does not answer */

struct job {
    bool made, queued;
    int tries, round, task; /* its last round, and its task there; round 0: none */
    int looks;              /* at artefacts, since it left the queue without one */
};

struct cluster {
    const struct plan *plan;
    char name[32]; /* of our arrays: "assay-HASH OF THE PLAN-", then the round */
    struct job *job;
    int rounds, made, running, queued;
    char said[160];
    sigset_t signals;
};

static struct path round_path(const struct cluster *c, int round)
{
    return fs_path("%s/%s%d", c->plan->dir, c->name, round);
}

/* Runs one of Slurm's programs; what it prints is in DIR/log/NAME. */
static bool ask(const struct cluster *c, const char *const *argv, struct path *log, struct err *e)
{
    *log = fs_path("%s/log/%s", c->plan->dir, argv[0]);
    const struct process p = {.argv = argv, .log = log->s, .timeout_s = patience_s};
    return process_run(&p, NULL, e);
}

/* Reads which jobs a round has, a line for each task. False if there is no such round. */
static bool read_round(struct cluster *c, int round)
{
    char *line = NULL;
    size_t room = 0;
    FILE *f = fopen(round_path(c, round).s, "r");
    if (f == NULL)
        return false;
    for (int task = 1; getline(&line, &room, f) > 0; task++)
        for (char *at = line, *end;; at = end) {
            long k = strtol(at, &end, 10);
            if (end == at)
                break;
            if (k >= 0 && k < c->plan->num) {
                c->job[k].round = round;
                c->job[k].task = task;
            }
        }
    free(line);
    fclose(f);
    return true;
}

/* Marks the jobs whose tasks are still in the queue. */
static bool look_at_queue(struct cluster *c, struct err *e)
{
    struct path log;
    char user[32], *line = NULL;
    size_t room = 0, each = MOST_TASKS + 1, n = strlen(c->name);
    snprintf(user, sizeof user, "%lu", (unsigned long)getuid());
    const char *const argv[] = {"squeue", "-h", "-r", "-u", user, "-o", "%j %K %T", NULL};
    if (!ask(c, argv, &log, e))
        return false;
    bool *seen = calloc((size_t)c->rounds + 1, each * sizeof *seen);
    FILE *f = fopen(log.s, "r");
    if (f == NULL || seen == NULL) {
        free(seen);
        if (f != NULL)
            fclose(f);
        return err_set(e, "%s: %s", log.s, f == NULL ? strerror(errno) : "out of memory");
    }
    c->running = c->queued = 0;
    while (getline(&line, &room, f) > 0) {
        char state[32];
        int round, task;
        if (strncmp(line, c->name, n) != 0 ||
            sscanf(line + n, "%d %d %31s", &round, &task, state) != 3 || round < 1 ||
            round > c->rounds || task < 1 || task > MOST_TASKS)
            continue;
        seen[(size_t)round * each + (size_t)task] = true;
        c->running += strcmp(state, "RUNNING") == 0;
        c->queued++;
    }
    for (int k = 0; k < c->plan->num; k++)
        c->job[k].queued = seen[(size_t)c->job[k].round * each + (size_t)c->job[k].task];
    free(seen);
    free(line);
    fclose(f);
    return true;
}

/* Marks the jobs that have an artefact. Listing the directory makes a network file system refresh its cache. */
static void look_at_artefacts(struct cluster *c)
{
    DIR *d = opendir(fs_path("%s/jobs", c->plan->dir).s);
    while (d != NULL && readdir(d) != NULL)
        continue;
    if (d != NULL)
        closedir(d);
    c->made = 0;
    for (int k = 0; k < c->plan->num; k++) {
        struct job *j = &c->job[k];
        j->made = j->made || job_run_is_made(c->plan, k);
        j->looks = j->made || j->queued ? 0 : j->looks + 1;
        c->made += j->made;
    }
}

static bool is_lost(const struct job *j)
{
    return !j->made && !j->queued && (j->round == 0 || j->looks >= LOOKS_BEFORE_LOST);
}

/* The last line that a job's task printed. */
static void last_words(const struct cluster *c, const struct job *j, char text[256])
{
    char *line = NULL;
    size_t room = 0;
    FILE *f = fopen(fs_path("%s/log/%s%d-%d.txt", c->plan->dir, c->name, j->round, j->task).s, "r");
    strcpy(text, "it printed nothing");
    while (f != NULL && getline(&line, &room, f) > 0) {
        line[strcspn(line, "\n")] = '\0';
        snprintf(text, 256, "%.255s", line);
    }
    free(line);
    if (f != NULL)
        fclose(f);
}

/* Writes the numbers of the lost jobs, a line for each task, and marks them as queued. Neighbouring jobs, whose costs
 * are often similar, go to different tasks. */
static bool write_round(struct cluster *c, int lost, int tasks, struct err *e)
{
    struct out_file out;
    int *job = calloc((size_t)lost, sizeof *job), num = 0;
    if (job == NULL)
        return err_set(e, "out of memory");
    if (!out_open(&out, round_path(c, c->rounds).s, e)) {
        free(job);
        return false;
    }
    for (int k = 0; k < c->plan->num; k++)
        if (is_lost(&c->job[k]))
            job[num++] = k;
    for (int task = 0; task < tasks; task++)
        for (int i = task; i < lost; i += tasks) {
            struct job *j = &c->job[job[i]];
            fprintf(out.f, "%d%c", job[i], i + tasks < lost ? ' ' : '\n');
            *j = (struct job){
                .queued = true, .tries = j->tries + 1, .round = c->rounds, .task = task + 1};
        }
    free(job);
    return out_commit(&out, e);
}

/* Submits the next round: an array, each task of which runs the jobs of one line. */
static bool submit(struct cluster *c, int lost, struct err *e)
{
    char name[64], array[64], cpus[64];
    int tasks = lost < MOST_TASKS ? lost : MOST_TASKS;
    c->rounds++;
    if (!write_round(c, lost, tasks, e))
        return false;
    const struct path assay = fs_beside_program("assay");
    const struct path todo = round_path(c, c->rounds),
                      output =
                          fs_path("--output=%s/log/%s%d-%%a.txt", c->plan->dir, c->name, c->rounds);
    snprintf(name, sizeof name, "--job-name=%s%d", c->name, c->rounds);
    snprintf(array, sizeof array, "--array=1-%d", tasks);
    snprintf(cpus, sizeof cpus, "--cpus-per-task=%d",
             (int)json_integer_value(json_object_get(c->plan->head, "cpus")));
    char *run =
        shell_quote_join("exec", (const char *const[]){assay.s, "run-job", c->plan->dir, NULL});
    char *jobs = shell_quote_join(NULL, (const char *const[]){todo.s, NULL}), *script = NULL;
    bool ok = run != NULL && jobs != NULL &&
              asprintf(&script, "%s $(sed -n ${SLURM_ARRAY_TASK_ID}p %s)", run, jobs) >= 0;
    if (ok) {
        struct path log;
        const char *const argv[] = {"sbatch", "--no-requeue", "--open-mode=append",
                                    name,     array,          cpus,
                                    output.s, "--wrap",       script,
                                    NULL};
        ok = ask(c, argv, &log, e);
    } else {
        err_set(e, "out of memory");
    }
    free(run);
    free(jobs);
    free(script);
    return ok;
}

static void cancel(const struct cluster *c)
{
    struct err ignored;
    struct path log;
    char name[64];
    for (int r = 1; r <= c->rounds; r++) {
        snprintf(name, sizeof name, "%s%d", c->name, r);
        const char *const argv[] = {"scancel", "-n", name, NULL};
        (void)!ask(c, argv, &log, &ignored);
    }
}

static void tell(struct cluster *c)
{
    char now[160];
    snprintf(now, sizeof now, "%d of %d jobs made, %d tasks running, %d waiting%s", c->made,
             c->plan->num, c->running, c->queued - c->running,
             c->rounds > 1 ? ", some submitted again" : "");
    if (strcmp(now, c->said) != 0)
        fprintf(stderr, "slurm: %s\n", now);
    strcpy(c->said, now);
}

/* Sleeps for some seconds; true if SIGINT or SIGTERM arrived. */
static bool wait_a_little(const struct cluster *c)
{
    const struct timespec t = {1 + c->queued / 500, 0};
    return sigtimedwait(&c->signals, NULL, &t) > 0;
}

static bool follow(struct cluster *c, struct err *e)
{
    double answered = progress_seconds();
    for (;;) {
        struct err why = {""};
        int lost = 0;
        if (look_at_queue(c, &why)) {
            answered = progress_seconds();
            look_at_artefacts(c);
            for (int k = 0; k < c->plan->num; k++) {
                const struct job *j = &c->job[k];
                char words[256];
                lost += is_lost(j);
                if (!is_lost(j) || j->tries < MOST_TRIES)
                    continue;
                last_words(c, j, words);
                cancel(c);
                return err_set(e, "job %d came back %d times without its artefact: %s", k, j->tries,
                               words);
            }
            tell(c);
        } else if (progress_seconds() - answered > patience_s) {
            *e = why;
            return err_prefix(e, "Slurm does not answer");
        }
        if (c->made == c->plan->num)
            return true;
        if (lost > 0 && !submit(c, lost, e))
            return false;
        if (wait_a_little(c)) {
            cancel(c);
            return err_set(e, "interrupted with %d of %d jobs made; the same command goes on",
                           c->made, c->plan->num);
        }
    }
}

bool slurm_make(const struct plan *p, struct err *e)
{
    char hex[65];
    struct cluster c = {.plan = p};
    sigset_t old;
    if (!sha256_file(fs_path("%s/plan.jsonl", p->dir).s, hex, e) ||
        !fs_make_dirs(fs_path("%s/log", p->dir).s, e) ||
        !fs_make_dirs(fs_path("%s/jobs", p->dir).s, e))
        return false;
    c.job = calloc((size_t)p->num + 1, sizeof *c.job);
    if (c.job == NULL)
        return err_set(e, "out of memory");
    snprintf(c.name, sizeof c.name, "assay-%.12s-", hex);
    while (read_round(&c, c.rounds + 1))
        c.rounds++;
    sigemptyset(&c.signals);
    sigaddset(&c.signals, SIGINT);
    sigaddset(&c.signals, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &c.signals, &old);
    bool ok = follow(&c, e);
    pthread_sigmask(SIG_SETMASK, &old, NULL);
    free(c.job);
    return ok;
}
