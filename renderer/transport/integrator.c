#include "integrator.h"

#include "integrator_simd.h"
#include "renderer/shading/scene_simd.h"

const char *const integrator_kind_names[] = {"path", "normals", NULL};
const char *const direct_kind_names[] = {"hemisphere", "light", "bsdf", "mis", NULL};

bool integrator_prepare(struct integrator *it, struct err *e)
{
    static const struct integrator_simd *const kernel[] = {[ISA_SCALAR] = &integrator_simd_scalar,
                                                           [ISA_SSE42] = &integrator_simd_sse42,
                                                           [ISA_AVX2] = &integrator_simd_avx2,
                                                           [ISA_AVX512] = &integrator_simd_avx512};
    enum isa isa = it->opt.isa;
    it->stages = NULL;
    it->records = NULL;
    if (!isa_choose(&isa, e))
        return false;
    it->stages = kernel[isa];
    return it->opt.kind == INTEGRATE_NORMALS ||
           (it->records = scene_simd_build(it->scene, e)) != NULL;
}

void integrator_free(struct integrator *it)
{
    scene_simd_free((struct scene_simd *)it->records);
    it->records = NULL;
    it->stages = NULL;
}

void integrator_run(const struct integrator *it, struct batch *b, int num_lanes)
{
    it->stages->integrate(it, b, num_lanes);
}
