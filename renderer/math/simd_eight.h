/* Eight lanes on the compiler's vector extensions (gcc and clang) and the machine's instructions: the same bits for
 * SSE4.2 (two halves), AVX2 and AVX-512, except through mul_sub() and mul_add(). Part of simd.h, which says what
 * each function does. Intrinsics are in this file and in simd_sixteen.h alone. */
#ifndef ASSAY_SIMD_EIGHT_H
#define ASSAY_SIMD_EIGHT_H

#include <immintrin.h>

INLINE vf vf_set(float x)
{
    return (vf){x, x, x, x, x, x, x, x};
}
INLINE vi vi_set(int32_t x)
{
    return (vi){x, x, x, x, x, x, x, x};
}
INLINE vi vi_numbers(void)
{
    return (vi){0, 1, 2, 3, 4, 5, 6, 7};
}
INLINE vi vi_divide(vi a, int by)
{
    typedef double vd __attribute__((vector_size(64)));
    vd p = __builtin_convertvector(a, vd);
    return __builtin_convertvector((p + 0.5) * (1.0 / by), vi);
}

/* mul_sub: a b - c, mul_add: a b + c; fused (rounded once) where the machine has FMA. */
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
INLINE vf vf_hypot(vf a, vf b)
{
    __m128 r[2];
    for (int i = 0; i < 2; i++) {
        __m128 ah = i ? _mm256_extractf128_ps((__m256)a, 1) : _mm256_castps256_ps128((__m256)a);
        __m128 bh = i ? _mm256_extractf128_ps((__m256)b, 1) : _mm256_castps256_ps128((__m256)b);
        __m256d x = _mm256_cvtps_pd(ah), y = _mm256_cvtps_pd(bh);
        r[i] = _mm256_cvtpd_ps(_mm256_sqrt_pd(x * x + y * y));
    }
    return (vf)_mm256_set_m128(r[1], r[0]);
}
INLINE vf mul_sub(vf a, vf b, vf c)
{
    return (vf)_mm256_fmsub_ps((__m256)a, (__m256)b, (__m256)c);
}
INLINE vf mul_add(vf a, vf b, vf c)
{
    return (vf)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
}
INLINE vm vf_lt(vf a, vf b)
{
    return (vi)_mm256_cmp_ps((__m256)a, (__m256)b, _CMP_LT_OQ);
}
INLINE vm vf_le(vf a, vf b)
{
    return (vi)_mm256_cmp_ps((__m256)a, (__m256)b, _CMP_LE_OQ);
}
INLINE vm vf_eq(vf a, vf b)
{
    return (vi)_mm256_cmp_ps((__m256)a, (__m256)b, _CMP_EQ_OQ);
}
INLINE vm vi_lt(vi a, vi b)
{
    return (vi)_mm256_cmpgt_epi32((__m256i)b, (__m256i)a);
}
INLINE vm vi_eq(vi a, vi b)
{
    return (vi)_mm256_cmpeq_epi32((__m256i)a, (__m256i)b);
}
INLINE vf vf_select(vm mask, vf yes, vf no)
{
    return (vf)_mm256_blendv_ps((__m256)no, (__m256)yes, (__m256)mask);
}
INLINE unsigned bits(vm mask)
{
    return (unsigned)_mm256_movemask_ps((__m256)mask);
}
/* front_order() and spread_flags() look up four lanes at a time: pdep and pext would be shorter, but AMD's processors
 * before Zen 3 take them bit by bit. */
