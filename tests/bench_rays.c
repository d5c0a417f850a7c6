/* bench_rays [--isa NAME] [--rounds N] [--json FILE] [SCENE...]: rays per second of BVH_WIDE against
 * Embree 3 [Embree], one ray at a time by its default flags and by ROBUST, on one thread; time to build
 * and size. The scenes are the suite's, the course's where ASSAY_CS184 (or ../shared/scenes/cs184) has
 * them, and generated balls of 10^3 to 10^6 triangles; SCENE is a name that the table shows.
 *
 * Sets of rays: camera rays tile by tile, as the renderer has them; cosine-distributed ones from what
 * these hit, and from what those hit; shadow rays to one light from both. All programs get the same
 * batches and write the same arrays. What they find is compared first: a set of which 0.05 % differ is
 * not timed, and the exit status is 1. Each figure is the median over rounds of a ratio of CPU times
 * taken one right after the other. */
#include "../renderer/bvh.h"
#include "../renderer/camera.h"
#include "../renderer/collada.h"
#include "../renderer/sampler.h"
#include "../renderer/warp.h"
#include "mesh.h"

#include <embree3/rtcore.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum {
    VIEW_WIDTH = 640,
    VIEW_HEIGHT = 480,
    TILE = 16,
    TAKEN = 4, /* one tile of so many */
    MAX_RAYS = VIEW_WIDTH * VIEW_HEIGHT / TAKEN,
    MAX_ROUNDS = 99
};

enum set { PRIMARY, BOUNCE1, BOUNCE2, SHADOW1, SHADOW2, NUM_SETS };
static const char *const set_names[] = {"primary", "bounce1", "bounce2", "shadow1", "shadow2"};

static bool is_shadow(enum set k)
{
    return k >= SHADOW1;
}

static double cpu_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *allocate(size_t size)
{
    void *p = calloc(1, size);
    if (p == NULL)
        abort();
    return p;
}

/* Rays in batches, all full but the last. */
struct ray_set {
    struct rays *batch;
    size_t num_rays;
};

struct answers {
    struct hits *hit;              /* by batch */
    bool (*occluded)[BATCH_LANES]; /* by batch */
};

static size_t num_batches(const struct ray_set *s)
{
    return (s->num_rays + BATCH_LANES - 1) / BATCH_LANES;
}

static int batch_size(const struct ray_set *s, size_t b)
{
    size_t left = s->num_rays - b * BATCH_LANES;
    return left < BATCH_LANES ? (int)left : BATCH_LANES;
}

static void append(struct ray_set *s, ray r)
{
    struct rays *b = &s->batch[s->num_rays / BATCH_LANES];
    int i = (int)(s->num_rays++ % BATCH_LANES);
    rays_set(b, i, r);
    b->ignore[i] = NO_HIT;
}

/* A subject of the measurement. */
struct tracer {
    const char *name;
    struct bvh *bvh; /* ours; else Embree's */
    RTCDevice device;
    RTCScene scene;
    uint32_t num_triangles;
    double build_seconds;
    size_t bytes; /* without the caller's vertices and indices */
};

static void embree_trace(const struct tracer *t, const struct ray_set *s, bool shadow,
                         struct answers *a)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (size_t b = 0; b < num_batches(s); b++) {
        const struct rays *r = &s->batch[b];
        struct hits *h = &a->hit[b];
        for (int i = 0, n = batch_size(s, b); i < n; i++) {
            struct RTCRayHit q = {.ray = {.org_x = r->o.x[i],
                                          .org_y = r->o.y[i],
                                          .org_z = r->o.z[i],
                                          .dir_x = r->d.x[i],
                                          .dir_y = r->d.y[i],
                                          .dir_z = r->d.z[i],
                                          .tnear = r->tmin[i],
                                          .tfar = r->tmax[i],
                                          .mask = UINT32_MAX}};
            if (shadow) {
                rtcOccluded1(t->scene, &context, &q.ray);
                a->occluded[b][i] = q.ray.tfar < 0;
                continue;
            }
            q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            rtcIntersect1(t->scene, &context, &q);
            h->t[i] = q.ray.tfar;
            h->u[i] = q.hit.u;
            h->v[i] = q.hit.v;
            h->prim[i] = q.hit.geomID == RTC_INVALID_GEOMETRY_ID ? NO_HIT
                         : q.hit.geomID == 0                     ? q.hit.primID
                                                                 : t->num_triangles + q.hit.primID;
        }
    }
}

