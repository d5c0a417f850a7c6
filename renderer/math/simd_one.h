/* One lane: plain numbers. Part of simd.h, which says what each function does. */
#ifndef ASSAY_SIMD_ONE_H
#define ASSAY_SIMD_ONE_H

typedef float vf;
typedef int32_t vi;
typedef int32_t vm;
typedef uint32_t vu;
typedef uint64_t vw;

#define LANE(v, i) (*((void)(i), &(v)))

INLINE vf vf_set(float x)
{
    return x;
}
INLINE vi vi_set(int32_t x)
{
    return x;
}
INLINE vf vf_of_int(vi a)
{
    return (float)a;
}
INLINE vi vi_truncate(vf a)
{
    return (int32_t)a;
}
INLINE vi vi_numbers(void)
{
    return 0;
}
INLINE vi vi_divide(vi a, int by)
{
    return a / by;
}
INLINE vf vf_min(vf a, vf b)
{
    return a < b ? a : b;
}
INLINE vf vf_max(vf a, vf b)
{
    return a > b ? a : b;
}
INLINE vf vf_sqrt(vf a)
{
    return __builtin_sqrtf(a);
}
INLINE vf vf_hypot(vf a, vf b)
{
    return (float)__builtin_sqrt((double)a * (double)a + (double)b * (double)b);
}
INLINE vm vf_lt(vf a, vf b)
{
    return -(a < b);
}
INLINE vm vf_le(vf a, vf b)
{
    return -(a <= b);
}
INLINE vm vf_eq(vf a, vf b)
{
    return -(a == b);
}
INLINE vm vi_lt(vi a, vi b)
{
    return -(a < b);
}
INLINE vm vi_eq(vi a, vi b)
{
    return -(a == b);
}
INLINE vf vf_select(vm mask, vf yes, vf no)
{
    return mask ? yes : no;
}
INLINE unsigned bits(vm mask)
{
    return mask & 1;
}
INLINE vm lanes_of(unsigned mask)
{
    return -(vi)mask;
}
INLINE vm vm_set(bool on)
{
    return -on;
}
INLINE vi vi_where(vm mask, vi a)
{
    return mask & a;
}
INLINE vi front_order(unsigned mask)
{
    (void)mask;
    return 0;
}
INLINE vf pick(vf a, vi order)
{
    (void)order;
    return a;
}
INLINE unsigned spread_flags(const void *flags, unsigned mask)
{
    return mask & *(const unsigned char *)flags;
}
INLINE void store_flags(void *flags, vm mask)
{
    *(unsigned char *)flags = mask & 1;
}
INLINE vu vu_reverse_bits(vu a)
{
    a = a << 16 | a >> 16;
    a = (a & 0x00FF00FFu) << 8 | (a >> 8 & 0x00FF00FFu);
    a = (a & 0x0F0F0F0Fu) << 4 | (a >> 4 & 0x0F0F0F0Fu);
    a = (a & 0x33333333u) << 2 | (a >> 2 & 0x33333333u);
    return (a & 0x55555555u) << 1 | (a >> 1 & 0x55555555u);
}
INLINE vw vw_of(vu a)
{
    return a;
}
INLINE vu vu_of(vw a)
{
    return (vu)a;
}
INLINE vw vw_mul(vw a, uint32_t k)
{
    return (uint64_t)(uint32_t)a * k;
}
INLINE vw vw_high(vw a)
{
    return a >> 32;
}
INLINE vw vw_xor(vw a, vw b, uint32_t k)
{
    return a ^ b ^ k;
}
INLINE void gather_columns(const float *base, size_t stride, const int32_t index[LANES],
                           vf column[COLUMNS])
{
    memcpy(column, base + stride * (size_t)index[0], COLUMNS * sizeof *column);
}

#endif
