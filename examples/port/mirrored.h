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
    int64_t before;                    /* half a trapezoid, of the sample before */
    int64_t integral;                  /* the output, in counts of 2^-57: a float that holds 5 takes in no 1e-8 */
    float errors[2 * MIRRORED_TAPS];   /* every sample twice, so that the history is straight anywhere */
} mirrored_state;

void mirrored_reset(mirrored_state *s, float ref, float meas, float u0);
float mirrored_step(mirrored_state *s, float ref, float meas);
void mirrored_track(mirrored_state *s, float u);

#endif
