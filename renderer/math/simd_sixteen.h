/* Sixteen lanes on the compiler's vector extensions (gcc and clang) and AVX-512; results have the same bits as those of
 * simd_eight.h. Part of simd.h, which says what each function does. */
#ifndef ASSAY_SIMD_SIXTEEN_H
#define ASSAY_SIMD_SIXTEEN_H

#include <immintrin.h>

INLINE vf vf_set(float x)
{
    return (vf)_mm512_set1_ps(x);
}
INLINE vi vi_set(int32_t x)
{
    return (vi)_mm512_set1_epi32(x);
}
INLINE vi vi_numbers(void)
{
    return (vi){0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
}
INLINE vi vi_divide(vi a, int by)
{
    __m256i half[2] = {_mm512_castsi512_si256((__m512i)a),
                       _mm512_extracti64x4_epi64((__m512i)a, 1)};
    for (int i = 0; i < 2; i++)
        half[i] = _mm512_cvttpd_epi32((_mm512_cvtepi32_pd(half[i]) + 0.5) * (1.0 / by));
    return (vi)_mm512_inserti64x4(_mm512_castsi256_si512(half[0]), half[1], 1);
}
INLINE vf vf_min(vf a, vf b)
{
    return (vf)_mm512_min_ps((__m512)a, (__m512)b);
}
INLINE vf vf_max(vf a, vf b)
{
    return (vf)_mm512_max_ps((__m512)a, (__m512)b);
}
INLINE float vf_least(vf a)
{
    return _mm512_reduce_min_ps((__m512)a);
}
INLINE vf vf_sqrt(vf a)
{
    return (vf)_mm512_sqrt_ps((__m512)a);
}
INLINE vf vf_hypot(vf a, vf b)
{
    __m256 r[2];
    for (int i = 0; i < 2; i++) {
        __m512d x = _mm512_cvtps_pd(i ? _mm512_extractf32x8_ps((__m512)a, 1)
                                      : _mm512_castps512_ps256((__m512)a));
        __m512d y = _mm512_cvtps_pd(i ? _mm512_extractf32x8_ps((__m512)b, 1)
                                      : _mm512_castps512_ps256((__m512)b));
        r[i] = _mm512_cvtpd_ps(_mm512_sqrt_pd(x * x + y * y));
    }
    return (vf)_mm512_insertf32x8(_mm512_castps256_ps512(r[0]), r[1], 1);
}
INLINE vf mul_sub(vf a, vf b, vf c)
{
    return (vf)_mm512_fmsub_ps((__m512)a, (__m512)b, (__m512)c);
}
INLINE vf mul_add(vf a, vf b, vf c)
{
    return (vf)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c);
}
INLINE vm lanes_of(unsigned mask)
{
    return (vm)mask;
}
INLINE unsigned bits(vm mask)
{
    return mask & ALL_LANES;
}
INLINE vm vf_lt(vf a, vf b)
{
    return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ);
}
INLINE vm vf_le(vf a, vf b)
{
    return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LE_OQ);
}
INLINE vm vf_eq(vf a, vf b)
{
    return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_EQ_OQ);
}
INLINE vm vi_lt(vi a, vi b)
{
    return _mm512_cmplt_epi32_mask((__m512i)a, (__m512i)b);
}
INLINE vm vi_eq(vi a, vi b)
{
    return _mm512_cmpeq_epi32_mask((__m512i)a, (__m512i)b);
}
INLINE vf vf_select(vm mask, vf yes, vf no)
{
    return (vf)_mm512_mask_blend_ps(mask, (__m512)no, (__m512)yes);
}
INLINE vm vm_set(bool on)
{
    return on ? ALL_LANES : 0;
}
INLINE vi vi_where(vm mask, vi a)
{
    return (vi)_mm512_maskz_mov_epi32(mask, (__m512i)a);
}
INLINE vi front_order(unsigned mask)
{
    return (vi)_mm512_maskz_compress_epi32((__mmask16)mask, (__m512i)vi_numbers());
}
INLINE vf pick(vf a, vi order)
{
    return (vf)_mm512_permutexvar_ps((__m512i)order, (__m512)a);
}
INLINE void store_flags(void *flags, vm mask)
{
    _mm_storeu_si128(flags, _mm_maskz_set1_epi8(mask, 1));
}
INLINE unsigned spread_flags(const void *flags, unsigned mask)
{
    const __m128i set = _mm_loadu_si128(flags);
    return _pdep_u32(_mm_test_epi8_mask(set, set), mask);
}

