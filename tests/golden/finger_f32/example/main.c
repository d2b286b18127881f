/* main.c: how a program calls the controller "finger". Yours to change.
 *
 *   cc -std=c99 -O2 -ffp-contract=off -I.. main.c ../finger_f32.c -o main && ./main
 *
 * There is no plant: the measurement stays where it is. Read your sensor where this program prints.
 *
 * SPDX-License-Identifier: 0BSD
 */
#include <stdio.h>

#include "finger_f32.h"

int main(void)
{
    static finger_f32_state controller; /* too large for some stacks */
    const finger_f32_sig ref = 0.01f; /* 0.01 1/mm */
    const finger_f32_sig meas = 0.0f;
    const finger_f32_sig sched = 0.125f;
    int k;

    finger_f32_init(&controller);
    for (k = 0; k < 10; k++) { /* a timer calls this every FINGER_F32_SAMPLE_TIME seconds */
        const finger_f32_sig u = finger_f32_step(&controller, ref, meas, sched);

        printf("%2d  %.9g V%s\n", k, (double)u * (double)FINGER_F32_U_LSB,
               finger_f32_flags(&controller) & FINGER_F32_FLAG_HIGH ? "  at its upper end" : "");
    }
    return 0;
}