static void our_trace(const struct tracer *t, const struct ray_set *s, bool shadow,
                      struct answers *a, struct bvh_stats *stats)
{
    uint16_t lane[BATCH_LANES];
    for (int i = 0; i < BATCH_LANES; i++)
        lane[i] = (uint16_t)i;
    for (size_t b = 0; b < num_batches(s); b++)
        if (shadow)
            bvh_occluded(t->bvh, &s->batch[b], lane, batch_size(s, b), a->occluded[b], stats);
        else
            bvh_closest(t->bvh, &s->batch[b], lane, batch_size(s, b), &a->hit[b], stats);
}

static double trace(const struct tracer *t, const struct ray_set *s, bool shadow, struct answers *a,
                    struct bvh_stats *stats)
{
    double start = cpu_seconds();
    if (t->bvh != NULL)
        our_trace(t, s, shadow, a, stats);
    else
        embree_trace(t, s, shadow, a);
    return cpu_seconds() - start;
}

static bool count_bytes(void *sum, ssize_t bytes, bool post)
{
    (void)post;
    *(size_t *)sum += (size_t)bytes;
    return true;
}

/* Geometry 0: the triangles; 1: the spheres. */
static struct tracer embree_build(const char *name, const struct scene *s, enum RTCSceneFlags flags)
{
    struct tracer t = {.name = name, .num_triangles = s->num_triangles};
    t.device = rtcNewDevice("threads=1,set_affinity=0");
    t.scene = rtcNewScene(t.device);
    rtcSetSceneFlags(t.scene, flags);
    RTCGeometry g = rtcNewGeometry(t.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    size_t n = s->num_triangles;
    float *v = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                       3 * sizeof(float), 3 * n);
    unsigned *index = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              3 * sizeof(unsigned), n);
    for (size_t i = 0; i < 3 * n; i++) {
        v[3 * i] = s->position[i].x;
        v[3 * i + 1] = s->position[i].y;
        v[3 * i + 2] = s->position[i].z;
        index[i] = (unsigned)i;
    }
    rtcCommitGeometry(g);
    rtcAttachGeometryByID(t.scene, g, 0);
    rtcReleaseGeometry(g);
    if (s->num_spheres > 0) {
        g = rtcNewGeometry(t.device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
        v = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4,
                                    4 * sizeof(float), s->num_spheres);
        for (uint32_t i = 0; i < s->num_spheres; i++) {
            v[4 * i] = s->spheres[i].centre.x;
            v[4 * i + 1] = s->spheres[i].centre.y;
            v[4 * i + 2] = s->spheres[i].centre.z;
            v[4 * i + 3] = s->spheres[i].radius;
        }
        rtcCommitGeometry(g);
        rtcAttachGeometryByID(t.scene, g, 1);
        rtcReleaseGeometry(g);
    }
    rtcSetDeviceMemoryMonitorFunction(t.device, count_bytes, &t.bytes);
    double start = cpu_seconds();
    rtcCommitScene(t.scene);
    t.build_seconds = cpu_seconds() - start;
    rtcSetDeviceMemoryMonitorFunction(t.device, NULL, NULL);
    if (rtcGetDeviceError(t.device) != RTC_ERROR_NONE)
        abort();
    return t;
}

static struct tracer our_build(const struct scene *s, enum isa isa)
{
    struct err e = {0};
    struct tracer t = {.name = "wide", .num_triangles = s->num_triangles};
    double start = cpu_seconds();
    t.bvh = bvh_build_for(s, BVH_WIDE, isa, &e);
    t.build_seconds = cpu_seconds() - start;
    if (t.bvh == NULL) {
        fprintf(stderr, "bench_rays: %s\n", e.msg);
        exit(3);
    }
    t.bytes = bvh_size(t.bvh);
    return t;
}