INLINE vi front_order(unsigned mask)
{
    static const uint32_t low[16] = {0, 0,     1,     0x100,   2,     0x200,   0x201,   0x20100,
                                     3, 0x300, 0x301, 0x30100, 0x302, 0x30200, 0x30201, 0x3020100},
                          high[16] = {0, 4,     5,     0x504,   6,     0x604,   0x605,   0x60504,
                                      7, 0x704, 0x705, 0x70504, 0x706, 0x70604, 0x70605, 0x7060504};
    const int bits_below = 8 * __builtin_popcount(mask & 15);
    const uint64_t order = low[mask & 15] | (uint64_t)high[mask >> 4] << bits_below;
    return (vi)_mm256_cvtepu8_epi32(_mm_cvtsi64_si128((long long)order));
}
INLINE vf pick(vf a, vi order)
{
    return (vf)_mm256_permutevar8x32_ps((__m256)a, (__m256i)order);
}
INLINE vi shuffle_bytes(vi table, vi which)
{
    return (vi)_mm256_shuffle_epi8((__m256i)table, (__m256i)which);
}
/* pdep of four bits: bit k of b goes to the k-th lowest set bit of m. */
#define SPREAD(m, b)                                                                               \
    (((m)&1 & (b)) | ((m)&2 & (b) >> ((m)&1) << 1) |                                               \
     ((m)&4 & (b) >> (((m)&1) + ((m) >> 1 & 1)) << 2) |                                            \
     ((m)&8 & (b) >> (((m)&1) + ((m) >> 1 & 1) + ((m) >> 2 & 1)) << 3))
#define SPREAD_4(m, b) SPREAD(m, b), SPREAD(m, (b) + 1), SPREAD(m, (b) + 2), SPREAD(m, (b) + 3)
#define SPREAD_16(m)   SPREAD_4(m, 0), SPREAD_4(m, 4), SPREAD_4(m, 8), SPREAD_4(m, 12)
#define SPREAD_64(m)   SPREAD_16(m), SPREAD_16((m) + 1), SPREAD_16((m) + 2), SPREAD_16((m) + 3)
INLINE unsigned spread_flags(const void *flags, unsigned mask)
{
    static const uint8_t spread[256] = {SPREAD_64(0), SPREAD_64(4), SPREAD_64(8), SPREAD_64(12)};
    const __m128i bytes = _mm_slli_epi16(_mm_loadl_epi64(flags), 7);
    const unsigned packed = (unsigned)_mm_movemask_epi8(bytes) & 255;
    const unsigned next = packed >> __builtin_popcount(mask & 15);
    const unsigned low = spread[(mask & 15) << 4 | (packed & 15)];
    return low | (unsigned)spread[(mask & 0xf0) | (next & 15)] << 4;
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
INLINE vf vf_hypot(vf a, vf b)
{
    vf r;
    for (int i = 0; i < LANES; i++)
        r[i] = (float)__builtin_sqrt((double)a[i] * (double)a[i] + (double)b[i] * (double)b[i]);
    return r;
}
INLINE vf mul_sub(vf a, vf b, vf c)
{
    return a * b - c;
}
INLINE vf mul_add(vf a, vf b, vf c)
{
    return a * b + c;
}
INLINE vm vf_lt(vf a, vf b)
{
    BY_HALVES(_mm_cmplt_ps, a, b);
    return (vi)r.all;
}
INLINE vm vf_le(vf a, vf b)
{
    BY_HALVES(_mm_cmple_ps, a, b);
    return (vi)r.all;
}
INLINE vm vf_eq(vf a, vf b)
{
    BY_HALVES(_mm_cmpeq_ps, a, b);
    return (vi)r.all;
}
INLINE vm vi_lt(vi a, vi b)
{
    BY_HALVES_INT(_mm_cmpgt_epi32, b, a);
}
INLINE vm vi_eq(vi a, vi b)
{
    BY_HALVES_INT(_mm_cmpeq_epi32, a, b);
}
INLINE vf vf_select(vm mask, vf yes, vf no)
{
    return (vf)((mask & (vi)yes) | (~mask & (vi)no));
}
INLINE unsigned bits(vm mask)
{
    union vi_halves x = {mask};
    return (unsigned)(_mm_movemask_ps(x.as_float[0]) | _mm_movemask_ps(x.as_float[1]) << 4);
}
INLINE vi front_order(unsigned mask)
{
    int32_t order[LANES] = {0};
    for (int n = 0; mask; mask &= mask - 1)
        order[n++] = __builtin_ctz(mask);
    vi v;
    memcpy(&v, order, sizeof v);
    return v;
}
INLINE vf pick(vf a, vi order)
{
    return (vf){a[order[0]], a[order[1]], a[order[2]], a[order[3]],
                a[order[4]], a[order[5]], a[order[6]], a[order[7]]};
}
INLINE vi shuffle_bytes(vi table, vi which)
{
    BY_HALVES_INT(_mm_shuffle_epi8, table, which);
}
INLINE unsigned spread_flags(const void *flags, unsigned mask)
{
    const unsigned char *flag = flags;
    unsigned set = 0;
    for (; mask; mask &= mask - 1)
        set |= *flag++ ? mask & -mask : 0;
    return set;
}
#endif

INLINE float vf_least(vf a)
{
    a = vf_min(a, __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3));
    a = vf_min(a, __builtin_shufflevector(a, a, 2, 3, 0, 1, 6, 7, 4, 5));
    a = vf_min(a, __builtin_shufflevector(a, a, 1, 0, 3, 2, 5, 4, 7, 6));
    return a[0];
}
INLINE vm lanes_of(unsigned mask)
{
    const vi bit = {1, 2, 4, 8, 16, 32, 64, 128};
    return vi_eq(vi_set((int32_t)mask) & bit, bit);
}
INLINE vm vm_set(bool on)
{
    return vi_set(-on);
}
INLINE vi vi_where(vm mask, vi a)
{
    return mask & a;
}
/* Bits as eight bytes of 0 or 1, the lowest first. */
INLINE uint64_t bytes_of(unsigned mask)
{
    return ((mask & 127) * 0x0002040810204081u & 0x0101010101010101u) | (uint64_t)(mask >> 7) << 56;
}
INLINE void store_flags(void *flags, vm mask)
{
    const uint64_t bytes = bytes_of(bits(mask));
    memcpy(flags, &bytes, sizeof bytes);
}

