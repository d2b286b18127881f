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

/* The nearest count to a physical value. On the controller's own hardware this is the scale of the ADC. */
static finger_q31_sig counts(double value, double lsb)
{
    const double scaled = value / lsb;

    return (finger_q31_sig)(scaled < 0.0 ? scaled - 0.5 : scaled + 0.5);
}

int main(void)
{
    static finger_q31_state controller; /* too large for some stacks */
    const finger_q31_sig ref = counts(0.01, (double)finger_q31_REF_LSB); /* 0.01 1/mm */
    const finger_q31_sig meas = counts(0.0, (double)finger_q31_REF_LSB);
    const finger_q31_sig sched = counts(0.125, (double)finger_q31_SCHED_LSB);
    int k;

    finger_q31_init(&controller);
    for (k = 0; k < 10; k++) { /* a timer calls this every finger_q31_SAMPLE_TIME seconds */
        const finger_q31_sig u = finger_q31_step(&controller, ref, meas, sched);

        printf("%2d  %.9g V%s\n", k, (double)u * (double)finger_q31_U_LSB,
               finger_q31_flags(&controller) & finger_q31_FLAG_HIGH ? "  at its upper end" : "");
    }
    return 0;
}