static void tracer_free(struct tracer *t)
{
    if (t->bvh != NULL) {
        bvh_free(t->bvh);
        return;
    }
    rtcReleaseScene(t->scene);
    rtcReleaseDevice(t->device);
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *x, int n)
{
    qsort(x, (size_t)n, sizeof *x, compare_doubles);
    return n % 2 ? x[n / 2] : (x[n / 2 - 1] + x[n / 2]) / 2;
}

struct subject {
    char name[64];
    struct scene scene;
    bool framed; /* the file has a camera; else one looks at the mesh from outside */
};

static vec3 normal_of(const struct scene *s, uint32_t prim, vec3 p)
{
    if (prim >= s->num_triangles)
        return normalize(sub(p, s->spheres[prim - s->num_triangles].centre));
    const vec3 *c = s->position + 3 * (size_t)prim;
    return normalize(cross(sub(c[1], c[0]), sub(c[2], c[0])));
}

/* Rays that go on from what `in` hit: a cosine-distributed direction, and one to the light. */
static void go_on(const struct scene *s, const struct ray_set *in, const struct answers *a,
                  float size, vec3 light, uint32_t seed, struct ray_set *bounce,
                  struct ray_set *shadow)
{
    for (size_t k = 0; k < in->num_rays; k++) {
        const struct hits *h = &a->hit[k / BATCH_LANES];
        int i = (int)(k % BATCH_LANES);
        if (h->prim[i] == NO_HIT)
            continue;
        ray r = rays_get(&in->batch[k / BATCH_LANES], i);
        vec3 p = mad(r.o, h->t[i], r.d), n = normal_of(s, h->prim[i], p);
        if (dot(n, r.d) > 0)
            n = neg(n);
        if (!(dot(n, n) > 0.5f))
            continue;
        p = mad(p, 1e-4f * size, n);
        struct sample4 u = sampler_get(seed, (uint32_t)k, 0, 0, 0);
        vec3 d = add(n, warp_uniform_sphere(u.u[0], u.u[1]));
        if (bounce != NULL && length(d) > 1e-3f)
            append(bounce, (ray){p, normalize(d), 0, INFINITY});
        vec3 to = sub(light, p);
        if (length(to) > 0)
            append(shadow, (ray){p, normalize(to), 0, 0.9999f * length(to)});
    }
}

static void camera_rays(const struct subject *of, vec3 middle, float size, struct ray_set *out)
{
    struct camera c;
    struct err e = {0};
    vec3 eye = mad(middle, 1.7f * size, normalize(v3(0.3f, 0.35f, 1)));
    vec3 forward = normalize(sub(middle, eye)), right = normalize(cross(forward, v3(0, 1, 0)));
    vec3 up = cross(right, forward);
    if (of->framed && !camera_init(&c, &of->scene, VIEW_WIDTH, VIEW_HEIGHT, &e)) {
        fprintf(stderr, "bench_rays: %s\n", e.msg);
        exit(3);
    }
    if (of->framed)
        c.lens_radius = 0;
    uint32_t n = 0;
    for (int ty = 0; ty < VIEW_HEIGHT; ty += TILE)
        for (int tx = 0; tx < VIEW_WIDTH; tx += TILE)
            for (int i = 0; (tx + 2 * ty) / TILE % TAKEN == 0 && i < TILE * TILE; i++) {
                struct sample4 u = sampler_get(71, n++, 0, 0, 0);
                float x = (float)(tx + i % TILE) + u.u[0], y = (float)(ty + i / TILE) + u.u[1];
                if (of->framed) {
                    append(out, camera_ray(&c, x, y, 0.5f, 0.5f));
                    continue;
                }
                float a = 0.8f * (2 * x / VIEW_WIDTH - 1), b = 0.6f * (1 - 2 * y / VIEW_HEIGHT);
                append(out, (ray){eye, normalize(mad(mad(forward, a, right), b, up)), 0, INFINITY});
            }
}

static struct ray_set new_set(void)
{
    const size_t batches = MAX_RAYS / BATCH_LANES + 1;
    return (struct ray_set){.batch = allocate(batches * sizeof(struct rays))};
}

static struct answers new_answers(void)
{
    const size_t batches = MAX_RAYS / BATCH_LANES + 1;
    return (struct answers){allocate(batches * sizeof(struct hits)),
                            allocate(batches * BATCH_LANES * sizeof(bool))};
}