/* Reverses each byte by table look-ups of its two nibbles, then the order of bytes in each number. */
INLINE vu vu_reverse_bits(vu a)
{
    const vi nibbles = {0x0C040800, 0x0E060A02, 0x0D050901, 0x0F070B03,
                        0x0C040800, 0x0E060A02, 0x0D050901, 0x0F070B03};
    const vi bytes = {0x00010203, 0x04050607, 0x08090A0B, 0x0C0D0E0F,
                      0x00010203, 0x04050607, 0x08090A0B, 0x0C0D0E0F};
    vi low = shuffle_bytes(nibbles << 4, (vi)a & 0x0F0F0F0F);
    vi high = shuffle_bytes(nibbles, (vi)(a >> 4) & 0x0F0F0F0F);
    return (vu)shuffle_bytes(low | high, bytes);
}

#ifdef __AVX512F__
typedef struct {
    __m512i v;
} vw;
INLINE vw vw_of(vu a)
{
    return (vw){_mm512_cvtepu32_epi64((__m256i)a)};
}
INLINE vu vu_of(vw a)
{
    return (vu)_mm512_cvtepi64_epi32(a.v);
}
INLINE vw vw_mul(vw a, uint32_t k)
{
    return (vw){_mm512_mul_epu32(a.v, _mm512_set1_epi64(k))};
}
INLINE vw vw_high(vw a)
{
    return (vw){_mm512_srli_epi64(a.v, 32)};
}
INLINE vw vw_xor(vw a, vw b, uint32_t k)
{
    return (vw){_mm512_xor_si512(_mm512_xor_si512(a.v, b.v), _mm512_set1_epi64(k))};
}
#elif defined __AVX2__
typedef struct {
    __m256i even, odd;
} vw;
INLINE vw vw_of(vu a)
{
    return (vw){(__m256i)a, _mm256_srli_epi64((__m256i)a, 32)};
}
INLINE vu vu_of(vw a)
{
    return (vu)_mm256_blend_epi32(a.even, _mm256_slli_epi64(a.odd, 32), 0xAA);
}
INLINE vw vw_mul(vw a, uint32_t k)
{
    const __m256i by = _mm256_set1_epi64x(k);
    return (vw){_mm256_mul_epu32(a.even, by), _mm256_mul_epu32(a.odd, by)};
}
INLINE vw vw_high(vw a)
{
    return (vw){_mm256_srli_epi64(a.even, 32), _mm256_srli_epi64(a.odd, 32)};
}
INLINE vw vw_xor(vw a, vw b, uint32_t k)
{
    const __m256i c = _mm256_set1_epi64x(k);
    return (vw){_mm256_xor_si256(_mm256_xor_si256(a.even, b.even), c),
                _mm256_xor_si256(_mm256_xor_si256(a.odd, b.odd), c)};
}
#else
typedef struct {
    __m128i even[2], odd[2];
} vw;
INLINE vw vw_of(vu a)
{
    union vi_halves x = {(vi)a};
    vw w;
    for (int i = 0; i < 2; i++) {
        w.even[i] = x.half[i];
        w.odd[i] = _mm_srli_epi64(x.half[i], 32);
    }
    return w;
}
INLINE vu vu_of(vw a)
{
    union vi_halves x;
    for (int i = 0; i < 2; i++)
        x.half[i] = _mm_blend_epi16(a.even[i], _mm_slli_epi64(a.odd[i], 32), 0xCC);
    return (vu)x.all;
}
INLINE vw vw_mul(vw a, uint32_t k)
{
    const __m128i by = _mm_set1_epi64x(k);
    for (int i = 0; i < 2; i++) {
        a.even[i] = _mm_mul_epu32(a.even[i], by);
        a.odd[i] = _mm_mul_epu32(a.odd[i], by);
    }
    return a;
}
INLINE vw vw_high(vw a)
{
    for (int i = 0; i < 2; i++) {
        a.even[i] = _mm_srli_epi64(a.even[i], 32);
        a.odd[i] = _mm_srli_epi64(a.odd[i], 32);
    }
    return a;
}
INLINE vw vw_xor(vw a, vw b, uint32_t k)
{
    const __m128i c = _mm_set1_epi64x(k);
    for (int i = 0; i < 2; i++) {
        a.even[i] = _mm_xor_si128(_mm_xor_si128(a.even[i], b.even[i]), c);
        a.odd[i] = _mm_xor_si128(_mm_xor_si128(a.odd[i], b.odd[i]), c);
    }
    return a;
}
#endif

