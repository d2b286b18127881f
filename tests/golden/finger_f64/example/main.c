/* main.c: how a program calls the controller "finger". Yours to change.
 *
 *   cc -std=c99 -O2 -ffp-contract=off -I.. main.c ../finger_f64.c -o main && ./main
 *
 * There is no plant: the measurement stays where it is. Read your sensor where this program prints.
 *
 * SPDX-License-Identifier: 0BSD
 */
#include <stdio.h>

#include "finger_f64.h"

int main(void)
{
    static finger_f64_state controller; /* too large for some stacks */
    const finger_f64_sig ref = 0.01; /* 0.01 1/mm */
    const finger_f64_sig meas = 0.0;
    const finger_f64_sig sched = 0.125;
    int k;

    finger_f64_init(&controller);
    for (k = 0; k < 10; k++) { /* a timer calls this every FINGER_F64_SAMPLE_TIME seconds */
        const finger_f64_sig u = finger_f64_step(&controller, ref, meas, sched);

        printf("%2d  %.9g V%s\n", k, (double)u * (double)FINGER_F64_U_LSB,
               finger_f64_flags(&controller) & FINGER_F64_FLAG_HIGH ? "  at its upper end" : "");
    }
    return 0;
}
