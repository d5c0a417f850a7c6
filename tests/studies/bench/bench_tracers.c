#include "bench_tracers.h"
#include "bench_timing.h"
#include "embree_mesh.h"

#include <stdio.h>
#include <stdlib.h>

static void embree_trace(const struct tracer *t, const struct ray_set *s, bool shadow,
                         struct answer_key *a)
{
    struct embree_query query;
    embree_query_init(&query);
    for (size_t b = 0; b < ray_set_batches(s); b++) {
        const struct rays *r = &s->batch[b];
        struct hits *h = &a->hit[b];
        for (int i = 0, n = ray_set_size(s, b); i < n; i++) {
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
                embree_occluded(t->scene, &query, &q.ray);
                a->occluded[b][i] = q.ray.tfar < 0;
                continue;
            }
            q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            embree_intersect(t->scene, &query, &q);
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
                      struct answer_key *a, struct bvh_stats *stats)
{
    uint16_t lane[BATCH_LANES];
    for (int i = 0; i < BATCH_LANES; i++)
        lane[i] = (uint16_t)i;
    for (size_t b = 0; b < ray_set_batches(s); b++)
        if (shadow)
            bvh_occluded(t->bvh, &s->batch[b], lane, ray_set_size(s, b), a->occluded[b], stats);
        else
            bvh_closest(t->bvh, &s->batch[b], lane, ray_set_size(s, b), &a->hit[b], stats);
}

double tracer_run(const struct tracer *t, const struct ray_set *s, bool shadow,
                  struct answer_key *a, struct bvh_stats *stats)
{
    double start = bench_cpu_seconds();
    if (t->bvh != NULL)
        our_trace(t, s, shadow, a, stats);
    else
        embree_trace(t, s, shadow, a);
    return bench_cpu_seconds() - start;
}

static bool count_bytes(void *sum, ssize_t bytes, bool post)
{
    (void)post;
    *(size_t *)sum += (size_t)bytes;
    return true;
}

struct tracer tracer_embree(const char *name, const struct scene *s, enum RTCSceneFlags flags)
{
    struct tracer t = {.name = name, .num_triangles = s->num_triangles};
    t.device = rtcNewDevice("threads=1,set_affinity=0");
    t.scene = rtcNewScene(t.device);
    rtcSetSceneFlags(t.scene, flags);
    embree_attach_triangles(t.device, t.scene, s);
    if (s->num_spheres > 0) {
        RTCGeometry g = rtcNewGeometry(t.device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
        float *v = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4,
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
    double start = bench_cpu_seconds();
    rtcCommitScene(t.scene);
    t.build_seconds = bench_cpu_seconds() - start;
    rtcSetDeviceMemoryMonitorFunction(t.device, NULL, NULL);
    if (rtcGetDeviceError(t.device) != RTC_ERROR_NONE)
        abort();
    return t;
}

struct tracer tracer_ours(const struct scene *s, enum isa isa)
{
    struct err e = {0};
    struct tracer t = {.name = "wide", .num_triangles = s->num_triangles};
    double start = bench_cpu_seconds();
    t.bvh = bvh_build_on(s, BVH_WIDE, isa, 1, &e);
    t.build_seconds = bench_cpu_seconds() - start;
    if (t.bvh == NULL) {
        fprintf(stderr, "bench: %s\n", e.msg);
        exit(3);
    }
    t.bytes = bvh_size(t.bvh);
    return t;
}

void tracer_free(struct tracer *t)
{
    if (t->bvh != NULL) {
        bvh_free(t->bvh);
        return;
    }
    rtcReleaseScene(t->scene);
    rtcReleaseDevice(t->device);
}