/* Loads eight rows of eight and transposes them. */
INLINE void gather_columns(const float *base, size_t stride, const int32_t index[LANES],
                           vf column[COLUMNS])
{
    vf a[LANES], b[LANES];
    for (int i = 0; i < LANES; i++) {
        vf row; /* not a[i]: an array whose address is taken would stay in memory */
        memcpy(&row, base + stride * (size_t)index[i], sizeof row);
        a[i] = row;
    }
    for (int i = 0; i < LANES; i += 2) {
        b[i] = __builtin_shufflevector(a[i], a[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
        b[i + 1] = __builtin_shufflevector(a[i], a[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
    }
    for (int i = 0; i < LANES; i += 4) {
        a[i] = __builtin_shufflevector(b[i], b[i + 2], 0, 1, 8, 9, 4, 5, 12, 13);
        a[i + 1] = __builtin_shufflevector(b[i], b[i + 2], 2, 3, 10, 11, 6, 7, 14, 15);
        a[i + 2] = __builtin_shufflevector(b[i + 1], b[i + 3], 0, 1, 8, 9, 4, 5, 12, 13);
        a[i + 3] = __builtin_shufflevector(b[i + 1], b[i + 3], 2, 3, 10, 11, 6, 7, 14, 15);
    }
    for (int i = 0; i < 4; i++) {
        column[i] = __builtin_shufflevector(a[i], a[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        column[i + 4] = __builtin_shufflevector(a[i], a[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
}

#endif
