#include "bsdf.h"

#include "renderer/shading/bsdf_simd.h"

static struct materialv material_of(const struct material *m)
{
    float record[MATERIAL_WORDS] = {0};
    struct materialv v;
    scene_simd_material(m, record);
    materials_gather(record, (const int32_t[]){0}, &v);
    return v;
}

rgb bsdf_eval(const struct material *m, vec3 wo, vec3 wi)
{
    const struct materialv v = material_of(m);
    float pdf_w;
    if (m->kind == MATERIAL_DIFFUSE)
        return wo.z > 0 && wi.z > 0 ? eval_diffuse(m->reflectance) : grey(0);
    return bsdf_is_delta(m) ? grey(0)
                            : eval_lobes(&v, -1, eval_diffuse(m->reflectance), wo, wi, &pdf_w);
}

float bsdf_pdf_w(const struct material *m, vec3 wo, vec3 wi)
{
    const struct materialv v = material_of(m);
    float pdf_w = 0;
    if (m->kind == MATERIAL_DIFFUSE)
        return wo.z > 0 && wi.z > 0 ? warp_cosine_hemisphere_pdf_w(wi.z) : 0;
    if (!bsdf_is_delta(m))
        eval_lobes(&v, -1, grey(0), wo, wi, &pdf_w);
    return pdf_w;
}

struct bsdf_sample bsdf_sample_direction(const struct material *m, bool front, vec3 wo, float u,
                                         float v, float lobe)
{
    float record[MATERIAL_WORDS] = {0};
    struct bsdf_samplev s;
    scene_simd_material(m, record);
    sample_lobes(record, (const int32_t[]){0}, 1 << m->kind, m->reflectance, &front, 1, wo,
                 (const float[]){u, v, lobe, 0}, &s);
    return (struct bsdf_sample){
        .wi = s.wi, .weight = s.weight, .pdf_w = s.pdf_w, .delta = s.delta != 0, .eta2 = s.eta2};
}

bool bsdf_is_delta(const struct material *m)
{
    return !(1 << m->kind & MATERIAL_SCATTERS);
}
