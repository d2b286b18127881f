/* foc_tune.h: what a controller whose gains and limits may change at run time shares with its like.
 *
 * SPDX-License-Identifier: 0BSD
 *
 * The rules of foc_rt.h hold here, too. A tunable controller keeps its gains in its state, so these read RAM
 * where foc_rt.h reads tables in flash.
 */
#ifndef FOC_TUNE_H
#define FOC_TUNE_H

#include "foc_rt.h"

/* Generated files ask for the version they were written for. */
#define FOC_TUNE_VERSION 2

/* --- Inside a box --------------------------------------------------------------------------------- */

/* 1 where low <= x <= high, which NaN never is. */
static inline uint8_t foc_within16(int16_t x, int16_t low, int16_t high)
{
    return (uint8_t)(x >= low && x <= high);
}

static inline uint8_t foc_within32(int32_t x, int32_t low, int32_t high)
{
    return (uint8_t)(x >= low && x <= high);
}

/* --- Gain schedule -------------------------------------------------------------------------------- */

/* What foc_schedule_... of foc_rt.h gives, from gains and slopes in RAM. */
static inline int16_t foc_tuned_q15(int16_t x, const FOC_ROM int16_t *points, const int16_t *gains,
                                    const int16_t *slopes, const FOC_ROM uint8_t *shifts, uint16_t count)
{
    uint16_t i = 0;

    if (x < points[0]) {
        return gains[0];
    }
    if (x >= points[count - 1u]) {
        return gains[count - 1u];
    }
    while (x >= points[i + 1u]) {
        i++;
    }
    return (int16_t)(gains[i] + foc_shift32(slopes[i] * ((int32_t)x - points[i]), shifts[i]));
}

static inline int32_t foc_tuned_q31(int32_t x, const FOC_ROM int32_t *points, const int32_t *gains,
                                    const int32_t *slopes, const FOC_ROM uint8_t *shifts, uint16_t count)
{
    uint16_t i = 0;

    if (x < points[0]) {
        return gains[0];
    }
    if (x >= points[count - 1u]) {
        return gains[count - 1u];
    }
    while (x >= points[i + 1u]) {
        i++;
    }
    return (int32_t)(gains[i] + foc_shift64(slopes[i] * ((int64_t)x - points[i]), shifts[i]));
}

#endif

/* Floating point, as in foc_rt.h. */
#if !defined(FOC_NO_FLOAT) && !defined(FOC_TUNE_FLOAT_H)
#define FOC_TUNE_FLOAT_H

static inline uint8_t foc_within_f32(float x, float low, float high)
{
    return (uint8_t)(foc_finite_f32(x) && x >= low && x <= high);
}

static inline uint8_t foc_within_f64(double x, double low, double high)
{
    return (uint8_t)(foc_finite_f64(x) && x >= low && x <= high);
}

static inline float foc_tuned_f32(float x, const FOC_ROM float *points, const float *gains,
                                  const float *slopes, uint16_t count)
{
    uint16_t i = 0;

    if (x < points[0]) {
        return gains[0];
    }
    if (x >= points[count - 1u]) {
        return gains[count - 1u];
    }
    while (x >= points[i + 1u]) {
        i++;
    }
    return gains[i] + slopes[i] * (x - points[i]);
}

static inline double foc_tuned_f64(double x, const FOC_ROM double *points, const double *gains,
                                   const double *slopes, uint16_t count)
{
    uint16_t i = 0;

    if (x < points[0]) {
        return gains[0];
    }
    if (x >= points[count - 1u]) {
        return gains[count - 1u];
    }
    while (x >= points[i + 1u]) {
        i++;
    }
    return gains[i] + slopes[i] * (x - points[i]);
}

#endif