/* How many rays of a set have another answer. */
static size_t count_different(const struct ray_set *s, bool shadow, const struct answers *a,
                              const struct answers *b, float size)
{
    size_t n = 0;
    for (size_t k = 0; k < s->num_rays; k++) {
        size_t at = k / BATCH_LANES;
        int i = (int)(k % BATCH_LANES);
        if (shadow) {
            n += a->occluded[at][i] != b->occluded[at][i];
            continue;
        }
        bool x = a->hit[at].prim[i] == NO_HIT, y = b->hit[at].prim[i] == NO_HIT;
        n += x != y || (!x && fabsf(a->hit[at].t[i] - b->hit[at].t[i]) > 1e-3f * size);
    }
    return n;
}

enum { DEFAULT, ROBUST, WIDE, NUM_TRACERS };

struct result {
    double ratio[NUM_SETS], robust[NUM_SETS], mrays[NUM_SETS], nodes[NUM_SETS], leaves[NUM_SETS],
        build, mtri_per_s, bytes_per_triangle;
    bool wrong, list;
};

static void bounds_of(const struct scene *s, vec3 *lo, vec3 *hi)
{
    *lo = v3(INFINITY, INFINITY, INFINITY);
    *hi = neg(*lo);
    for (size_t i = 0; i < 3 * (size_t)s->num_triangles; i++) {
        *lo = vmin(*lo, s->position[i]);
        *hi = vmax(*hi, s->position[i]);
    }
    for (uint32_t i = 0; i < s->num_spheres; i++) {
        vec3 r = v3(s->spheres[i].radius, s->spheres[i].radius, s->spheres[i].radius);
        *lo = vmin(*lo, sub(s->spheres[i].centre, r));
        *hi = vmax(*hi, add(s->spheres[i].centre, r));
    }
}

