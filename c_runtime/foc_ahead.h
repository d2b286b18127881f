/* foc_ahead.h: history sums that look four samples ahead, for cores on which loads cost most.
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
 * A tile is four samples times four sums. Weights stand oldest first: tile by tile, sum i of the group takes
 * weights[j + 4 - i] for sample j, so each sum sees the same weights one place on. Zeros fill both ends.
 */
#ifndef FOC_AHEAD_H
#define FOC_AHEAD_H

#include "foc_rt.h"

/* Tiles that follow each other in one block and one step. */
typedef struct {
    uint16_t weights; /* where its weights begin */
    uint16_t tiles;   /* how many, at least 1 */
    uint16_t back;    /* how many tiles its oldest is before the group in the making, at least 2 */
    uint8_t shift;    /* from the block's scale to the total's */
    uint8_t ends;     /* 1: the block is complete */
} foc_run;

#include "foc_tiles.h"

/* The tile of a ring in which a run begins; `now` is any slot of the present group. */
static inline unsigned foc_run_start(unsigned back, unsigned size, unsigned now)
{
    const unsigned next = now / 4u + 1u; /* the group in the making */

    return (next >= back ? next : next + size / 4u) - back;
}

/* --- q15 ------------------------------------------------------------------------------------------ */

/* One run: ahead[8 ... 11] are the sums of its block, ahead[4 ... 7] of the blocks complete. */
static inline void foc_run_q15(int32_t *ahead, const FOC_ROM int16_t *weights, const FOC_ROM foc_run *run,
                               const int16_t *ring, uint16_t size, uint16_t now)
{
    const unsigned start = foc_run_start(run->back, size, now);
    const unsigned tiles = run->tiles;
    const unsigned straight = size / 4u - start;

    weights += run->weights;
    ring += 4u * start;
    if (tiles <= straight) {
        foc_tiles_q15(&ahead[8], weights, ring, tiles);
    } else { /* the ring's end divides it */
        foc_tiles_q15(&ahead[8], weights, ring, straight);
        foc_tiles_q15(&ahead[8], &weights[4u * straight], ring - 4u * start, tiles - straight);
    }
    if (run->ends != 0u) {
        const uint8_t shift = run->shift;

        ahead[4] += foc_shift32(ahead[8], shift);
        ahead[5] += foc_shift32(ahead[9], shift);
        ahead[6] += foc_shift32(ahead[10], shift);
        ahead[7] += foc_shift32(ahead[11], shift);
        ahead[8] = 0;
        ahead[9] = 0;
        ahead[10] = 0;
        ahead[11] = 0;
    }
}

/* Runs from ... to - 1, one after another. */
static inline void foc_runs_q15(int32_t *ahead, const FOC_ROM int16_t *weights, const FOC_ROM foc_run *runs,
                                unsigned from, unsigned to, const int16_t *ring, uint16_t size, uint16_t now)
{
#ifdef FOC_HAS_WORK_Q15
    if (from < to) {
        foc_work work = {ahead, weights, &runs[from], &runs[to], ring, size / 4u, now / 4u + 1u};

        foc_work_q15(&work);
    }
#else
    for (; from < to; from++) {
        foc_run_q15(ahead, weights, &runs[from], ring, size, now);
    }
#endif
}

/* A step's share: runs[slices[p]] up to runs[slices[p + 1]] in step p of a group. ahead[0 ... 3] are the far
   sums of the present group's steps, of which step p adds ahead[p] to its near lags. */
static inline void foc_ahead_q15(int32_t *ahead, const FOC_ROM int16_t *weights, const FOC_ROM foc_run *runs,
                                 const FOC_ROM uint8_t *slices, const int16_t *ring, uint16_t size,
                                 uint16_t now)
{
    const unsigned step = now & 3u;
    unsigned i;

    if (step == 0u) {
        for (i = 0; i < 4u; i++) {
            ahead[i] = ahead[4u + i];
            ahead[4u + i] = 0;
        }
    }
    foc_runs_q15(ahead, weights, runs, slices[step], slices[step + 1u], ring, size, now);
}

/* After every sample of the ring has been set to the same value and `now` to its last slot. */
static inline void foc_rest_q15(int32_t *ahead, const FOC_ROM int16_t *weights, const FOC_ROM foc_run *runs,
                                const FOC_ROM uint8_t *slices, const int16_t *ring, uint16_t size)
{
    unsigned i;

    for (i = 4; i < 12u; i++) {
        ahead[i] = 0;
    }
    foc_runs_q15(ahead, weights, runs, 0, slices[4], ring, size, (uint16_t)(size - 1u));
    for (i = 0; i < 4u; i++) {
        ahead[i] = ahead[4u + i];
    }
}

/* The latest `count` samples, oldest first: where they stand, or a copy where the ring's end divides them. */
static inline const int16_t *foc_latest_q15(int16_t *copy, uint16_t count, const int16_t *ring,
                                            uint16_t size, uint16_t now)
{
    uint16_t slot = foc_ring_slot(now, size, (uint16_t)(count - 1u));
    uint16_t i;

    if (slot < now) {
        return &ring[slot];
    }
    for (i = 0; i < count; i++) {
        copy[i] = ring[slot];
        slot = foc_ring_next(slot, size);
    }
    return copy;
}

/* --- q31 ------------------------------------------------------------------------------------------ */

