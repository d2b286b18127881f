/* main.c: a loop around a generated controller, on a computer. From the project's root:
 *
 *   focgen generate examples/controller.toml --out firmware
 *   cc -std=c99 -O2 -ffp-contract=off -I firmware examples/main.c firmware/spba.c -o loop && ./loop
 *
 * The actuator here is a crude stand-in: two lags. On hardware read_pressure and read_curvature read the
 * ADC, write_voltage the DAC, and a timer calls the loop every SPBA_SAMPLE_TIME seconds. The first second
 * is manual: somebody holds the valve at 1 V, and the controller follows, so that it takes over without a
 * bump.
 *
 * SPDX-License-Identifier: 0BSD
 */
#include <stdint.h>
#include <stdio.h>

#include "spba.h"

typedef struct {
    double voltage;   /* V */
    double pressure;  /* bar */
    double curvature; /* 1/mm */
} plant;

static void write_voltage(plant *p, double voltage)
{
    const double h = (double)SPBA_SAMPLE_TIME;
    const double at_rest = (0.0015 + 0.345 * p->pressure) * p->pressure;

    p->voltage = voltage;
    p->curvature += (at_rest - p->curvature) * h / 0.4;
    p->pressure += (0.0998 * voltage - p->pressure) * h / 0.04;
}

/* The nearest count, halves away from zero; an ADC of the right scale saves this. In f32 and f64 signals
   are in their units, and nothing is rounded. */
static spba_sig counts(double value, double lsb)
{
    return (spba_sig)(value / lsb + (value < 0.0 ? -0.5 : 0.5));
}

static spba_sig read_curvature(const plant *p)
{
    return counts(p->curvature, (double)SPBA_REF_LSB);
}

static spba_sig read_pressure(const plant *p)
{
    return counts(p->pressure, (double)SPBA_SCHED_LSB);
}

int main(void)
{
    static spba_state controller;
    plant p = {0.0, 0.0, 0.0};
    const spba_sig ref = counts(0.008, (double)SPBA_REF_LSB);
    const spba_sig by_hand = counts(1.0, (double)SPBA_U_LSB);
    int k;

    spba_reset(&controller, read_curvature(&p), read_curvature(&p), by_hand);
    printf("  t/s    u/V  1/mm\n");
    for (k = 0; k < 600; k++) {
        const int manual = k < 100;
        const spba_sig target = manual ? read_curvature(&p) : ref;
        const spba_sig u = spba_step(&controller, target, read_curvature(&p), read_pressure(&p));

        if (manual) {
            spba_track(&controller, by_hand);
        }
        if (k % 50 == 0) {
            printf("%5.2f %6.3f  %.5f%s%s\n", k * (double)SPBA_SAMPLE_TIME, p.voltage, p.curvature,
                   manual ? "  by hand" : "",
                   (spba_flags(&controller) & SPBA_FLAG_HIGH) != 0u ? "  at 10 V" : "");
        }
        write_voltage(&p, (double)(manual ? by_hand : u) * (double)SPBA_U_LSB);
    }
    return p.curvature > 0.0078 && p.curvature < 0.0082 ? 0 : 1;
}
