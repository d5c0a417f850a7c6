/* Rays per second of BVH_WIDE against Embree 3 [Embree], one ray at a time by its default flags and by
 * ROBUST, on one thread; time to build and size. A set of rays of which more than 0.05 % differ from
 * Embree's answer is an error. */
#include "bench.h"
#include "bench_timing.h"
#include "bench_tracers.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum set { PRIMARY, BOUNCE1, BOUNCE2, SHADOW1, SHADOW2, NUM_SETS };
static const char *const set_names[] = {"primary", "bounce1", "bounce2", "shadow1", "shadow2"};

static bool is_shadow(enum set k)
{
    return k >= SHADOW1;
}

enum { DEFAULT, ROBUST, WIDE, NUM_TRACERS };

struct result {
    double ratio[NUM_SETS], robust[NUM_SETS], mrays[NUM_SETS], nodes[NUM_SETS], leaves[NUM_SETS],
        build, mtri_per_s, bytes_per_triangle;
    bool wrong, list;
};

static struct result measure(const struct bench_scene *of, enum isa isa, int rounds)
{
    const struct scene *s = &of->scene;
    struct result out = {.list = scene_num_primitives(s) <= 32};
    vec3 lo, hi;
    bench_scene_bounds(s, &lo, &hi);
    vec3 middle = scale(add(lo, hi), 0.5f);
    float size = length(sub(hi, lo)) / 2;
    /* Under the ceiling of a box; beside an open mesh. */
    vec3 light = of->framed ? mad(middle, 0.42f * (hi.y - lo.y), v3(0.1f, 1, 0.05f))
                            : mad(middle, 2 * size, v3(0.4f, 1, 0.6f));
    double build[BENCH_MAX_ROUNDS], mine[BENCH_MAX_ROUNDS];
    int builds = s->num_triangles < 200000 ? 5 : 3;
    struct tracer t[NUM_TRACERS];
    for (int k = 0; k < builds; k++) {
        if (k > 0) {
            tracer_free(&t[DEFAULT]);
            tracer_free(&t[WIDE]);
        }
        t[DEFAULT] = tracer_embree("embree", s, RTC_SCENE_FLAG_NONE);
        t[WIDE] = tracer_ours(s, isa);
        build[k] = t[DEFAULT].build_seconds / t[WIDE].build_seconds;
        mine[k] = scene_num_primitives(s) / t[WIDE].build_seconds * 1e-6;
    }
    t[ROBUST] = tracer_embree("robust", s, RTC_SCENE_FLAG_ROBUST);
    out.build = bench_median(build, builds);
    out.mtri_per_s = bench_median(mine, builds);
    out.bytes_per_triangle = (double)t[WIDE].bytes / scene_num_primitives(s);
    struct ray_set set[NUM_SETS];
    struct answer_key answer[NUM_TRACERS];
    for (int k = 0; k < NUM_SETS; k++)
        set[k] = ray_set_new();
    for (int k = 0; k < NUM_TRACERS; k++)
        answer[k] = answers_new();
    ray_set_camera(of, middle, size, &set[PRIMARY]);
    tracer_run(&t[ROBUST], &set[PRIMARY], false, &answer[ROBUST], NULL);
    ray_set_go_on(s, &set[PRIMARY], &answer[ROBUST], size, light, 72, &set[BOUNCE1], &set[SHADOW1]);
    tracer_run(&t[ROBUST], &set[BOUNCE1], false, &answer[ROBUST], NULL);
    ray_set_go_on(s, &set[BOUNCE1], &answer[ROBUST], size, light, 73, &set[BOUNCE2], &set[SHADOW2]);
    for (enum set k = 0; k < NUM_SETS; k++) {
        double a[BENCH_MAX_ROUNDS], b[BENCH_MAX_ROUNDS], rate[BENCH_MAX_ROUNDS];
        bool shadow = is_shadow(k);
        for (int round = -1; round < rounds; round++) {
            double seconds[NUM_TRACERS];
            struct bvh_stats stats = {0};
            for (int j = 0; j < NUM_TRACERS; j++)
                seconds[j] = tracer_run(&t[j], &set[k], shadow, &answer[j], &stats);
            if (round < 0) { /* warms up, and is looked at */
                size_t n = ray_set_different(&set[k], shadow, &answer[ROBUST], &answer[WIDE], size);
                if (n * 2000 > set[k].num_rays) {
                    printf("%s %s: %zu of %zu rays differ from Embree's\n", of->name, set_names[k],
                           n, set[k].num_rays);
                    out.wrong = true;
                }
                continue;
            }
            a[round] = seconds[DEFAULT] / seconds[WIDE];
            b[round] = seconds[ROBUST] / seconds[WIDE];
            out.nodes[k] = (double)stats.box_tests / (double)stats.rays;
            out.leaves[k] = (double)stats.primitive_tests / (double)stats.rays;
            rate[round] = (double)set[k].num_rays / seconds[WIDE] * 1e-6;
        }
        out.ratio[k] = bench_median(a, rounds);
        out.robust[k] = bench_median(b, rounds);
        out.mrays[k] = bench_median(rate, rounds);
    }
    for (int k = 0; k < NUM_SETS; k++)
        free(set[k].batch);
    for (int k = 0; k < NUM_TRACERS; k++) {
        free(answer[k].hit);
        free(answer[k].occluded);
        tracer_free(&t[k]);
    }
    return out;
}

