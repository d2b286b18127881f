/* foc_m0_q31.h: 32-bit sums for Cortex-M0 and M0+.
 *
 * SPDX-License-Identifier: 0BSD
 *
 * Every factor is cut into halves, upper * 2^16 + lower, the lower without sign: four products of 16 x 16,
 * none of which can overflow, added at their places. A whole function, so that no register is left to chance:
 * it saves what it must, calls nothing, and reads its arguments as AAPCS has them.
 */
#ifndef FOC_M0_Q31_H
#define FOC_M0_Q31_H

#include "foc_tiles.h"

/* Generated files ask for the version they were written for. */
#define FOC_M0_Q31_VERSION 2

#if defined(FOC_THUMB_M) && !defined(__thumb2__)
#define FOC_HAS_LINE_Q31

/* sum += weights[i] * x[i] for i = 0 ... taps-1; taps >= 1. 24 cycles each, the loop 1.5 more. */
FOC_ASSEMBLY void foc_line_q31(int64_t *sum FOC_READ, const int32_t *weights FOC_READ,
                               const int32_t *x FOC_READ, unsigned taps FOC_READ)
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
        ".irp o, 0, 4, 8, 12\n" /* a product at each offset */
        "ldr r2, [r1, #\\o]\n"
        "mov r3, r8\n"
        "ldr r3, [r3, #\\o]\n"
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
        ".endr\n"
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
#endif

#endif