/* Reverses each byte by table look-ups of its two nibbles, then the order of bytes in each number. */
INLINE vu vu_reverse_bits(vu a)
{
    const __m512i nibbles = _mm512_set4_epi32(0x0F070B03, 0x0D050901, 0x0E060A02, 0x0C040800);
    const __m512i bytes = _mm512_set4_epi32(0x0C0D0E0F, 0x08090A0B, 0x04050607, 0x00010203);
    __m512i low = _mm512_shuffle_epi8(_mm512_slli_epi32(nibbles, 4), (__m512i)(a & 0x0F0F0F0F));
    __m512i high = _mm512_shuffle_epi8(nibbles, (__m512i)(a >> 4 & 0x0F0F0F0F));
    return (vu)_mm512_shuffle_epi8(low | high, bytes);
}

typedef struct {
    __m512i even, odd;
} vw;
INLINE vw vw_of(vu a)
{
    return (vw){(__m512i)a, _mm512_srli_epi64((__m512i)a, 32)};
}
INLINE vu vu_of(vw a)
{
    return (vu)_mm512_mask_blend_epi32(0xAAAA, a.even, _mm512_slli_epi64(a.odd, 32));
}
INLINE vw vw_mul(vw a, uint32_t k)
{
    const __m512i by = _mm512_set1_epi64(k);
    return (vw){_mm512_mul_epu32(a.even, by), _mm512_mul_epu32(a.odd, by)};
}
INLINE vw vw_high(vw a)
{
    return (vw){_mm512_srli_epi64(a.even, 32), _mm512_srli_epi64(a.odd, 32)};
}
INLINE vw vw_xor(vw a, vw b, uint32_t k)
{
    const __m512i c = _mm512_set1_epi64(k);
    return (vw){_mm512_ternarylogic_epi64(a.even, b.even, c, 0x96),
                _mm512_ternarylogic_epi64(a.odd, b.odd, c, 0x96)};
}

/* Loads sixteen rows of eight, two to a register, and transposes them by blocks of 4 x 4. */
INLINE void gather_columns(const float *base, size_t stride, const int32_t index[LANES],
                           vf column[COLUMNS])
{
    __m512 block[2][4];
    for (int half = 0; half < 2; half++) {
        __m512 a[4];
        for (int i = 0; i < 4; i++) {
            const int32_t *at = index + 8 * half + i;
            a[i] = _mm512_castps256_ps512(_mm256_loadu_ps(base + stride * (size_t)at[0]));
            a[i] = _mm512_insertf32x8(a[i], _mm256_loadu_ps(base + stride * (size_t)at[4]), 1);
        }
        __m512 low01 = _mm512_unpacklo_ps(a[0], a[1]), low23 = _mm512_unpacklo_ps(a[2], a[3]);
        __m512 high01 = _mm512_unpackhi_ps(a[0], a[1]), high23 = _mm512_unpackhi_ps(a[2], a[3]);
        block[half][0] = _mm512_shuffle_ps(low01, low23, 0x44);
        block[half][1] = _mm512_shuffle_ps(low01, low23, 0xEE);
        block[half][2] = _mm512_shuffle_ps(high01, high23, 0x44);
        block[half][3] = _mm512_shuffle_ps(high01, high23, 0xEE);
    }
    for (int c = 0; c < 4; c++) {
        column[c] = (vf)_mm512_shuffle_f32x4(block[0][c], block[1][c], 0x88);
        column[4 + c] = (vf)_mm512_shuffle_f32x4(block[0][c], block[1][c], 0xDD);
    }
}

#endif
