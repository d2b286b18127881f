/* foc_ahead_f32.h: sums of floats that look four samples ahead; foc_tiles.h tells how.
 *
 * SPDX-License-Identifier: 0BSD
 */
#ifndef FOC_AHEAD_F32_H
#define FOC_AHEAD_F32_H

#include "foc_tiles.h"

/* Generated files ask for the version they were written for. */
#define FOC_AHEAD_F32_VERSION 2

#ifndef FOC_HAS_TILES_F32
static inline void foc_tiles_f32(float *sum, const FOC_ROM float *weights, const float *x, unsigned tiles)
{
    float s0 = sum[0], s1 = sum[1], s2 = sum[2], s3 = sum[3];
    float a = weights[1], b = weights[2], c = weights[3]; /* the next sample meets them */

    weights += 4;
    for (; tiles > 0u; tiles--) {
        const float d = weights[0];

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

/* One run: there is one block, so ahead[4 ... 7] are its sums. */
static inline void foc_run_f32(float *ahead, const FOC_ROM float *weights, const FOC_ROM foc_run *run,
                               const float *ring, unsigned size, unsigned now)
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

/* A step's share: runs[slices[p]] up to runs[slices[p + 1]] in step p of a group. ahead[0 ... 3] are the far
   sums of the present group's steps, of which step p adds ahead[p] to its near lags. */
static inline void foc_ahead_f32(float *ahead, const FOC_ROM float *weights, const FOC_ROM foc_run *runs,
                                 const FOC_ROM uint8_t *slices, const float *ring, unsigned size,
                                 unsigned now)
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

/* After every sample of the ring has been set to the same value and `now` to its last slot. */
static inline void foc_rest_f32(float *ahead, const FOC_ROM float *weights, const FOC_ROM foc_run *runs,
                                const FOC_ROM uint8_t *slices, const float *ring, unsigned size)
{
    unsigned i;

    for (i = 4; i < 8u; i++) {
        ahead[i] = 0.0f;
    }
    for (i = 0; i < slices[4]; i++) {
        foc_run_f32(ahead, weights, &runs[i], ring, size, size - 1u);
    }
    for (i = 0; i < 4u; i++) {
        ahead[i] = ahead[4u + i];
    }
}

/* The latest `count` samples, oldest first: where they stand, or a copy where the ring's end divides them. */
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
