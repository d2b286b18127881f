/* foc_m4_q15.h: 16-bit sums that look ahead, for Cortex-M4, M7 and others with the DSP extension.
 *
 * SPDX-License-Identifier: 0BSD
 *
 * A whole function, so that no register is left to chance: it saves r4 ... r11, calls nothing, and reads its
 * argument as AAPCS has it. Loads are of aligned words, pairs and halfwords only. Integers are exact, so
 * their order is free. What it does is foc_run_q15 of foc_ahead_q15.h, run after run. Cycles are those
 * of ARM's tables. */
#ifndef FOC_M4_Q15_H
#define FOC_M4_Q15_H

#include "foc_tiles.h"

/* Generated files ask for the version they were written for. */
#define FOC_M4_Q15_VERSION 2

#if defined(FOC_THUMB_M) && defined(__ARM_FEATURE_DSP) && defined(__thumb2__)
#define FOC_HAS_WORK_Q15
/* Weights 2n and 2n+1 stand in one word, which sums 0 and 2 take as it is; sums 1 and 3 take 2n+1 and
   2n+2, packed the other way round for the crosswise product. 16 cycles a tile. */
FOC_ASSEMBLY void foc_work_q15(foc_work *work FOC_READ)
{
    __asm__ volatile(
        ".syntax unified\n"
        "push {r0-r2, r4-r11, lr}\n"
        "9:\n"
        "ldr lr, [sp]\n" /* work */
        "ldmia lr, {r0, r1, r2, r3, r8, r9, r10}\n" /* ahead, weights, run, end, ring, tiles, next */
        "ldrh r4, [r2, #0]\n"
        "ldrh r3, [r2, #2]\n"
        "ldrh r5, [r2, #4]\n"
        "add r1, r1, r4, lsl #1\n"
        "subs r5, r10, r5\n" /* the tile it begins at */
        "it mi\n"
        "addmi r5, r5, r9\n"
        "sub r9, r9, r5\n" /* tiles to the ring's end */
        "add r2, r8, r5, lsl #3\n"
        "subs r10, r3, r9\n"
        "it ls\n"
        "movls r10, #0\n"
        "sub r3, r3, r10\n"
        "str r10, [sp, #4]\n" /* tiles after the ring's end */
        "adds r0, #32\n"
        "ldmia r0, {r4-r7}\n"
        "ldmia r1!, {r10, r11}\n"
        "pkhbt r0, r11, r10\n" /* weights 2 and 1 */
        "6:\n"
        "lsrs r3, r3, #1\n"
        "bcc 1f\n"
        "ldmia r2!, {r8, r9}\n"
        "ldmia r1!, {r12, lr}\n"
        "smladx r7, r0, r8, r7\n"
        "smlad r6, r11, r8, r6\n"
        "pkhbt r11, r12, r11\n"
        "smladx r5, r11, r8, r5\n"
        "smlad r4, r12, r8, r4\n"
        "smladx r7, r11, r9, r7\n"
        "smlad r6, r12, r9, r6\n"
        "pkhbt r0, lr, r12\n"
        "smladx r5, r0, r9, r5\n"
        "smlad r4, lr, r9, r4\n"
        "mov r11, lr\n"
        "1:\n" /* an odd tile is done */
        "cmp r3, #0\n"
        "beq 4f\n"
        "lsrs r3, r3, #1\n"
        "bcc 2f\n"
        "adds r3, #1\n"
        "b 3f\n" /* an odd pair of tiles */
        "2:\n"
        "ldmia r2!, {r8, r9}\n"
        "ldmia r1!, {r12, lr}\n"
        "smladx r7, r0, r8, r7\n"
        "smlad r6, r11, r8, r6\n"
        "pkhbt r11, r12, r11\n"
        "smladx r5, r11, r8, r5\n"
        "smlad r4, r12, r8, r4\n"
        "smladx r7, r11, r9, r7\n"
        "smlad r6, r12, r9, r6\n"
        "pkhbt r0, lr, r12\n"
        "smladx r5, r0, r9, r5\n"
        "smlad r4, lr, r9, r4\n"
        "ldmia r2!, {r8, r9}\n"
        "ldmia r1!, {r10, r11}\n"
        "smladx r7, r0, r8, r7\n"
        "smlad r6, lr, r8, r6\n"
        "pkhbt lr, r10, lr\n"
        "smladx r5, lr, r8, r5\n"
        "smlad r4, r10, r8, r4\n"
        "smladx r7, lr, r9, r7\n"
        "smlad r6, r10, r9, r6\n"
        "pkhbt r0, r11, r10\n"
        "smladx r5, r0, r9, r5\n"
        "smlad r4, r11, r9, r4\n"
        "3:\n"
        "ldmia r2!, {r8, r9}\n"
        "ldmia r1!, {r12, lr}\n"
        "smladx r7, r0, r8, r7\n"
        "smlad r6, r11, r8, r6\n"
        "pkhbt r11, r12, r11\n"
        "smladx r5, r11, r8, r5\n"
        "smlad r4, r12, r8, r4\n"
        "smladx r7, r11, r9, r7\n"
        "smlad r6, r12, r9, r6\n"
        "pkhbt r0, lr, r12\n"
        "smladx r5, r0, r9, r5\n"
        "smlad r4, lr, r9, r4\n"
        "ldmia r2!, {r8, r9}\n"
        "ldmia r1!, {r10, r11}\n"
        "smladx r7, r0, r8, r7\n"
        "smlad r6, lr, r8, r6\n"
        "pkhbt lr, r10, lr\n"
        "smladx r5, lr, r8, r5\n"
        "smlad r4, r10, r8, r4\n"
        "smladx r7, lr, r9, r7\n"
        "smlad r6, r10, r9, r6\n"
        "pkhbt r0, r11, r10\n"
        "smladx r5, r0, r9, r5\n"
        "smlad r4, r11, r9, r4\n"
        "subs r3, r3, #1\n"
        "bne 2b\n"
        "4:\n"
        "ldr r3, [sp, #4]\n"
        "cmp r3, #0\n"
        "beq 7f\n"
        "movs r2, #0\n"
        "str r2, [sp, #4]\n"
        "ldr r2, [sp]\n"
        "ldr r2, [r2, #16]\n" /* on from the ring's beginning */
        "b 6b\n"
        "7:\n"
        "ldr lr, [sp]\n"
        "ldr r0, [lr]\n"
        "ldr r2, [lr, #8]\n"
        "ldrh r3, [r2, #6]\n"
        "adds r2, #8\n"
        "str r2, [lr, #8]\n"
        "tst r3, #256\n" /* is the block complete? */
        "beq 8f\n"
        "uxtb r8, r3\n"
        "movs r9, #1\n"
        "lsl r9, r9, r8\n"
        "lsr r9, r9, #1\n"
        "add r4, r4, r9\n"
        "add r5, r5, r9\n"
        "add r6, r6, r9\n"
        "add r7, r7, r9\n"
        "asr r4, r4, r8\n"
        "asr r5, r5, r8\n"
        "asr r6, r6, r8\n"
        "asr r7, r7, r8\n"
        "add r9, r0, #16\n"
        "ldmia r9, {r8, r10, r11, r12}\n"
        "add r4, r4, r8\n"
        "add r5, r5, r10\n"
        "add r6, r6, r11\n"
        "add r7, r7, r12\n"
        "stmia r9, {r4-r7}\n"
        "movs r4, #0\n"
        "movs r5, #0\n"
        "movs r6, #0\n"
        "movs r7, #0\n"
        "8:\n"
        "add r0, r0, #32\n"
        "stmia r0, {r4-r7}\n"
        "ldr lr, [sp]\n"
        "ldrd r2, r3, [lr, #8]\n"
        "cmp r2, r3\n"
        "bne 9b\n"
        "add sp, #12\n"
        "pop {r4-r11, pc}\n"
    );
}
#endif

#endif
