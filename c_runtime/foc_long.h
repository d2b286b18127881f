/* foc_long.h: 32-bit history sums for cores that multiply 32 x 32 bits to 32 bits only.
 *
 * SPDX-License-Identifier: 0BSD
 *
 * A Cortex-M0 or M0+ has no instruction for the upper half of a product: compilers call a function for each.
 * foc_m0_q31.h has the sum by hand; the C here serves every other core. The bits are the same.
 */
#ifndef FOC_LONG_H
#define FOC_LONG_H

#include "foc_rt.h"
#include "foc_tiles.h"

/* Generated files ask for the version they were written for. */
#define FOC_LONG_VERSION 2

/* sum += weights[i] * x[i] for i = 0 ... taps-1; taps >= 1. */
#ifndef FOC_HAS_LINE_Q31
static inline void foc_line_q31(int64_t *sum, const FOC_ROM int32_t *weights, const int32_t *x,
                                unsigned taps)
{
    int64_t total = *sum;
    unsigned i;

    for (i = 0; i < taps; i++) {
        total += (int64_t)weights[i] * x[i];
    }
    *sum = total;
}
#endif

/* As foc_dot_q31. */
static inline int64_t foc_long_dot_q31(const FOC_ROM int32_t *weights, uint16_t taps, const int32_t *ring,
                                       uint16_t size, uint16_t now, uint16_t oldest)
{
    const uint16_t start = foc_ring_slot(now, size, oldest);
    const uint16_t straight = (uint16_t)(size - start);
    const uint16_t wrap = taps < straight ? taps : straight;
    int64_t sum = 0;

    foc_line_q31(&sum, weights, &ring[start], wrap);
    if (wrap < taps) {
        foc_line_q31(&sum, &weights[wrap], ring, (uint16_t)(taps - wrap));
    }
    return sum;
}

/* As foc_sum_q31. */
static inline int64_t foc_long_sum_q31(const FOC_ROM int32_t *weights, const FOC_ROM foc_block *blocks,
                                       uint16_t count, const int32_t *ring, uint16_t size, uint16_t now)
{
    int64_t total = 0;
    uint16_t b;

    for (b = 0; b < count; b++) {
        const uint16_t taps = blocks[b].taps;
        const int64_t sum = foc_long_dot_q31(weights, taps, ring, size, now, blocks[b].oldest);

        total += foc_shift64(sum, blocks[b].shift);
        weights += taps;
    }
    return total;
}

#endif
