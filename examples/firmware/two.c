/* two.c: two controllers in one program, each at its own period, from one timer.
 *
 *   focgen generate examples/controller.toml --out firmware
 *   focgen generate examples/port/controller.toml --out firmware     (the same runtime serves both)
 *   cc -std=c99 -ffp-contract=off -I firmware -I examples/firmware examples/firmware/two.c \
 *      examples/firmware/board_host.c firmware/spba.c firmware/port.c -o two && ./two
 *
 * SPDX-License-Identifier: 0BSD
 */
#include <stdio.h>

#include "board.h"
#include "port.h"
#include "spba.h"

#if SPBA_PERIOD_US % PORT_PERIOD_US != 0
#error "one timer serves both only where one period is a multiple of the other"
#endif

static spba_state bending;
static port_state heating[2]; /* as many loops as there are states */
static unsigned ticks;
static unsigned steps[2];

static void control(void)
{
    unsigned i;

    for (i = 0; i < 2u; i++) {
        (void)port_step(&heating[i], 0.5f, 0.25f);
        steps[1]++;
    }
    if (ticks % (SPBA_PERIOD_US / PORT_PERIOD_US) == 0u) {
        const spba_sig meas = spba_meas_from_f32((float)board_adc(0) * (0.02f / 4095.0f));
        const spba_sig sched = spba_sched_from_f32((float)board_adc(1) * (0.25f / 4095.0f));
        const spba_sig u = spba_step(&bending, spba_ref_from_f32(0.008f), meas, sched);

        board_dac((uint16_t)(spba_u_to_f32(u) * (4095.0f / 10.0f) + 0.5f));
        steps[0]++;
    }
    ticks++;
}

int main(void)
{
    spba_init(&bending);
    port_init(&heating[0]);
    port_init(&heating[1]);
    board_timer(PORT_PERIOD_US, control);
    while (board_on()) {
        board_sleep();
    }
    printf("%u steps of one, %u of the other\n", steps[0], steps[1]);
    return steps[1] == 4u * steps[0] || steps[1] + 2u == 4u * steps[0] ? 0 : 1;
}
