#include "integrator.h"

#include "integrator_simd.h"
#include "renderer/shading/scene_simd.h"

const char *const integrator_kind_names[] = {"path", "normals", NULL};
const char *const direct_kind_names[] = {"hemisphere", "light", "bsdf", "mis", NULL};

bool integrator_prepare(struct integrator *it, struct err *e)
{
    static const struct lanes_kernel *const kernel[] = {[ISA_SCALAR] = &lanes_kernel_scalar,
                                                        [ISA_SSE42] = &lanes_kernel_sse42,
                                                        [ISA_AVX2] = &lanes_kernel_avx2,
                                                        [ISA_AVX512] = &lanes_kernel_avx512};
    enum isa isa = it->opt.isa;
    it->lanes = NULL;
    it->lanes_scene = NULL;
    if (!isa_choose(&isa, e))
        return false;
    it->lanes = kernel[isa];
    return it->opt.kind == INTEGRATE_NORMALS ||
           (it->lanes_scene = lanes_scene_build(it->scene, e)) != NULL;
}

void integrator_free(struct integrator *it)
{
    lanes_scene_free((struct lanes_scene *)it->lanes_scene);
    it->lanes_scene = NULL;
    it->lanes = NULL;
}

void integrate(const struct integrator *it, struct batch *b, int num_lanes)
{
    it->lanes->integrate(it, b, num_lanes);
}
