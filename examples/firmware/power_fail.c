/* power_fail.c: the state outlives a dip of the supply, in memory that a battery keeps.
 *
 *   cc -std=c99 -I firmware -I examples/firmware examples/firmware/power_fail.c \
 *      examples/firmware/board_host.c firmware/spba.c -o power_fail && ./power_fail
 *
 * SPDX-License-Identifier: 0BSD
 */
#include <stdio.h>
#include <string.h>

#include "board.h"
#include "spba.h"

static uint8_t backup[SPBA_SAVED_BYTES]; /* .noinit or backup RAM: put it there with a section of your own */
static spba_state controller;

static spba_sig curvature(void)
{
    return spba_meas_from_f32((float)board_adc(0) * (0.02f / 4095.0f));
}

static spba_sig step(void)
{
    const spba_sig sched = spba_sched_from_f32((float)board_adc(1) * (0.25f / 4095.0f));

    return spba_step(&controller, spba_ref_from_f32(0.008f), curvature(), sched);
}

/* From the comparator that watches the supply: the capacitors last some milliseconds. */
static void power_fails(void)
{
    spba_save(&controller, backup);
}

/* At start-up. A copy that is damaged, or of other firmware, is as good as none. */
static int boot(void)
{
    if (spba_restore(&controller, backup) == 0u) {
        return 1;
    }
    spba_reset(&controller, curvature(), curvature(), 0);
    return 0;
}

static void nothing(void)
{
}

int main(void)
{
    spba_sig before = 0;
    spba_sig after;
    int cold;
    int warm;
    int broken;

    board_timer(SPBA_PERIOD_US, nothing);
    cold = boot(); /* the backup is empty */
    for (int k = 0; k < 200; k++) {
        board_sleep();
        before = step();
        board_dac((uint16_t)(spba_u_to_f32(before) * (4095.0f / 10.0f) + 0.5f));
    }
    power_fails();
    memset(&controller, 0xA5, sizeof controller); /* RAM after a cold start */
    warm = boot();
    after = step();
    printf("%.4f V before, %.4f V after\n", (double)spba_u_to_f32(before), (double)spba_u_to_f32(after));

    backup[SPBA_SAVED_BYTES / 2] ^= 1u;
    broken = boot();
    return !cold && warm && !broken && spba_u_to_f32(after - before) < 0.05f ? 0 : 1;
}
