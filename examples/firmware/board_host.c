/* board_host.c: a board to try the examples on a computer: a valve of 40 ms and an actuator of 0.4 s.
 *
 * SPDX-License-Identifier: 0BSD
 */
#include <stdio.h>

#include "board.h"

static struct {
    double voltage, pressure, curvature;
    double now, seconds, period, due;
    void (*handler)(void);
    void (*comparator)(void);
} board = {0.0, 0.0, 0.0, 0.0, 8.0, 0.0, 0.0, 0, 0};

static uint16_t code(double share)
{
    return (uint16_t)(share < 0.0 ? 0.0 : share > 1.0 ? 4095.0 : share * 4095.0 + 0.5);
}

/* Of 12 V: it dips for a second. */
static double supply(void)
{
    return board.now > 4.0 && board.now < 5.0 ? 0.125 : 0.9;
}

uint16_t board_adc(int channel)
{
    return code(channel == 0 ? board.curvature / 0.02 : channel == 1 ? board.pressure / 0.25 : supply());
}

void board_dac(uint16_t value)
{
    board.voltage = 10.0 * (double)value / 4095.0;
}

void board_timer(uint32_t period_us, void (*handler)(void))
{
    board.period = 1e-6 * (double)period_us;
    board.due = board.now + board.period;
    board.handler = handler;
}

void board_comparator(void (*handler)(void))
{
    board.comparator = handler;
}

float board_knob(void)
{
    return board.now < 2.0 ? 1.0f : 1.25f;
}

void board_report(float curvature, uint8_t flags, uint8_t refused)
{
    printf("curvature %.4f 1/mm, flags %u, refused %u\n", (double)curvature, (unsigned)flags, (unsigned)refused);
}

void board_sleep(void)
{
    const double h = 0.001;

    do {
        board.pressure += (0.0998 * board.voltage - board.pressure) * h / 0.04;
        board.curvature += ((0.0015 + 0.345 * board.pressure) * board.pressure - board.curvature) * h / 0.4;
        board.now += h;
    } while (board.now + 1e-9 < board.due);
    board.due += board.period;
    board.handler();
    if (board.comparator && board.now > 6.0) { /* it fails for less than it takes to notice */
        board.comparator();
        board.comparator = 0;
    }
}

int board_on(void)
{
    return board.now < board.seconds;
}

void board_lock(void)
{
}

void board_unlock(void)
{
}
