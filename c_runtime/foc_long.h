/* foc_long.h: 32-bit history sums for cores that multiply 32 x 32 bits to 32 bits only.
 *
 * SPDX-License-Identifier: 0BSD
 *
 * A Cortex-M0 or M0+ has no instruction for the upper half of a product: compilers call a function for each.
 * Here every factor is cut into halves, upper * 2^16 + lower, the lower without sign: four products of
 * 16 x 16 bits, none of which can overflow, added at their places. The C serves every other core; the bits
 * are the same.
 */
#ifndef FOC_LONG_H
#define FOC_LONG_H

#include "foc_rt.h"
#include "foc_tiles.h"

#if defined(FOC_ASSEMBLY) && (defined(__ARM_ARCH_6M__) || defined(__ARM_ARCH_8M_BASE__))
/* sum += weights[i] * x[i] for i = 0 ... taps-1; taps >= 1. 24 cycles each, the loop 1.5 more. */
FOC_ASSEMBLY void foc_line_q31(int64_t *sum, const int32_t *weights, const int32_t *x, uint32_t taps)
{
    __asm__ volatile(
        ".syntax unified\n"
        "push {r0, r4-r7, lr}\n"
        "mov r4, r8\n"
        "mov r5, r9\n"
        "push {r4, r5}\n"
        "mov r8, r1\n"
        "movs r1, r2\n"
        "ldr r4, [r0, #0]\n"
        "ldr r5, [r0, #4]\n"
        "lsls r2, r3, #2\n"
        "adds r2, r2, r1\n"
        "mov r9, r2\n" /* where x ends */
        "mov r12, r3\n"
        "movs r2, #3\n"
        "ands r3, r2\n"
        "beq 2f\n"
        "mov r12, r3\n"
        "1:\n" /* one, two or three, so that a multiple of four is left */
        "ldr r2, [r1, #0]\n"
        "mov r3, r8\n"
        "ldr r3, [r3, #0]\n"
        "uxth r6, r2\n" /* lower half, without sign */
        "asrs r2, r2, #16\n" /* upper half, with its sign */
        "uxth r7, r3\n"
        "asrs r3, r3, #16\n"
        "mov r0, r6\n"
        "muls r0, r7, r0\n" /* lower times lower */
        "muls r6, r3, r6\n" /* lower times upper */
        "muls r3, r2, r3\n" /* upper times upper */
        "muls r2, r7, r2\n" /* upper times lower */
        "adds r4, r4, r0\n"
        "adcs r5, r5, r3\n"
        "lsls r0, r6, #16\n"
        "asrs r6, r6, #16\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r6\n"
        "lsls r0, r2, #16\n"
        "asrs r2, r2, #16\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r2\n"
        "adds r1, #4\n"
        "movs r0, #4\n"
        "add r8, r0\n"
        "mov r3, r12\n"
        "subs r3, r3, #1\n"
        "mov r12, r3\n"
        "bne 1b\n"
        "2:\n"
        "cmp r1, r9\n"
        "beq 4f\n"
        "3:\n"
        "ldr r2, [r1, #0]\n"
        "mov r3, r8\n"
        "ldr r3, [r3, #0]\n"
        "uxth r6, r2\n"
        "asrs r2, r2, #16\n"
        "uxth r7, r3\n"
        "asrs r3, r3, #16\n"
        "mov r0, r6\n"
        "muls r0, r7, r0\n"
        "muls r6, r3, r6\n"
        "muls r3, r2, r3\n"
        "muls r2, r7, r2\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r3\n"
        "lsls r0, r6, #16\n"
        "asrs r6, r6, #16\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r6\n"
        "lsls r0, r2, #16\n"
        "asrs r2, r2, #16\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r2\n"
        "ldr r2, [r1, #4]\n"
        "mov r3, r8\n"
        "ldr r3, [r3, #4]\n"
        "uxth r6, r2\n"
        "asrs r2, r2, #16\n"
        "uxth r7, r3\n"
        "asrs r3, r3, #16\n"
        "mov r0, r6\n"
        "muls r0, r7, r0\n"
        "muls r6, r3, r6\n"
        "muls r3, r2, r3\n"
        "muls r2, r7, r2\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r3\n"
        "lsls r0, r6, #16\n"
        "asrs r6, r6, #16\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r6\n"
        "lsls r0, r2, #16\n"
        "asrs r2, r2, #16\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r2\n"
        "ldr r2, [r1, #8]\n"
        "mov r3, r8\n"
        "ldr r3, [r3, #8]\n"
        "uxth r6, r2\n"
        "asrs r2, r2, #16\n"
        "uxth r7, r3\n"
        "asrs r3, r3, #16\n"
        "mov r0, r6\n"
        "muls r0, r7, r0\n"
        "muls r6, r3, r6\n"
        "muls r3, r2, r3\n"
        "muls r2, r7, r2\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r3\n"
        "lsls r0, r6, #16\n"
        "asrs r6, r6, #16\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r6\n"
        "lsls r0, r2, #16\n"
        "asrs r2, r2, #16\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r2\n"
        "ldr r2, [r1, #12]\n"
        "mov r3, r8\n"
        "ldr r3, [r3, #12]\n"
        "uxth r6, r2\n"
        "asrs r2, r2, #16\n"
        "uxth r7, r3\n"
        "asrs r3, r3, #16\n"
        "mov r0, r6\n"
        "muls r0, r7, r0\n"
        "muls r6, r3, r6\n"
        "muls r3, r2, r3\n"
        "muls r2, r7, r2\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r3\n"
        "lsls r0, r6, #16\n"
        "asrs r6, r6, #16\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r6\n"
        "lsls r0, r2, #16\n"
        "asrs r2, r2, #16\n"
        "adds r4, r4, r0\n"
        "adcs r5, r5, r2\n"
        "adds r1, #16\n"
        "movs r0, #16\n"
        "add r8, r0\n"
        "cmp r1, r9\n"
        "bne 3b\n"
        "4:\n"
        "ldr r0, [sp, #8]\n"
        "str r4, [r0, #0]\n"
        "str r5, [r0, #4]\n"
        "pop {r4, r5}\n"
        "mov r8, r4\n"
        "mov r9, r5\n"
        "pop {r0, r4-r7, pc}\n"
    );
}
#else
static inline void foc_line_q31(int64_t *sum, const FOC_ROM int32_t *weights, const int32_t *x,
                                uint16_t taps)
{
    int64_t total = *sum;
    uint16_t i;

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