/* Geometric means of trees and of lists; worst: the least of all. */
struct mean {
    double log_sum;
    double worst;
    int n;
};

static void mean_add(struct mean *m, double x)
{
    m->worst = m->n == 0 || x < m->worst ? x : m->worst;
    m->log_sum += log(x);
    m->n++;
}

static double mean_of(const struct mean *m)
{
    return m->n > 0 ? exp(m->log_sum / m->n) : NAN;
}

static json_t *json_of(const struct bench_scene *of, const struct result *r)
{
    json_t *sets = json_object();
    for (int k = 0; k < NUM_SETS; k++)
        json_object_set_new(sets, set_names[k],
                            json_pack("{s:f,s:f,s:f,s:f,s:f}", "ratio", r->ratio[k],
                                      "ratio_to_robust", r->robust[k], "mrays_per_cpu_second",
                                      r->mrays[k], "nodes_per_ray", r->nodes[k], "leaves_per_ray",
                                      r->leaves[k]));
    return json_pack("{s:s,s:I,s:I,s:b,s:o,s:f,s:f,s:f}", "scene", of->name, "triangles",
                     (json_int_t)of->scene.num_triangles, "spheres",
                     (json_int_t)of->scene.num_spheres, "list", (int)r->list, "sets", sets,
                     "build_ratio", r->build, "build_mtri_per_cpu_second", r->mtri_per_s,
                     "bytes_per_triangle", r->bytes_per_triangle);
}

static void print_row(const char *name, const char *what, const double x[NUM_SETS])
{
    printf("%-21s %-7s", name, what);
    for (int k = 0; k < NUM_SETS; k++)
        printf(" %8.2f", x[k]);
}

static void print_means(const char *name, struct mean m[2][NUM_SETS])
{
    if (m[0][0].n == 0)
        return;
    static const char *const what[] = {"embree", "robust"};
    for (int f = 0; f < 2; f++) {
        double mean[NUM_SETS], worst[NUM_SETS];
        for (int k = 0; k < NUM_SETS; k++) {
            mean[k] = mean_of(&m[f][k]);
            worst[k] = m[f][k].worst;
        }
        print_row(name, what[f], mean);
        printf("   geometric mean of %d\n", m[f][0].n);
        print_row("", "", worst);
        printf("   the least\n");
    }
}

static void print_result(const char *name, const struct result *r)
{
    print_row(name, "embree", r->ratio);
    printf("  %6.2f %7.2f %6.1f\n", r->build, r->mtri_per_s, r->bytes_per_triangle);
    print_row("", "robust", r->robust);
    putchar('\n');
    print_row("", "Mrays/s", r->mrays);
    putchar('\n');
    print_row("", "nodes", r->nodes);
    putchar('\n');
    print_row("", "leaves", r->leaves);
    putchar('\n');
}

json_t *bench_rays(const struct bench_options *o, bool *wrong, struct err *e)
{
    (void)e;
    printf(
        "Ratios of CPU time per ray, Embree's over ours, medians of %d rounds; M rays/s are ours.\n"
        "%-21s %-7s",
        o->rounds, "scene", "");
    for (int k = 0; k < NUM_SETS; k++)
        printf(" %8s", set_names[k]);
    printf("   build  Mtri/s  B/tri\n");
    struct mean trees[2][NUM_SETS] = {{{0}}}, lists[2][NUM_SETS] = {{{0}}}, build = {0};
    json_t *scenes = json_array();
    for (int i = 0; i < BENCH_NUM_SCENES; i++) {
        struct bench_scene of;
        if (!bench_wanted(o, bench_scene_name(i)) ||
            (o->smoke && strcmp(bench_scene_name(i), "44_mesh") != 0) ||
            !bench_scene_load(bench_scene_name(i), &of))
            continue;
        struct result r = measure(&of, o->isa, o->rounds);
        *wrong |= r.wrong;
        if (!r.wrong) {
            print_result(of.name, &r);
            for (int k = 0; k < NUM_SETS; k++) {
                mean_add(&(r.list ? lists : trees)[0][k], r.ratio[k]);
                mean_add(&(r.list ? lists : trees)[1][k], r.robust[k]);
            }
            if (!r.list)
                mean_add(&build, r.build);
            json_array_append_new(scenes, json_of(&of, &r));
        }
        scene_free(&of.scene);
    }
    print_means("trees", trees);
    print_means("lists of up to 32", lists);
    printf("build: %.2f, the least %.2f\n", mean_of(&build), build.worst);
    return json_pack("{s:s,s:i,s:o}", "isa", isa_names[o->isa], "rounds", o->rounds, "scenes",
                     scenes);
}
