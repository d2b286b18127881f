/* foc_tiles.h: how history sums look four samples ahead, for cores on which loads cost most.
 *
 * SPDX-License-Identifier: 0BSD
 *
 * A plain history sum loads a weight and a sample for each product. Here four sums of successive samples
 * are taken together, so that each load serves four products; and the work is spread, so that every step
 * does a quarter of it:
 *
 *   group         ... | k  k+1 k+2 k+3 | k+4 k+5 k+6 k+7 |      four steps each; k stands at a multiple of 4
 *   known, used   ----'                |                 |      samples before k
 *   in the making       1/4 1/4 1/4 1/4|                 |      what those samples add to the next group
 *   ready                              | +near ...       |      each step adds its near lags
 *
 * Lags of 8 and more could be looked ahead; from 16 on (8 in floating point) they are. The near lags are
 * summed in their own step, after the far ones: the order from the oldest sample to the newest stays, so
 * floating point gives the bits of the plain sum, and integers are exact in any order. It costs 12 more sums
 * of state (8 in floating point), up to 7 zeros a block in the table, and a ring of a multiple of 4 samples.
 *
 * The work comes in tiles of four samples times four sums. Each of the four sums sees the same weights one
 * place on; zeros fill both ends. Weights stand oldest first; for sample j = 0 ... 4 * tiles - 1, oldest
 * first, and each of the sums i = 0 ... 3:  sum[i] += weights[j + 4 - i] * x[j].
 *
 * foc_ahead_q15.h and its like do so in C. Files named after a core and an arithmetic, such as foc_m4_q15.h,
 * do so in that core's instructions; included before they take the place of that C where the compiler's
 * macros say that the core has them.
 */
#ifndef FOC_TILES_H
#define FOC_TILES_H

#include "foc_rt.h"

/* Generated files ask for the version they were written for. */
#define FOC_TILES_VERSION 2

/* A table that is read by words: its first entry stands at one. */
#ifdef __GNUC__
#define FOC_WORDS __attribute__((aligned(4)))
#else
#define FOC_WORDS
#endif

/* Tiles that follow each other in one block and one step. */
typedef struct {
    uint16_t weights; /* where its weights begin */
    uint16_t tiles;   /* how many, at least 1 */
    uint16_t back;    /* how many tiles its oldest is before the group in the making, at least 2 */
    uint8_t shift;    /* from the block's scale to the total's, at most 31 */
    uint8_t ends;     /* 1: the block is complete */
} foc_run;

/* The tile of a ring in which a run begins; `now` is any slot of the present group. */
static inline unsigned foc_run_start(unsigned back, unsigned size, unsigned now)
{
    const unsigned next = now / 4u + 1u; /* the group in the making */

    return (next >= back ? next : next + size / 4u) - back;
}

/* GCC and clang for a Cortex-M; they tell by their own macros what it can. */
#if defined(__GNUC__) && defined(__thumb__) && defined(__ARM_ARCH_PROFILE) && !defined(__ARM_BIG_ENDIAN)
#if __ARM_ARCH_PROFILE == 'M'
#define FOC_THUMB_M
#endif
#if defined(__ARM_FP) && ((__ARM_FP & 4) != 0)
#define FOC_SINGLE
#endif
#endif

#ifdef FOC_THUMB_M
/* A function that is its assembly text and nothing else; no compiler may look through it. */
#if defined(__clang__)
#define FOC_ASSEMBLY static __attribute__((naked, noinline, unused))
#else
#define FOC_ASSEMBLY static __attribute__((naked, noinline, noipa, unused))
#endif

/* A parameter that the assembly reads, unseen by the compiler. */
#define FOC_READ __attribute__((unused))

/* The runs of one step, for foc_work_X, which does them in turn. */
typedef struct {
    void *ahead;
    const void *weights;
    const foc_run *run; /* the next one */
    const foc_run *end;
    const void *ring;
    uint32_t tiles; /* of the ring */
    uint32_t next;  /* the group in the making */
} foc_work;
#endif

#endif
