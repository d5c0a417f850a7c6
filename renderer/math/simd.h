/* Lanes of float or of int32: vf, vi and vu (unsigned) hold LANES numbers each: one, eight or sixteen, set by the
 * Makefile. + - * / and & | ^ ~ work on them as operators, LANE() accesses one lane, the rest is below. The same source
 * gives a lane the same bits at every width.
 *
 * A mask, vm, is what comparisons give: bits in a mask register with sixteen lanes, else lanes of all ones or zeros.
 * & | ~ work on masks as operators; masks and numbers meet only in vf_select(), vi_select() and vi_where().
 *
 * In simd_one.h, simd_eight.h and simd_sixteen.h:
 *   vf_set, vi_set          the same number in all lanes
 *   vf_of_int, vi_truncate  conversions, the latter towards zero, |a| < 2^31
 *   vi_numbers              0, 1, 2, ...
 *   vi_divide               quotients of numbers from 0 to 2^31 - 1 by one int
 *   vf_min, vf_max          as minf and maxf: if either is NaN the second wins
 *   vf_least                the smallest of all lanes, without NaNs; not of one lane
 *   vf_hypot                sqrt(a a + b b), computed in double
 *   vf_lt, vf_le, vf_eq, vi_lt, vi_eq
 *   vf_select, vi_where     one or the other number by a mask; a number or 0
 *   vm_set                  a mask of all lanes, or of none
 *   bits, lanes_of          a mask as an integer, bit k for lane k; and back
 *   front_order, pick       the lanes of a mask, in order; pick() moves these lanes of a vector to the front
 *   store_flags             a mask as bytes of 0 or 1
 *   spread_flags            such bytes for the lanes of a mask alone, in order: as bits of these lanes
 *   vu_reverse_bits         the lowest bit becomes the highest
 *   vw_of, vu_of, vw_mul, vw_high, vw_xor
 *                           numbers of 32 bits in lanes of 64, for products of full length: low halves count, high ones
 *                           may hold anything
 *   gather_columns          column[k] lane i = base[stride * index[i] + k], k < COLUMNS */
#ifndef ASSAY_SIMD_H
#define ASSAY_SIMD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifndef LANES
#define LANES 1
#endif

enum { COLUMNS = 8, ALL_LANES = (1 << LANES) - 1 };

/* For example name_avx2: the Makefile compiles a file once for each instruction set and defines ISA. */
#define FOR_ISA(name)  JOIN(name, ISA)
#define JOIN(a, b)     JOIN_NOW(a, b)
#define JOIN_NOW(a, b) a##_##b

#define INLINE static inline __attribute__((always_inline))

#if LANES > 1
typedef float vf __attribute__((vector_size(4 * LANES)));
typedef int32_t vi __attribute__((vector_size(4 * LANES)));
typedef uint32_t vu __attribute__((vector_size(4 * LANES)));

/* With sanitizers wider than a lane, so that arithmetic on masks and numbers, which C allows, does not compile. */
#if LANES < 16
typedef vi vm;
#elif defined __SANITIZE_ADDRESS__
typedef uint64_t vm;
#else
typedef uint16_t vm;
#endif

/* Lane i, to read or to write. */
#define LANE(v, i) ((v)[i])

/* p aligned as a vector. */
INLINE vf vf_load(const float *p)
{
    return *(const vf *)p;
}
INLINE void vf_store(float *p, vf a)
{
    *(vf *)p = a;
}
INLINE vf vf_of_int(vi a)
{
    return __builtin_convertvector(a, vf);
}
INLINE vi vi_truncate(vf a)
{
    return __builtin_convertvector(a, vi);
}
#endif

#if LANES == 1
#include "simd_one.h"
#elif LANES == 16
#include "simd_sixteen.h"
#else
#include "simd_eight.h"
#endif

/* Mask, as of bits(), of the lanes that hold elements k .. n-1 of a list of n: all LANES, or the first n - k. */
INLINE unsigned lanes_there(int k, int n)
{
    return n - k >= LANES ? (unsigned)ALL_LANES : (1u << (n - k)) - 1;
}
/* The same bits as the other type. */
INLINE vi as_vi(vf a)
{
    vi v;
    memcpy(&v, &a, sizeof v);
    return v;
}
INLINE vf as_vf(vi a)
{
    vf v;
    memcpy(&v, &a, sizeof v);
    return v;
}
/* Load and store without alignment. */
INLINE vf vf_load_any(const void *p)
{
    vf v;
    memcpy(&v, p, sizeof v);
    return v;
}
INLINE void vf_store_any(void *p, vf a)
{
    memcpy(p, &a, sizeof a);
}
INLINE vi vi_load_any(const void *p)
{
    return as_vi(vf_load_any(p));
}
INLINE void vi_store_any(void *p, vi a)
{
    memcpy(p, &a, sizeof a);
}
INLINE vi vi_select(vm mask, vi yes, vi no)
{
    return as_vi(vf_select(mask, as_vf(yes), as_vf(no)));
}
INLINE vf vf_abs(vf a)
{
    return as_vf(as_vi(a) & INT32_MAX);
}
INLINE vu vu_set(uint32_t x)
{
    return (vu)vi_set((int32_t)x);
}

#endif
