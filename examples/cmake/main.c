/* Links the installed controller from C: five samples of a constant reference, without a plant. */
#include <stdio.h>

#include "spba.h"

int main(void)
{
    static spba_state controller;
    const spba_sig ref = spba_ref_from_f32(0.01f);   /* 1/mm */
    const spba_sig meas = spba_meas_from_f32(0.0f);
    const spba_sig sched = spba_sched_from_f32(0.1f); /* bar */
    int k;

    spba_init(&controller);
    for (k = 0; k < 5; k++) {
        printf("%.9g\n", (double)spba_u_to_f32(spba_step(&controller, ref, meas, sched)));
    }
    return 0;
}
