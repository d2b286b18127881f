/* mirrored.h: the controller of controller.toml, written by hand.
 *
 * SPDX-License-Identifier: 0BSD
 */
#ifndef MIRRORED_H
#define MIRRORED_H

#include <stdint.h>

#define MIRRORED_TAPS 25

typedef struct {
    unsigned oldest;                   /* where the oldest of the samples stands */
    int64_t before;                    /* half a trapezoid, of the sample before, counts of 2^-57 */
    int64_t output;                    /* the same counts: a float would take in no small increment */
    float errors[2 * MIRRORED_TAPS];   /* every sample twice, so that the history is straight anywhere */
} mirrored_state;

void mirrored_reset(mirrored_state *s, float ref, float meas, float u0);
float mirrored_step(mirrored_state *s, float ref, float meas);
void mirrored_track(mirrored_state *s, float u);

#endif