static inline void foc_run_q31(int64_t *ahead, const FOC_ROM int32_t *weights, const FOC_ROM foc_run *run,
                               const int32_t *ring, uint16_t size, uint16_t now)
{
    const unsigned start = foc_run_start(run->back, size, now);
    const unsigned tiles = run->tiles;
    const unsigned straight = size / 4u - start;

    weights += run->weights;
    ring += 4u * start;
    if (tiles <= straight) {
        foc_tiles_q31(&ahead[8], weights, ring, tiles);
    } else { /* the ring's end divides it */
        foc_tiles_q31(&ahead[8], weights, ring, straight);
        foc_tiles_q31(&ahead[8], &weights[4u * straight], ring - 4u * start, tiles - straight);
    }
    if (run->ends != 0u) {
        const uint8_t shift = run->shift;

        ahead[4] += foc_shift64(ahead[8], shift);
        ahead[5] += foc_shift64(ahead[9], shift);
        ahead[6] += foc_shift64(ahead[10], shift);
        ahead[7] += foc_shift64(ahead[11], shift);
        ahead[8] = 0;
        ahead[9] = 0;
        ahead[10] = 0;
        ahead[11] = 0;
    }
}

/* Runs from ... to - 1, one after another. */
static inline void foc_runs_q31(int64_t *ahead, const FOC_ROM int32_t *weights, const FOC_ROM foc_run *runs,
                                unsigned from, unsigned to, const int32_t *ring, uint16_t size, uint16_t now)
{
#ifdef FOC_HAS_WORK_Q31
    if (from < to) {
        foc_work work = {ahead, weights, &runs[from], &runs[to], ring, size / 4u, now / 4u + 1u};

        foc_work_q31(&work);
    }
#else
    for (; from < to; from++) {
        foc_run_q31(ahead, weights, &runs[from], ring, size, now);
    }
#endif
}

static inline void foc_ahead_q31(int64_t *ahead, const FOC_ROM int32_t *weights, const FOC_ROM foc_run *runs,
                                 const FOC_ROM uint8_t *slices, const int32_t *ring, uint16_t size,
                                 uint16_t now)
{
    const unsigned step = now & 3u;
    unsigned i;

    if (step == 0u) {
        for (i = 0; i < 4u; i++) {
            ahead[i] = ahead[4u + i];
            ahead[4u + i] = 0;
        }
    }
    foc_runs_q31(ahead, weights, runs, slices[step], slices[step + 1u], ring, size, now);
}

static inline void foc_rest_q31(int64_t *ahead, const FOC_ROM int32_t *weights, const FOC_ROM foc_run *runs,
                                const FOC_ROM uint8_t *slices, const int32_t *ring, uint16_t size)
{
    unsigned i;

    for (i = 4; i < 12u; i++) {
        ahead[i] = 0;
    }
    foc_runs_q31(ahead, weights, runs, 0, slices[4], ring, size, (uint16_t)(size - 1u));
    for (i = 0; i < 4u; i++) {
        ahead[i] = ahead[4u + i];
    }
}

static inline const int32_t *foc_latest_q31(int32_t *copy, uint16_t count, const int32_t *ring,
                                            uint16_t size, uint16_t now)
{
    uint16_t slot = foc_ring_slot(now, size, (uint16_t)(count - 1u));
    uint16_t i;

    if (slot < now) {
        return &ring[slot];
    }
    for (i = 0; i < count; i++) {
        copy[i] = ring[slot];
        slot = foc_ring_next(slot, size);
    }
    return copy;
}

/* --- f32: one block, so ahead[4 ... 7] are its sums ----------------------------------------------- */

static inline void foc_run_f32(float *ahead, const FOC_ROM float *weights, const FOC_ROM foc_run *run,
                               const float *ring, uint16_t size, uint16_t now)
{
    const unsigned start = foc_run_start(run->back, size, now);
    const unsigned tiles = run->tiles;
    const unsigned straight = size / 4u - start;

    weights += run->weights;
    ring += 4u * start;
    if (tiles <= straight) {
        foc_tiles_f32(&ahead[4], weights, ring, tiles);
    } else { /* the ring's end divides it */
        foc_tiles_f32(&ahead[4], weights, ring, straight);
        foc_tiles_f32(&ahead[4], &weights[4u * straight], ring - 4u * start, tiles - straight);
    }
}

static inline void foc_ahead_f32(float *ahead, const FOC_ROM float *weights, const FOC_ROM foc_run *runs,
                                 const FOC_ROM uint8_t *slices, const float *ring, uint16_t size,
                                 uint16_t now)
{
    const unsigned step = now & 3u;
    unsigned i;

    if (step == 0u) {
        for (i = 0; i < 4u; i++) {
            ahead[i] = ahead[4u + i];
            ahead[4u + i] = 0.0f;
        }
    }
    for (i = slices[step]; i < slices[step + 1u]; i++) {
        foc_run_f32(ahead, weights, &runs[i], ring, size, now);
    }
}

static inline void foc_rest_f32(float *ahead, const FOC_ROM float *weights, const FOC_ROM foc_run *runs,
                                const FOC_ROM uint8_t *slices, const float *ring, uint16_t size)
{
    unsigned i;

    for (i = 4; i < 8u; i++) {
        ahead[i] = 0.0f;
    }
    for (i = 0; i < slices[4]; i++) {
        foc_run_f32(ahead, weights, &runs[i], ring, size, (uint16_t)(size - 1u));
    }
    for (i = 0; i < 4u; i++) {
        ahead[i] = ahead[4u + i];
    }
}

static inline const float *foc_latest_f32(float *copy, uint16_t count, const float *ring, uint16_t size,
                                          uint16_t now)
{
    uint16_t slot = foc_ring_slot(now, size, (uint16_t)(count - 1u));
    uint16_t i;

    if (slot < now) {
        return &ring[slot];
    }
    for (i = 0; i < count; i++) {
        copy[i] = ring[slot];
        slot = foc_ring_next(slot, size);
    }
    return copy;
}

#endif
