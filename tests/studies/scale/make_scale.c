/* make_scale: what plans of thousands of jobs would do on a cluster, simulated event by event, with what a job, a start and a byte cost as
 * measured on one machine (tools/docs/background/scale.md, whose table this prints). A task is a line of jobs one after the other, as
 * tools/jobs/slurm.c deals them; the controller starts tasks one at a time; nodes fail at random, are noticed after a while, and
 * what they had not finished is submitted again. */
#include <assert.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <gsl/gsl_randist.h>
#include <gsl/gsl_rng.h>

/* Measured; see background/scale.md for how. */
static const double start_s =
    0.012; /* CPU s of a job that does nothing: run-job, hashes, the program's start */
static const double controller_s = 0.0021; /* of slurmctld for a task */
static const double launch_s = 0.5; /* from one task's end to the next one's begin on a slot */

/* Assumed. */
static const double node_fails_s = 30 * 86400.0; /* mean time between failures of a node */
static const double noticed_s = 300;             /* SlurmdTimeout where nobody has set it */
static const double away_s = 3600;
static const double price_h = 0.04; /* per processor and hour, in any currency */

struct work {
    const char *name;
    int jobs;
    double cpu_s, spread;       /* of a job: mean; standard deviation of its logarithm */
    int nodes, cores, threads;  /* of a node; of a job */
    double in_bytes, out_bytes; /* of a job */
    double gather_s;            /* of a job */
    int most_tasks;             /* of an array */
};

struct outcome {
    double wall_s, cpu_s, lost_s, busy, controller, longest_s;
    int lost, rounds;
};

struct slot {
    double free; /* from then on */
    int node;
};

struct cluster {
    const struct work *w;
    gsl_rng *rng;
    struct slot *slot; /* a heap by `free` */
    int num;
    double *fails; /* of each node, next */
};

static void sink(struct cluster *c, int i)
{
    for (;;) {
        int least = i;
        for (int k = 2 * i + 1; k <= 2 * i + 2; k++)
            if (k < c->num && c->slot[k].free < c->slot[least].free)
                least = k;
        if (least == i)
            return;
        struct slot s = c->slot[i];
        c->slot[i] = c->slot[least];
        c->slot[least] = s;
        i = least;
    }
}

/* Runs one array of the jobs todo[0 .. num-1] from time *begin on. Returns how many were lost; todo then holds
 * those. */
static int run_round(struct cluster *c, const double *cost, int *todo, int num, double *begin,
                     struct outcome *o)
{
    const struct work *w = c->w;
    int tasks = num < w->most_tasks ? num : w->most_tasks, lost = 0;
    int *again = malloc((size_t)num * sizeof *again);
    double controller = *begin, end = controller, told = 0;
    assert(again != NULL);
    for (int t = 0; t < tasks; t++) {
        controller += controller_s;
        struct slot *s = &c->slot[0];
        double at = fmax(fmax(s->free, *begin), controller) + launch_s;
        while (c->fails[s->node] < at) /* while nothing ran on it, or it came back */
            c->fails[s->node] += gsl_ran_exponential(c->rng, node_fails_s);
        for (int i = t; i < num; i += tasks) {
            double busy = (start_s + cost[todo[i]]) / w->threads;
            if (at + busy > c->fails[s->node]) {
                double until = c->fails[s->node];
                o->lost_s += (until - at) * w->threads;
                for (; i < num; i += tasks)
                    again[lost++] = todo[i];
                told = fmax(told, until + noticed_s);
                at = until + away_s;
                break;
            }
            at += busy;
            end = fmax(end, at);
        }
        s->free = at;
        sink(c, 0);
    }
    o->controller += tasks * controller_s;
    o->lost += lost;
    o->rounds++;
    for (int i = 0; i < lost; i++)
        todo[i] = again[i];
    free(again);
    o->wall_s = fmax(end, lost > 0 ? told : 0);
    /* The lost ones do not wait for the rest of the array, but here they do for each other. */
    *begin = told;
    return lost;
}

