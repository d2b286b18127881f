/* foc_ahead_q15.h: sums of 16-bit samples that look four samples ahead; foc_tiles.h tells how.
 *
 * SPDX-License-Identifier: 0BSD
 */
#ifndef FOC_AHEAD_Q15_H
#define FOC_AHEAD_Q15_H

#include "foc_tiles.h"

/* Generated files ask for the version they were written for. */
#define FOC_AHEAD_Q15_VERSION 2

#ifndef FOC_HAS_TILES_Q15
static inline void foc_tiles_q15(int32_t *sum, const FOC_ROM int16_t *weights, const int16_t *x,
                                 unsigned tiles)
{
    int32_t s0 = sum[0], s1 = sum[1], s2 = sum[2], s3 = sum[3];
    int32_t a = weights[1], b = weights[2], c = weights[3]; /* the next sample meets them */

    weights += 4;
    for (; tiles > 0u; tiles--) {
        const int32_t d = weights[0];

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

/* One run: ahead[8 ... 11] are the sums of its block, ahead[4 ... 7] of the blocks complete. */
static inline void foc_run_q15(int32_t *ahead, const FOC_ROM int16_t *weights, const FOC_ROM foc_run *run,
                               const int16_t *ring, unsigned size, unsigned now)
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
        unsigned i;

        for (i = 0; i < 4u; i++) {
            ahead[4u + i] += foc_shift32(ahead[8u + i], run->shift);
            ahead[8u + i] = 0;
        }
    }
}

/* Runs from ... to - 1, one after another. */
static inline void foc_runs_q15(int32_t *ahead, const FOC_ROM int16_t *weights, const FOC_ROM foc_run *runs,
                                unsigned from, unsigned to, const int16_t *ring, unsigned size, unsigned now)
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
                                 const FOC_ROM uint8_t *slices, const int16_t *ring, unsigned size,
                                 unsigned now)
{
    const unsigned step = now & 3u;

    if (step == 0u) {
        unsigned i;

        for (i = 0; i < 4u; i++) {
            ahead[i] = ahead[4u + i];
            ahead[4u + i] = 0;
        }
    }
    foc_runs_q15(ahead, weights, runs, slices[step], slices[step + 1u], ring, size, now);
}

/* After every sample of the ring has been set to the same value and `now` to its last slot. */
static inline void foc_rest_q15(int32_t *ahead, const FOC_ROM int16_t *weights, const FOC_ROM foc_run *runs,
                                const FOC_ROM uint8_t *slices, const int16_t *ring, unsigned size)
{
    unsigned i;

    for (i = 4; i < 12u; i++) {
        ahead[i] = 0;
    }
    foc_runs_q15(ahead, weights, runs, 0, slices[4], ring, size, size - 1u);
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

#endif
