/* Eight lanes of float or of int32 on the compiler's vector extensions (gcc and clang): + - * / and
 * & | ^ ~ are operators, [] reads a lane, the rest is below. The same source compiles for SSE4.2
 * (two halves), AVX2 and AVX-512, and gives the same bits on each except through mul_sub(). Truth is
 * a lane of ones. This is the one file with intrinsics. */
#ifndef ASSAY_SIMD_H
#define ASSAY_SIMD_H

#include <immintrin.h>
#include <stdint.h>
#include <string.h>

enum { LANES = 8 };

typedef float vf __attribute__((vector_size(32)));
typedef int32_t vi __attribute__((vector_size(32)));

/* name_avx2, say: the Makefile defines ISA, once for each set. */
#define FOR_ISA(name)  JOIN(name, ISA)
#define JOIN(a, b)     JOIN_NOW(a, b)
#define JOIN_NOW(a, b) a##_##b

#define INLINE static inline __attribute__((always_inline))

INLINE vf vf_set(float x)
{
    return (vf){x, x, x, x, x, x, x, x};
}
INLINE vi vi_set(int32_t x)
{
    return (vi){x, x, x, x, x, x, x, x};
}
/* p aligned to 32 bytes. */
INLINE vf vf_load(const float *p)
{
    return *(const vf *)p;
}
INLINE void vf_store(float *p, vf a)
{
    *(vf *)p = a;
}
INLINE vf vf_abs(vf a)
{
    return (vf)((vi)a & vi_set(INT32_MAX));
}

/* vf_min, vf_max: as minf and maxf, if either is NaN the second wins. any_bits: bit k is set where
 * lane k is true. mul_sub: a b - c, rounded once where the machine can. */
#ifdef __AVX2__
INLINE vf vf_min(vf a, vf b)
{
    return (vf)_mm256_min_ps((__m256)a, (__m256)b);
}
INLINE vf vf_max(vf a, vf b)
{
    return (vf)_mm256_max_ps((__m256)a, (__m256)b);
}
INLINE vf vf_sqrt(vf a)
{
    return (vf)_mm256_sqrt_ps((__m256)a);
}
INLINE vf mul_sub(vf a, vf b, vf c)
{
    return (vf)_mm256_fmsub_ps((__m256)a, (__m256)b, (__m256)c);
}
INLINE vi vf_lt(vf a, vf b)
{
    return (vi)_mm256_cmp_ps((__m256)a, (__m256)b, _CMP_LT_OQ);
}
INLINE vi vf_le(vf a, vf b)
{
    return (vi)_mm256_cmp_ps((__m256)a, (__m256)b, _CMP_LE_OQ);
}
INLINE vi vf_eq(vf a, vf b)
{
    return (vi)_mm256_cmp_ps((__m256)a, (__m256)b, _CMP_EQ_OQ);
}
INLINE vi vi_lt(vi a, vi b)
{
    return (vi)_mm256_cmpgt_epi32((__m256i)b, (__m256i)a);
}
INLINE vi vi_eq(vi a, vi b)
{
    return (vi)_mm256_cmpeq_epi32((__m256i)a, (__m256i)b);
}
INLINE vf vf_select(vi mask, vf yes, vf no)
{
    return (vf)_mm256_blendv_ps((__m256)no, (__m256)yes, (__m256)mask);
}
INLINE unsigned bits(vi mask)
{
    return (unsigned)_mm256_movemask_ps((__m256)mask);
}
#else
union vf_halves {
    vf all;
    __m128 half[2];
};
union vi_halves {
    vi all;
    __m128i half[2];
    __m128 as_float[2];
};
#define BY_HALVES(op, a, b)                                                                        \
    union vf_halves x = {a}, y = {b}, r;                                                           \
    r.half[0] = op(x.half[0], y.half[0]);                                                          \
    r.half[1] = op(x.half[1], y.half[1])
#define BY_HALVES_INT(op, a, b)                                                                    \
    union vi_halves x = {a}, y = {b}, r;                                                           \
    r.half[0] = op(x.half[0], y.half[0]);                                                          \
    r.half[1] = op(x.half[1], y.half[1]);                                                          \
    return r.all
INLINE vf vf_min(vf a, vf b)
{
    BY_HALVES(_mm_min_ps, a, b);
    return r.all;
}
INLINE vf vf_max(vf a, vf b)
{
    BY_HALVES(_mm_max_ps, a, b);
    return r.all;
}
INLINE vf vf_sqrt(vf a)
{
    union vf_halves x = {a};
    x.half[0] = _mm_sqrt_ps(x.half[0]);
    x.half[1] = _mm_sqrt_ps(x.half[1]);
    return x.all;
}
INLINE vf mul_sub(vf a, vf b, vf c)
{
    return a * b - c;
}
INLINE vi vf_lt(vf a, vf b)
{
    BY_HALVES(_mm_cmplt_ps, a, b);
    return (vi)r.all;
}
INLINE vi vf_le(vf a, vf b)
{
    BY_HALVES(_mm_cmple_ps, a, b);
    return (vi)r.all;
}
INLINE vi vf_eq(vf a, vf b)
{
    BY_HALVES(_mm_cmpeq_ps, a, b);
    return (vi)r.all;
}
INLINE vi vi_lt(vi a, vi b)
{
    BY_HALVES_INT(_mm_cmpgt_epi32, b, a);
}
INLINE vi vi_eq(vi a, vi b)
{
    BY_HALVES_INT(_mm_cmpeq_epi32, a, b);
}
INLINE vf vf_select(vi mask, vf yes, vf no)
{
    return (vf)((mask & (vi)yes) | (~mask & (vi)no));
}
INLINE unsigned bits(vi mask)
{
    union vi_halves x = {mask};
    return (unsigned)(_mm_movemask_ps(x.as_float[0]) | _mm_movemask_ps(x.as_float[1]) << 4);
}
#endif

INLINE vi vi_select(vi mask, vi yes, vi no)
{
    return (vi)vf_select(mask, (vf)yes, (vf)no);
}

#endif
