/* Embree, of version 3 or 4 (embree4 where both are there), for tests and benches: its copy of a scene's triangles, and its queries. */
#ifndef ASSAY_TESTS_EMBREE_MESH_H
#define ASSAY_TESTS_EMBREE_MESH_H

#include "renderer/scene/scene.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <stdlib.h>

/* What goes with many queries: what version 3 calls a context, and 4 calls arguments. */
#if RTC_VERSION_MAJOR >= 4
struct embree_query {
    struct RTCIntersectArguments nearest;
    struct RTCOccludedArguments any;
};
static inline void embree_query_init(struct embree_query *q)
{
    rtcInitIntersectArguments(&q->nearest);
    rtcInitOccludedArguments(&q->any);
}
static inline void embree_intersect(RTCScene scene, struct embree_query *q, struct RTCRayHit *h)
{
    rtcIntersect1(scene, h, &q->nearest);
}
static inline void embree_occluded(RTCScene scene, struct embree_query *q, struct RTCRay *r)
{
    rtcOccluded1(scene, r, &q->any);
}
#else
struct embree_query {
    struct RTCIntersectContext context;
};
static inline void embree_query_init(struct embree_query *q)
{
    rtcInitIntersectContext(&q->context);
}
static inline void embree_intersect(RTCScene scene, struct embree_query *q, struct RTCRayHit *h)
{
    rtcIntersect1(scene, &q->context, h);
}
static inline void embree_occluded(RTCScene scene, struct embree_query *q, struct RTCRay *r)
{
    rtcOccluded1(scene, &q->context, r);
}
#endif

/* Attaches all triangles of s as geometry 0; primitive i is triangle i. The scene is not committed. */
static inline void embree_attach_triangles(RTCDevice device, RTCScene scene, const struct scene *s)
{
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    size_t n = s->num_triangles;
    float *v = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                       3 * sizeof(float), 3 * n);
    unsigned *index = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              3 * sizeof(unsigned), n);
    if (n > 0 && (v == NULL || index == NULL))
        abort();
    for (size_t i = 0; i < 3 * n; i++) {
        v[3 * i] = s->position[i].x;
        v[3 * i + 1] = s->position[i].y;
        v[3 * i + 2] = s->position[i].z;
        index[i] = (unsigned)i;
    }
    rtcCommitGeometry(g);
    rtcAttachGeometryByID(scene, g, 0);
    rtcReleaseGeometry(g);
}

#endif
