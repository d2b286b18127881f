/* foc_tiles.h: four sums over four samples at a time, for foc_ahead.h.
 *
 * SPDX-License-Identifier: 0BSD
 *
 * foc_tiles_X(sum, weights, x, tiles): for sample j = 0 ... 4 * tiles - 1, oldest first, and each of the sums
 * i = 0 ... 3:  sum[i] += weights[j + 4 - i] * x[j].
 *
 * The C below says what is computed, and serves every core and compiler; foc_tiles_arm.h has the same in
 * the instructions of a core, bit for bit. GCC and clang tell by their own macros which core that is.
 */
#ifndef FOC_TILES_H
#define FOC_TILES_H

#include "foc_rt.h"

/* Generated files ask for the version they were written for. */
#define FOC_TILES_VERSION 1

/* A table that is read by words: its first entry stands at one. */
#ifdef __GNUC__
#define FOC_WORDS __attribute__((aligned(4)))
#else
#define FOC_WORDS
#endif

#if defined(__GNUC__) && defined(__thumb__) && defined(__ARM_ARCH_PROFILE) && !defined(__ARM_BIG_ENDIAN)
#if __ARM_ARCH_PROFILE == 'M'
#include "foc_tiles_arm.h"
#endif
#endif

#ifndef FOC_HAS_TILES_Q15
static inline void foc_tiles_q15(int32_t *sum, const FOC_ROM int16_t *weights, const int16_t *x,
                                 unsigned tiles)
{
    int32_t s0 = sum[0], s1 = sum[1], s2 = sum[2], s3 = sum[3];
    int32_t a = weights[1], b = weights[2], c = weights[3], d; /* the weights that the next sample meets */

    weights += 4;
    for (; tiles > 0u; tiles--) {
        d = weights[0];
        s0 += d * x[0];
        s1 += c * x[0];
        s2 += b * x[0];
        s3 += a * x[0];
        a = weights[1];
        s0 += a * x[1];
        s1 += d * x[1];
        s2 += c * x[1];
        s3 += b * x[1];
        b = weights[2];
        s0 += b * x[2];
        s1 += a * x[2];
        s2 += d * x[2];
        s3 += c * x[2];
        c = weights[3];
        s0 += c * x[3];
        s1 += b * x[3];
        s2 += a * x[3];
        s3 += d * x[3];
        weights += 4;
        x += 4;
    }
    sum[0] = s0;
    sum[1] = s1;
    sum[2] = s2;
    sum[3] = s3;
}
#endif

#ifndef FOC_HAS_TILES_Q31
static inline void foc_tiles_q31(int64_t *sum, const FOC_ROM int32_t *weights, const int32_t *x,
                                 unsigned tiles)
{
    int64_t s0 = sum[0], s1 = sum[1], s2 = sum[2], s3 = sum[3];
    int32_t a = weights[1], b = weights[2], c = weights[3], d; /* the weights that the next sample meets */

    weights += 4;
    for (; tiles > 0u; tiles--) {
        d = weights[0];
        s0 += (int64_t)d * x[0];
        s1 += (int64_t)c * x[0];
        s2 += (int64_t)b * x[0];
        s3 += (int64_t)a * x[0];
        a = weights[1];
        s0 += (int64_t)a * x[1];
        s1 += (int64_t)d * x[1];
        s2 += (int64_t)c * x[1];
        s3 += (int64_t)b * x[1];
        b = weights[2];
        s0 += (int64_t)b * x[2];
        s1 += (int64_t)a * x[2];
        s2 += (int64_t)d * x[2];
        s3 += (int64_t)c * x[2];
        c = weights[3];
        s0 += (int64_t)c * x[3];
        s1 += (int64_t)b * x[3];
        s2 += (int64_t)a * x[3];
        s3 += (int64_t)d * x[3];
        weights += 4;
        x += 4;
    }
    sum[0] = s0;
    sum[1] = s1;
    sum[2] = s2;
    sum[3] = s3;
}
#endif

#ifndef FOC_HAS_TILES_F32
static inline void foc_tiles_f32(float *sum, const FOC_ROM float *weights, const float *x, unsigned tiles)
{
    float s0 = sum[0], s1 = sum[1], s2 = sum[2], s3 = sum[3];
    float a = weights[1], b = weights[2], c = weights[3], d; /* the weights that the next sample meets */

    weights += 4;
    for (; tiles > 0u; tiles--) {
        d = weights[0];
        s0 += d * x[0];
        s1 += c * x[0];
        s2 += b * x[0];
        s3 += a * x[0];
        a = weights[1];
        s0 += a * x[1];
        s1 += d * x[1];
        s2 += c * x[1];
        s3 += b * x[1];
        b = weights[2];
        s0 += b * x[2];
        s1 += a * x[2];
        s2 += d * x[2];
        s3 += c * x[2];
        c = weights[3];
        s0 += c * x[3];
        s1 += b * x[3];
        s2 += a * x[3];
        s3 += d * x[3];
        weights += 4;
        x += 4;
    }
    sum[0] = s0;
    sum[1] = s1;
    sum[2] = s2;
    sum[3] = s3;
}
#endif

#endif
