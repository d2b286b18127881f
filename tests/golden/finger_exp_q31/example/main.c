/* main.c: how a program calls the controller "finger". Yours to change.
 *
 *   cc -std=c99 -O2 -ffp-contract=off -I.. main.c ../finger_q31.c -o main && ./main
 *
 * There is no plant: the measurement stays where it is. Read your sensor where this program prints.
 *
 * SPDX-License-Identifier: 0BSD
 */
#include <stdio.h>

#include "finger_q31.h"

int main(void)
{
    static finger_q31_state controller; /* too large for some stacks */
    const finger_q31_sig ref = finger_q31_ref_from_f32(0.01f); /* 0.01 1/mm */
    const finger_q31_sig meas = finger_q31_meas_from_f32(0.0f);
    const finger_q31_sig sched = finger_q31_sched_from_f32(0.125f);
    int k;

    finger_q31_init(&controller);
    for (k = 0; k < 10; k++) { /* a timer calls this every FINGER_Q31_SAMPLE_TIME seconds */
        const finger_q31_sig u = finger_q31_step(&controller, ref, meas, sched);

        printf("%2d  %.9g V%s\n", k, (double)finger_q31_u_to_f32(u),
               finger_q31_flags(&controller) & FINGER_Q31_FLAG_HIGH ? "  at its upper end" : "");
    }
    return 0;
}
