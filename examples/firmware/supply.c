/* supply.c: limits that follow a supply, a gain that is turned while it runs, and a power failure.
 *
 *   focgen generate examples/firmware/supply.toml --out firmware --tunable
 *   cc -std=c99 -I firmware -I examples/firmware examples/firmware/supply.c \
 *      examples/firmware/board_host.c firmware/valve.c -o supply && ./supply
 *
 * Two interrupts of one priority own the controller: the timer's steps it, the supply's comparator saves it. So a
 * save never sees half a step. The main loop turns the gain: it writes one number and raises a flag behind it.
 *
 * SPDX-License-Identifier: 0BSD
 */
#include "board.h"
#include "valve.h"

#define FULL_SCALE 4095.0f

typedef struct {
    valve_params params;
    uint16_t supply; /* the code that params.u_max was made of */
} tuning;

static struct {
    uint8_t state[VALVE_SAVED_BYTES];
    tuning by;
} kept BOARD_KEPT; /* in memory that outlives the failure */

static valve_state controller;
static tuning now_by;            /* the interrupts' own, as the controller is */
static volatile float wanted;    /* factor on the gains */
static volatile uint8_t turned;  /* there is a new one */
static volatile uint8_t refused; /* what valve_tune said, other than 0 */

static valve_sig curvature(void)
{
    return valve_meas_from_f32((float)board_adc(0) * (0.02f / FULL_SCALE));
}

/* New parameters, where the supply has moved or the gain was turned. What is outside the box changes nothing. */
static void follow(void)
{
    tuning next = now_by;
    uint8_t said;
    uint16_t i;

    next.supply = board_adc(2);
    if (next.supply == now_by.supply && !turned) {
        return;
    }
    next.params.u_max = valve_u_from_f32((float)next.supply * (12.0f / FULL_SCALE)); /* what the driver can give */
    if (next.params.u_max > VALVE_U_MAX) {
        next.params.u_max = VALVE_U_MAX;
    }
    for (i = 0; i < VALVE_GAINS && turned; i++) {
        next.params.gain[i] = valve_gain_from_f32(wanted);
    }
    turned = 0;
    said = valve_tune(&controller, &next.params);
    if (said == 0u) {
        now_by = next;
    }
    refused = (uint8_t)(refused | said);
}

/* The timer's interrupt. */
static void control(void)
{
    valve_sig u;

    follow();
    u = valve_step(&controller, valve_ref_from_f32(0.012f), curvature(),
                   valve_sched_from_f32((float)board_adc(1) * (0.25f / FULL_SCALE)));
    board_dac((uint16_t)(valve_u_to_f32(u) * (FULL_SCALE / 10.0f) + 0.5f));
}

/* The comparator's: some milliseconds are left. */
static void power_fails(void)
{
    valve_save(&controller, kept.state);
    kept.by = now_by;
}

/* Where there is no good copy, begin where the plant is; the first tick tunes then. */
static void boot(void)
{
    valve_init(&controller);
    valve_default(&now_by.params);
    now_by.supply = 0xffff; /* no code of the converter's */
    if (valve_restore(&controller, kept.state) != 0u) {
        valve_reset(&controller, curvature(), curvature(), 0);
    } else if (valve_check(&kept.by.params) == 0u) {
        now_by = kept.by;
    } else {
        (void)valve_tune(&controller, &now_by.params);
    }
}

int main(void)
{
    boot();
    board_comparator(power_fails);
    board_timer(VALVE_PERIOD_US, control);
    while (board_on()) {
        board_sleep();
        if (board_knob() != wanted) { /* the bench engineer's */
            wanted = board_knob();
            turned = 1;
        }
    }
    board_report((float)board_adc(0) * (0.02f / FULL_SCALE), valve_flags(&controller), refused);
    return refused;
}
