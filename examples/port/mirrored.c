/* mirrored.c: a history that stands twice in memory, so that its sum is one straight loop.
 *
 * test_port.py shows it equal in every bit to what focgen would have written. With -DFOUR_SUMS the loop adds
 * up four sums at once, as a vector unit does: other last digits, and still within the proven bound.
 *
 * SPDX-License-Identifier: 0BSD
 */
#include "mirrored.h"

/* The weights of 0.4 s^0.5 + 1, the oldest first, as focgen has them; and 3 times h/2. */
static const float weights[MIRRORED_TAPS] = {
    -0.0137890643f, -0.0147083346f, -0.0157344975f, -0.0168858021f,
    -0.0181847103f, -0.0196591467f, -0.0213442165f, -0.0232845992f,
    -0.0255379472f, -0.0281798039f, -0.0313108936f, -0.0350682028f,
    -0.0396423154f, -0.0453055017f, -0.0524590015f, -0.0617164746f,
    -0.0740597695f,  -0.091150485f,  -0.116009705f,  -0.154679611f,
     -0.220970869f,  -0.353553385f,  -0.707106769f,   -2.82842708f,
       6.65685415f,
};
static const float gain = 0.00749999983f;

static float limited(float u)
{
    return u < 0.0f ? 0.0f : u > 10.0f ? 10.0f : u;
}

/* The nearest count of 2^-57, halves away from zero, at most 2^61. */
static int64_t counts(float x)
{
    const double wide = (double)x * 0x1p57;

    if (wide >= 0x1p61 || wide <= -0x1p61) {
        return wide > 0.0 ? (int64_t)1 << 61 : -((int64_t)1 << 61);
    }
    return (int64_t)(wide + (wide < 0.0 ? -0.5 : 0.5));
}

static float value(int64_t n)
{
    return (float)n * 0x1p-57f;
}

/* What NaN, infinity and absurd numbers are not. */
static int usable(float x)
{
    return x > -281474976710656.0f && x < 281474976710656.0f;
}

static float filtered(const mirrored_state *s)
{
    const float *x = &s->errors[s->oldest];
    int i;
#ifdef FOUR_SUMS
    float sums[4] = {0.0f, 0.0f, 0.0f, 0.0f};

    for (i = 0; i < MIRRORED_TAPS; i++) {
        sums[i & 3] += weights[i] * x[i];
    }
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
#else
    float sum = 0.0f;

    for (i = 0; i < MIRRORED_TAPS; i++) {
        sum += weights[i] * x[i];
    }
    return sum;
#endif
}

void mirrored_reset(mirrored_state *s, float ref, float meas, float u0)
{
    const float error = usable(ref) && usable(meas) ? ref - meas : 0.0f;
    int i;

    for (i = 0; i < 2 * MIRRORED_TAPS; i++) {
        s->errors[i] = error;
    }
    s->oldest = 0;
    s->before = counts(gain * filtered(s));
    s->output = counts(limited(usable(u0) ? u0 : 0.0f));
}

float mirrored_step(mirrored_state *s, float ref, float meas)
{
    const int64_t high = counts(10.0f);
    int64_t now;

    if (!usable(ref) || !usable(meas)) {
        return value(s->output);
    }
    s->errors[s->oldest] = s->errors[s->oldest + MIRRORED_TAPS] = ref - meas;
    s->oldest = s->oldest + 1 >= MIRRORED_TAPS ? 0 : s->oldest + 1;
    now = counts(gain * filtered(s));
    s->output += now + s->before;
    s->output = s->output < 0 ? 0 : s->output > high ? high : s->output;
    s->before = now;
    return value(s->output);
}

void mirrored_track(mirrored_state *s, float u)
{
    if (usable(u)) {
        s->output = counts(limited(u));
    }
}
