/* Embree's copy of a scene's triangles, for tests and benches. */
#ifndef ASSAY_TESTS_EMBREE_MESH_H
#define ASSAY_TESTS_EMBREE_MESH_H

#include "renderer/scene/scene.h"

#include <embree3/rtcore.h>
#include <stdlib.h>

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
