/* board_m4.c: a Cortex-M4 in an emulator, whose pins are words of memory; see tests/docs/test_supply.py.
 *
 * SPDX-License-Identifier: 0BSD
 */
#include "board.h"

/* 0 to 2: the converter's codes; 3: that of the DAC; 4, 5: the timer's period and handler; 6: the comparator's
   handler; 7: ticks so far; 8: the knob; 9: 0 to end; 10 to 12: the report. */
#define PIN(n) (((volatile uint32_t *)0x40000000u)[n])

static float as_float(uint32_t bits)
{
    union {
        uint32_t bits;
        float value;
    } view;

    view.bits = bits;
    return view.value;
}

uint16_t board_adc(int channel)
{
    return (uint16_t)PIN(channel);
}

void board_dac(uint16_t code)
{
    PIN(3) = code;
}

void board_timer(uint32_t period_us, void (*handler)(void))
{
    PIN(4) = period_us;
    PIN(5) = (uint32_t)handler;
}

void board_comparator(void (*handler)(void))
{
    PIN(6) = (uint32_t)handler;
}

float board_knob(void)
{
    return as_float(PIN(8));
}

void board_report(float curvature, uint8_t flags, uint8_t refused)
{
    PIN(10) = (uint32_t)(curvature * 1e6f);
    PIN(11) = flags;
    PIN(12) = refused;
}

/* A core would stop at WFI; here it looks. */
void board_sleep(void)
{
    const uint32_t ticks = PIN(7);

    while (PIN(7) == ticks && board_on()) {
    }
}

int board_on(void)
{
    return PIN(9) != 0u;
}

void board_lock(void)
{
}

void board_unlock(void)
{
}

int main(void);
void board_start(void);
void focgen_halt(void);

/* The emulator stops when it gets here: the end of a program, or of an interrupt. */
__attribute__((noinline, used)) void focgen_halt(void)
{
    for (;;) {
        __asm volatile("");
    }
}

/* What comes first: memory is as a start-up file leaves it. */
__attribute__((used)) void board_start(void)
{
    (void)main();
}
