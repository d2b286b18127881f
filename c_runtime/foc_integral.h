/* foc_integral.h: integrals of float controllers in whole counts of 64 bits.
 *
 * SPDX-License-Identifier: 0BSD
 *
 * A float that holds a large sum takes in no small addend. A count does: each addend is rounded once, to
 * half a count of 2^-up, and whole numbers add up without any error. The ends of an integral and its addends
 * are at most FOC_MOST, so one of the former and two of the latter cannot overflow (proved).
 */
#ifndef FOC_INTEGRAL_H
#define FOC_INTEGRAL_H

#include <stdint.h>

/* Generated files ask for the version they were written for. */
#define FOC_INTEGRAL_VERSION 2

#define FOC_MOST ((int64_t)1 << 61)

/* Called from several places: one copy in flash is enough. */
#if defined(__GNUC__)
#define FOC_APART __attribute__((noinline))
#else
#define FOC_APART
#endif

/* x * 2^up, the nearest whole number, halves away from zero, at most FOC_MOST; INT64_MIN where x is NaN or
   infinite. From the bits alone: the same on every core, whatever its library rounds like. */
static FOC_APART int64_t foc_counts_f32(float x, int16_t up)
{
    union {
        float value;
        uint32_t bits;
    } view;
    uint32_t exponent, mantissa;
    int64_t n;
    int32_t by;

    view.value = x;
    exponent = (view.bits >> 23) & 0xffu;
    mantissa = view.bits & 0x7fffffu;
    if (exponent == 0xffu) {
        return INT64_MIN;
    }
    if (exponent != 0u) {
        mantissa |= 0x800000u;
        exponent--;
    }
    by = (int32_t)exponent - 149 + up; /* x = mantissa * 2^(by - up) */
    if (by > 37) {
        n = mantissa != 0u ? FOC_MOST : 0;
    } else if (by >= 0) {
        n = (int64_t)mantissa << by;
    } else if (by > -25) {
        n = (int64_t)((mantissa + ((uint32_t)1 << (-by - 1))) >> -by);
    } else {
        n = 0;
    }
    return (view.bits >> 31) != 0u ? -n : n;
}

/* 1 where n is what foc_counts_f32 gives for a number. */
static inline uint8_t foc_held(int64_t n)
{
    return (uint8_t)(n >= -FOC_MOST && n <= FOC_MOST);
}

/* The float nearest to n counts; lsb is 2^-up. */
static inline float foc_value_f32(int64_t n, float lsb)
{
    return (float)n * lsb;
}

/* No number: what follows from a state that no step has left. */
static inline float foc_nothing_f32(void)
{
    union {
        float value;
        uint32_t bits;
    } view;

    view.bits = 0x7fc00000u;
    return view.value;
}

#endif