static struct result measure(const struct subject *of, enum isa isa, int rounds)
{
    const struct scene *s = &of->scene;
    struct result out = {.list = scene_num_primitives(s) <= 32};
    vec3 lo, hi;
    bounds_of(s, &lo, &hi);
    vec3 middle = scale(add(lo, hi), 0.5f);
    float size = length(sub(hi, lo)) / 2;
    /* Under the ceiling of a box; beside an open mesh. */
    vec3 light = of->framed ? mad(middle, 0.42f * (hi.y - lo.y), v3(0.1f, 1, 0.05f))
                            : mad(middle, 2 * size, v3(0.4f, 1, 0.6f));
    double build[MAX_ROUNDS], mine[MAX_ROUNDS];
    int builds = s->num_triangles < 200000 ? 5 : 3;
    struct tracer t[NUM_TRACERS];
    for (int k = 0; k < builds; k++) {
        if (k > 0) {
            tracer_free(&t[DEFAULT]);
            tracer_free(&t[WIDE]);
        }
        t[DEFAULT] = embree_build("embree", s, RTC_SCENE_FLAG_NONE);
        t[WIDE] = our_build(s, isa);
        build[k] = t[DEFAULT].build_seconds / t[WIDE].build_seconds;
        mine[k] = scene_num_primitives(s) / t[WIDE].build_seconds * 1e-6;
    }
    t[ROBUST] = embree_build("robust", s, RTC_SCENE_FLAG_ROBUST);
    out.build = median(build, builds);
    out.mtri_per_s = median(mine, builds);
    out.bytes_per_triangle = (double)t[WIDE].bytes / scene_num_primitives(s);
    struct ray_set set[NUM_SETS];
    struct answers answer[NUM_TRACERS];
    for (int k = 0; k < NUM_SETS; k++)
        set[k] = new_set();
    for (int k = 0; k < NUM_TRACERS; k++)
        answer[k] = new_answers();
    camera_rays(of, middle, size, &set[PRIMARY]);
    trace(&t[ROBUST], &set[PRIMARY], false, &answer[ROBUST], NULL);
    go_on(s, &set[PRIMARY], &answer[ROBUST], size, light, 72, &set[BOUNCE1], &set[SHADOW1]);
    trace(&t[ROBUST], &set[BOUNCE1], false, &answer[ROBUST], NULL);
    go_on(s, &set[BOUNCE1], &answer[ROBUST], size, light, 73, &set[BOUNCE2], &set[SHADOW2]);
    for (enum set k = 0; k < NUM_SETS; k++) {
        double a[MAX_ROUNDS], b[MAX_ROUNDS], rate[MAX_ROUNDS];
        bool shadow = is_shadow(k);
        for (int round = -1; round < rounds; round++) {
            double seconds[NUM_TRACERS];
            struct bvh_stats stats = {0};
            for (int j = 0; j < NUM_TRACERS; j++)
                seconds[j] = trace(&t[j], &set[k], shadow, &answer[j], &stats);
            if (round < 0) { /* warms up, and is looked at */
                size_t n = count_different(&set[k], shadow, &answer[ROBUST], &answer[WIDE], size);
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
        out.ratio[k] = median(a, rounds);
        out.robust[k] = median(b, rounds);
        out.mrays[k] = median(rate, rounds);
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

/* A bumpy ball of about n triangles in a box without a front (tests/make_mesh.c). */
static struct scene ball_in_box(uint32_t n)
{
    static const float corner[8][3] = {{-1, -0.75f, -1}, {1, -0.75f, -1}, {1, 0.75f, -1},
                                       {-1, 0.75f, -1},  {-1, -0.75f, 1}, {1, -0.75f, 1},
                                       {1, 0.75f, 1},    {-1, 0.75f, 1}};
    static const int wall[5][4] = {
        {0, 1, 2, 3}, {0, 4, 5, 1}, {3, 2, 6, 7}, {0, 3, 7, 4}, {1, 5, 6, 2}};
    uint32_t rings = (uint32_t)sqrtf((float)n / 2);
    struct scene s = mesh_ball(rings, rings, 0.5f);
    uint32_t first = s.num_triangles;
    s.position = realloc(s.position, 3 * (size_t)(first + 10) * sizeof *s.position);
    if (s.position == NULL)
        abort();
    for (size_t i = 0; i < 3 * (size_t)first; i++)
        s.position[i] = scale(sub(s.position[i], v3(0.31f, 0.17f, -0.23f)), 0.45f);
    for (uint32_t i = 0; i < 5; i++)
        for (uint32_t k = 0; k < 6; k++) {
            const float *c = corner[wall[i][k < 3 ? k : k == 3 ? 0 : k - 2]];
            s.position[3 * first + 6 * i + k] = v3(c[0], c[1], c[2]);
        }
    s.num_triangles += 10;
    return s;
}

static const struct {
    const char *name, *course; /* directory below ASSAY_CS184; NULL: not the course's */
    uint32_t ball, terrain;    /* triangles; 0: a file */
} subjects[] = {
    {"18_mirror_box", NULL, 0, 0},
    {"41_cornell", NULL, 0, 0},
    {"CBspheres_lambertian", "sky", 0, 0},
    {"44_mesh", NULL, 0, 0},
    {"CBbunny", "sky", 0, 0},
    {"CBgems", "sky", 0, 0},
    {"cow", "meshedit", 0, 0},
    {"maxplanck", "meshedit", 0, 0},
    {"banana", "keenan", 0, 0},
    {"ball 10^3", NULL, 1000, 0},
    {"ball 10^4", NULL, 10000, 0},
    {"ball 10^5", NULL, 100000, 0},
    {"ball 10^6", NULL, 1000000, 0},
    {"terrain 10^4", NULL, 0, 10000},
    {"terrain 10^6", NULL, 0, 1000000},
};
enum { NUM_SUBJECTS = sizeof subjects / sizeof subjects[0] };

/* False if the file is the course's and not here. */
static bool load_subject(int i, struct subject *of)
{
    *of = (struct subject){.framed = false};
    snprintf(of->name, sizeof of->name, "%s", subjects[i].name);
    if (subjects[i].ball > 0) {
        of->scene = ball_in_box(subjects[i].ball);
        return true;
    }
    if (subjects[i].terrain > 0) {
        of->scene = mesh_terrain((uint32_t)sqrtf((float)subjects[i].terrain / 2), 1);
        return true;
    }
    char path[4096];
    const char *root = getenv("ASSAY_CS184");
    if (subjects[i].course == NULL)
        snprintf(path, sizeof path, "reference/scenes/%s.dae", of->name);
    else
        snprintf(path, sizeof path, "%s/%s/%s.dae", root != NULL ? root : "../shared/scenes/cs184",
                 subjects[i].course, of->name);
    FILE *f = fopen(path, "rb");
    if (f == NULL && subjects[i].course != NULL) {
        printf("SKIPPED: no %s (set ASSAY_CS184)\n", path);
        return false;
    }
    if (f != NULL)
        fclose(f);
    struct err e = {0};
    if (!collada_load(path, subjects[i].course != NULL ? DIALECT_CGL : DIALECT_AUTO, &of->scene,
                      &e)) {
        fprintf(stderr, "bench_rays: %s\n", e.msg);
        exit(3);
    }
    of->framed = true;
    return true;
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

static json_t *json_of(const struct subject *of, const struct result *r)
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

static bool wanted(const char *name, char **names, int n)
{
    for (int i = 0; i < n; i++)
        if (strcmp(name, names[i]) == 0)
            return true;
    return n == 0;
}

int main(int argc, char **argv)
{
    int isa = ISA_AUTO, rounds = 7, at = 1;
    const char *json_path = NULL;
    for (; at + 1 < argc && strncmp(argv[at], "--", 2) == 0; at += 2) {
        if (strcmp(argv[at], "--json") == 0)
            json_path = argv[at + 1];
        else if (strcmp(argv[at], "--rounds") == 0)
            rounds = atoi(argv[at + 1]);
        else if (strcmp(argv[at], "--isa") == 0)
            for (isa = 0; isa_names[isa] != NULL && strcmp(isa_names[isa], argv[at + 1]) != 0;)
                isa++;
        else
            break;
    }
    if ((at < argc && argv[at][0] == '-') || rounds < 1 || rounds > MAX_ROUNDS ||
        isa_names[isa] == NULL) {
        fputs("usage: bench_rays [--isa NAME] [--rounds N] [--json FILE] [SCENE...]\n", stderr);
        return 3;
    }
    setvbuf(stdout, NULL, _IOLBF, 0);
    printf(
        "Ratios of CPU time per ray, Embree's over ours, medians of %d rounds; M rays/s are ours.\n"
        "%-21s %-7s",
        rounds, "scene", "");
    for (int k = 0; k < NUM_SETS; k++)
        printf(" %8s", set_names[k]);
    printf("   build  Mtri/s  B/tri\n");
    struct mean trees[2][NUM_SETS] = {{{0}}}, lists[2][NUM_SETS] = {{{0}}}, build = {0};
    json_t *scenes = json_array();
    bool wrong = false;
    for (int i = 0; i < NUM_SUBJECTS; i++) {
        struct subject of;
        if (!wanted(subjects[i].name, argv + at, argc - at) || !load_subject(i, &of))
            continue;
        struct result r = measure(&of, (enum isa)isa, rounds);
        wrong |= r.wrong;
        if (!r.wrong) {
            print_row(of.name, "embree", r.ratio);
            printf("  %6.2f %7.2f %6.1f\n", r.build, r.mtri_per_s, r.bytes_per_triangle);
            print_row("", "robust", r.robust);
            putchar('\n');
            print_row("", "Mrays/s", r.mrays);
            putchar('\n');
            print_row("", "nodes", r.nodes);
            putchar('\n');
            print_row("", "leaves", r.leaves);
            putchar('\n');
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
    puts("Trees");
    print_means("trees", trees);
    puts("Lists of up to 32 primitives");
    print_means("lists", lists);
    printf("build: %.2f, the least %.2f\n", mean_of(&build), build.worst);
    json_t *all =
        json_pack("{s:s,s:i,s:o}", "isa", isa_names[isa], "rounds", rounds, "scenes", scenes);
    if (json_path != NULL && json_dump_file(all, json_path, JSON_INDENT(1)) != 0) {
        fprintf(stderr, "bench_rays: cannot write %s\n", json_path);
        return 3;
    }
    json_decref(all);
    return wrong;
}
