/* timer.c: the controller in a timer's interrupt, between an ADC and a DAC.
 *
 *   focgen generate examples/controller.toml --out firmware
 *   cc -std=c99 -I firmware -I examples/firmware examples/firmware/timer.c examples/firmware/board_host.c \
 *      firmware/spba.c -o timer && ./timer
 *
 * The interrupt owns the state. The main loop gives it a set point and reads its flags; both are of a size that
 * the core writes at once, so neither needs a lock.
 *
 * SPDX-License-Identifier: 0BSD
 */
#include <stdio.h>

#include "board.h"
#include "spba.h"

#ifndef SPBA_PERIOD_US
#error "the timer counts microseconds: take a sample time of whole ones"
#endif

static spba_state controller;
static volatile spba_sig set_point;
static volatile uint8_t seen; /* every flag that has been raised */
static volatile float shown;

static spba_sig curvature(void)
{
    return spba_meas_from_f32((float)board_adc(0) * (0.02f / 4095.0f));
}

static spba_sig pressure(void)
{
    return spba_sched_from_f32((float)board_adc(1) * (0.25f / 4095.0f));
}

static void control(void)
{
    const spba_sig meas = curvature();
    const spba_sig u = spba_step(&controller, set_point, meas, pressure());

    board_dac((uint16_t)(spba_u_to_f32(u) * (4095.0f / 10.0f) + 0.5f)); /* u is within 0 and 10 V, always */
    seen = (uint8_t)(seen | spba_flags(&controller));
    shown = (float)board_adc(0) * (0.02f / 4095.0f);
}

int main(void)
{
    set_point = spba_ref_from_f32(0.008f);
    spba_reset(&controller, curvature(), curvature(), 0); /* at rest where the plant is, output 0 */
    board_timer(SPBA_PERIOD_US, control);
    while (board_on()) {
        board_sleep();
    }
    printf("curvature %.4f 1/mm, flags %u\n", (double)shown, (unsigned)seen);
    return shown > 0.0078f && shown < 0.0082f && (seen & SPBA_FLAG_INPUT) == 0u ? 0 : 1;
}
