/* task.c: the controller in a task of an RTOS; others ask for set points, manual mode and what it does.
 *
 *   cc -std=c99 -I firmware -I examples/firmware examples/firmware/task.c \
 *      examples/firmware/board_host.c firmware/spba.c -o task && ./task
 *
 * The task alone touches the state. What it shares is copied under a lock (a mutex, or interrupts held off), and
 * no step runs while the lock is held.
 *
 * SPDX-License-Identifier: 0BSD
 */
#include <stdio.h>

#include "board.h"
#include "spba.h"

typedef struct {
    spba_sig set_point;
    spba_sig by_hand; /* the output in manual mode */
    int manual;
} wishes;

static wishes wanted;   /* under the lock */
static uint8_t flags;   /* under the lock */
static int awake;

static void tick(void)
{
    awake = 1; /* your RTOS: give a semaphore, or leave it to a delay until the next period */
}

static void wait_for_period(void)
{
    awake = 0;
    while (!awake) {
        board_sleep();
    }
}

/* From any other task. */
static void ask(wishes w)
{
    board_lock();
    wanted = w;
    board_unlock();
}

static spba_sig control_once(spba_state *controller)
{
    const spba_sig meas = spba_meas_from_f32((float)board_adc(0) * (0.02f / 4095.0f));
    const spba_sig sched = spba_sched_from_f32((float)board_adc(1) * (0.25f / 4095.0f));
    wishes now;
    spba_sig u;

    board_lock();
    now = wanted;
    board_unlock();
    u = spba_step(controller, now.manual ? meas : now.set_point, meas, sched);
    if (now.manual) {
        u = now.by_hand;
        spba_track(controller, u); /* so the way back has no bump */
    }
    board_dac((uint16_t)(spba_u_to_f32(u) * (4095.0f / 10.0f) + 0.5f));
    board_lock();
    flags = spba_flags(controller);
    board_unlock();
    return u;
}

int main(void)
{
    static spba_state controller;
    const wishes by_hand = {0, SPBA_U_MAX / 10, 1};
    const wishes automatic = {spba_ref_from_f32(0.008f), 0, 0};
    spba_sig last = 0;
    spba_sig first = 0;

    spba_init(&controller);
    ask(by_hand);
    board_timer(SPBA_PERIOD_US, tick);
    for (int k = 0; board_on(); k++) {
        wait_for_period();
        if (k == 100) {
            ask(automatic);
            first = last;
        }
        last = control_once(&controller);
        if (k == 100) {
            first = last - first;
        }
    }
    printf("%.4f V at the change, %.4f V at last\n", (double)spba_u_to_f32(first), (double)spba_u_to_f32(last));
    return flags == 0u && last > by_hand.by_hand ? 0 : 1;
}
