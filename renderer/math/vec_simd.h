/* The arithmetic of vec.h on lanes: names end with v. With one lane the types are those of vec.h. */
#ifndef ASSAY_VEC_SIMD_H
#define ASSAY_VEC_SIMD_H

#include "ray_batch.h"
#include "simd.h"

#if LANES == 1
typedef vec3 vec3v;
typedef rgb rgbv;
typedef frame framev;
#else
typedef struct {
    vf x, y, z;
} vec3v;

typedef struct {
    vf r, g, b;
} rgbv;

typedef struct {
    vec3v s, t, n;
} framev;
#endif

/* -a where the mask is set. */
INLINE vf vf_negate_if(vm mask, vf a)
{
    return as_vf(as_vi(a) ^ vi_where(mask, vi_set(INT32_MIN)));
}
INLINE vec3v v3_negate_if(vm mask, vec3v a)
{
    return (vec3v){vf_negate_if(mask, a.x), vf_negate_if(mask, a.y), vf_negate_if(mask, a.z)};
}

#define HOW        INLINE
#define NUMBER     vf
#define VEC3       vec3v
#define RGB        rgbv
#define FRAME      framev
#define OF(name)   name##v
#define ROOT(x)    vf_sqrt(x)
#define SIGN_OF(x) as_vf((as_vi(x) & vi_set(INT32_MIN)) | as_vi(vf_set(1)))
#include "vec_ops.h"

INLINE vec3v v3v(vf x, vf y, vf z)
{
    return (vec3v){x, y, z};
}
/* The same in every lane. */
INLINE vec3v v3_all(vec3 a)
{
    return v3v(vf_set(a.x), vf_set(a.y), vf_set(a.z));
}
INLINE rgbv rgb_all(rgb a)
{
    return (rgbv){vf_set(a.r), vf_set(a.g), vf_set(a.b)};
}
INLINE vec3v v3_select(vm mask, vec3v yes, vec3v no)
{
    return v3v(vf_select(mask, yes.x, no.x), vf_select(mask, yes.y, no.y),
               vf_select(mask, yes.z, no.z));
}
INLINE rgbv rgb_select(vm mask, rgbv yes, rgbv no)
{
    return (rgbv){vf_select(mask, yes.r, no.r), vf_select(mask, yes.g, no.g),
                  vf_select(mask, yes.b, no.b)};
}
/* a where the mask is set, black elsewhere. */
INLINE rgbv rgb_where(vm mask, rgbv a)
{
    return rgb_select(mask, a, rgb_all((rgb){0, 0, 0}));
}
INLINE vf rgb_maxv(rgbv a)
{
    return vf_max(a.r, vf_max(a.g, a.b));
}
INLINE vm rgb_is_zerov(rgbv a)
{
    const vf zero = vf_set(0);
    return vf_eq(a.r, zero) & vf_eq(a.g, zero) & vf_eq(a.b, zero);
}

INLINE vec3 v3_lane(const vec3v *a, int i)
{
    return v3(LANE(a->x, i), LANE(a->y, i), LANE(a->z, i));
}
INLINE void v3_set_lane(vec3v *a, int i, vec3 v)
{
    LANE(a->x, i) = v.x;
    LANE(a->y, i) = v.y;
    LANE(a->z, i) = v.z;
}
INLINE void rgb_set_lane(rgbv *a, int i, rgb v)
{
    LANE(a->r, i) = v.r;
    LANE(a->g, i) = v.g;
    LANE(a->b, i) = v.b;
}

INLINE vec3v v3_load(const struct vec3s *a, int i)
{
    return v3v(vf_load_any(a->x + i), vf_load_any(a->y + i), vf_load_any(a->z + i));
}
INLINE void v3_store(struct vec3s *a, int i, vec3v v)
{
    vf_store_any(a->x + i, v.x);
    vf_store_any(a->y + i, v.y);
    vf_store_any(a->z + i, v.z);
}
INLINE rgbv rgb_load(const struct rgbs *a, int i)
{
    return (rgbv){vf_load_any(a->r + i), vf_load_any(a->g + i), vf_load_any(a->b + i)};
}
INLINE void rgb_store(struct rgbs *a, int i, rgbv v)
{
    vf_store_any(a->r + i, v.r);
    vf_store_any(a->g + i, v.g);
    vf_store_any(a->b + i, v.b);
}

#endif