static struct outcome simulate(const struct work *w, unsigned long seed)
{
    struct outcome o = {0};
    struct cluster c = {.w = w, .rng = gsl_rng_alloc(gsl_rng_mt19937)};
    int each = w->cores / w->threads, num = w->jobs;
    c.num = w->nodes * each;
    c.slot = calloc((size_t)c.num, sizeof *c.slot);
    c.fails = calloc((size_t)w->nodes, sizeof *c.fails);
    double *cost = calloc((size_t)w->jobs, sizeof *cost), begin = 0;
    int *todo = calloc((size_t)w->jobs, sizeof *todo);
    assert(c.rng != NULL && c.slot != NULL && c.fails != NULL && cost != NULL && todo != NULL);
    gsl_rng_set(c.rng, seed);
    for (int i = 0; i < c.num; i++)
        c.slot[i].node = i / each;
    for (int i = 0; i < w->nodes; i++)
        c.fails[i] = gsl_ran_exponential(c.rng, node_fails_s);
    for (int i = 0; i < w->jobs; i++) {
        cost[i] = w->cpu_s * exp(gsl_ran_gaussian(c.rng, w->spread) - w->spread * w->spread / 2);
        o.cpu_s += cost[i] + start_s;
        o.longest_s = fmax(o.longest_s, cost[i] / w->threads);
        todo[i] = i;
    }
    double end = 0;
    while (num > 0) {
        num = run_round(&c, cost, todo, num, &begin, &o);
        end = fmax(end, o.wall_s);
    }
    o.wall_s = end;
    o.busy = o.cpu_s / (o.wall_s * w->nodes * w->cores);
    gsl_rng_free(c.rng);
    free(c.slot);
    free(c.fails);
    free(cost);
    free(todo);
    return o;
}

static void print_row(const struct work *w)
{
    enum { RUNS = 20 };
    struct outcome sum = {0};
    for (unsigned long k = 0; k < RUNS; k++) {
        struct outcome o = simulate(w, k + 1);
        sum.wall_s += o.wall_s / RUNS;
        sum.cpu_s += o.cpu_s / RUNS;
        sum.lost_s += o.lost_s / RUNS;
        sum.busy += o.busy / RUNS;
        sum.controller += o.controller / RUNS;
        sum.longest_s += o.longest_s / RUNS;
        sum.lost += o.lost;
    }
    double gather = w->gather_s * w->jobs, bytes = (w->in_bytes + w->out_bytes) * w->jobs;
    int tasks = w->jobs < w->most_tasks ? w->jobs : w->most_tasks;
    printf(
        "| %s | %d | %d x %d | %.0f | %.0f | %.0f | %.0f | %.0f %% | %.1f | %.2f | %.2f %% | %.1f | %.0f | %.1f |\n",
        w->name, w->jobs, w->nodes, w->cores, sum.cpu_s / 3600, sum.cpu_s / w->nodes / w->cores,
        sum.wall_s, sum.longest_s, 100 * sum.busy, (double)sum.lost / RUNS, sum.lost_s / 3600,
        100 * tasks * controller_s / sum.wall_s, bytes / 1e9, gather,
        price_h * sum.wall_s / 3600 * w->nodes * w->cores);
}

int main(void)
{
    const double pixels = 16384.0 * 16384, paths = 1e5 * pixels, paths_s = 6.8e6;
    const struct work all[] = {
        {"a class of 10,000", 10000, 10.8, 0.5, 10, 16, 1, 7e6, 1e6, 0.028, 1000},
        {"the same, 100 nodes", 10000, 10.8, 0.5, 100, 16, 1, 7e6, 1e6, 0.028, 1000},
        {"10^4 scenes", 10000, 6.6, 1, 10, 16, 1, 2.6e5, 1.4e6, 0.05, 1000},
        {"the same, 100 nodes", 10000, 6.6, 1, 100, 16, 1, 2.6e5, 1.4e6, 0.05, 1000},
        {"16384^2, 10^5 samples, 1000 jobs", 1000, paths / paths_s / 1000, 0.5, 1000, 16, 16, 1e6,
         96 * pixels / 1000, 0.2, 1000},
        {"the same, 8000 jobs", 8000, paths / paths_s / 8000, 0.5, 1000, 16, 16, 1e6,
         96 * pixels / 8000, 0.025, 1000},
        {"the same, one thread each", 16000, paths / paths_s / 16000, 0.5, 1000, 16, 1, 1e6,
         96 * pixels / 16000, 0.0125, 1000},
        {"the same, MaxArraySize 16001", 16000, paths / paths_s / 16000, 0.5, 1000, 16, 1, 1e6,
         96 * pixels / 16000, 0.0125, 16000}};
    puts(
        "| work | jobs | nodes x cores | CPU h | ideal s | wall s | longest job s | busy | jobs lost | CPU h lost | controller | GB | gather s | cost |\n"
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        print_row(&all[i]);
    return 0;
}
