#include "forms.h"

/* ---- static curves ---- */

/* Exponential (percolation) calibration, right at zero and at the span; par[0] bend, par[1] span. */
double exponential_curve(effect *e, const chain *c, double in, double t) {
    double b = e->par[0];
    (void)c, (void)t;
    return e->par[1] * expm1(b * in / e->par[1]) / expm1(b);
}

/* A voltage divider read as if it were linear. */
double divider_curve(effect *e, const chain *c, double in, double t) {
    double w = fmax(in / e->par[1], -0.5), b = e->par[0];
    (void)c, (void)t;
    return e->par[1] * w * (1.0 + b) / (1.0 + b * w);
}

/* ---- direction ---- */

/* The reading hangs back, the more the longer the strain goes one way; uneven up (par[2]) and down
 * (par[3]). */
double uneven_hang(effect *e, const chain *c, double in, double t) {
    double *before = &e->st[0], *hang = &e->st[1], move = (in - *before) / e->par[1];
    (void)c, (void)t;
    *before = in;
    double reach = move > 0.0 ? e->par[2] : e->par[3], goal = move > 0.0 ? 1.0 : -1.0;
    *hang = goal + (*hang - goal) * exp(-fabs(move) / reach);
    return in - e->par[0] * e->par[1] * *hang;
}

/* Two calibration curves, one up, one down, that meet at both ends; the way between them takes par[2] of
 * the span. */
double lens_curves(effect *e, const chain *c, double in, double t) {
    double *before = &e->st[0], *side = &e->st[1], move = (in - *before) / e->par[1];
    double w = fmin(fmax(in / e->par[1], 0.0), 1.0);
    (void)c, (void)t;
    *before = in;
    *side = fmin(fmax(*side + 2.0 * move / e->par[2], -1.0), 1.0);
    return in - e->par[0] * e->par[1] * 4.0 * w * (1.1 - w) * *side;
}

/* ---- electrical relaxation ---- */

/* The memory holds a stretched exponential of the strain's increments; par[0] its share. */
double stretched_relaxation(effect *e, const chain *c, double in, double t) {
    (void)t;
    return in + e->par[0] * c->electrode_now;
}

/* Broken contacts that heal faster the more there are: par[0] share, par[1] s, par[2] span. */
double healing_contacts(effect *e, const chain *c, double in, double t) {
    double *before = &e->st[0], *broken = &e->st[1];
    (void)t;
    *broken += in - *before - *broken * (1.0 + 2.0 * fabs(*broken) / e->par[2]) * c->h / e->par[1];
    *before = in;
    return in + e->par[0] * *broken;
}

/* ---- bandwidth ---- */

/* Second-order Bessel low pass, par[0] s of delay at low frequency. */
double bessel_filter(effect *e, const chain *c, double in, double t) {
    double *s = e->st, h = c->h / 8.0, w = sqrt(3.0) / e->par[0];
    (void)t;
    for (int i = 0; i < 8; i++) {
        s[1] += h * (w * w * (in - s[0]) - 1.7320508 * w * s[1]);
        s[0] += h * s[1];
    }
    return s[0];
}

/* Surface and bulk: a share par[1] lags by par[0] s, the rest by an eighth of it. */
double two_depths(effect *e, const chain *c, double in, double t) {
    (void)t;
    e->st[0] += (in - e->st[0]) * (1.0 - exp(-c->h / e->par[0]));
    e->st[1] += (in - e->st[1]) * (1.0 - exp(-8.0 * c->h / e->par[0]));
    return e->par[1] * e->st[0] + (1.0 - e->par[1]) * e->st[1];
}

/* ---- drift ---- */

/* Warming of the electronics: par[0] in the end, par[1] s, with a slow swing on it. */
double warming_offset(effect *e, const chain *c, double in, double t) {
    (void)c;
    return in + e->par[0] * (1.0 - exp(-t / e->par[1]) + 0.15 * sin(2.0 * M_PI * t / (1.7 * e->par[1])));
}

/* A smooth random way: par[0] amplitude, par[1] s, par[2 … 6]. */
double wandering_offset(effect *e, const chain *c, double in, double t) {
    double sum = 0.0;
    (void)c;
    for (int i = 0; i < 5; i++) {
        double k = i + 0.5;
        sum += e->par[2 + i] * sin(M_PI * k * t / e->par[1]) / (k * k);
    }
    return in + e->par[0] * sum;
}

/* ---- amplifier and converter ---- */

/* An amplifier that compresses before its limit par[0]: a soft knee of width par[1]. */
double soft_rail(effect *e, const chain *c, double in, double t) {
    double over = (in - e->par[0]) / e->par[1];
    (void)c, (void)t;
    return in - e->par[1] * (over > 30.0 ? over : log1p(exp(over)));
}

/* A hard rail at par[0] that takes par[1] s to let go again. */
double sticky_rail(effect *e, const chain *c, double in, double t) {
    double *depth = &e->st[0], over = fmax(in - e->par[0], 0.0);
    (void)t;
    *depth = over > 0.0 ? 1.0 : *depth * exp(-c->h / e->par[1]);
    double out = fmin(in, e->par[0]), below = fmin(e->par[0] - out, 0.02 * e->par[0]);
    return over > 0.0 || *depth < 0.05 ? out : out + *depth * below;
}

/* A converter with steps par[0], mid-tread, whose comparator needs par[1] of a step more to come back. */
double lazy_converter(effect *e, const chain *c, double in, double t) {
    double *code = &e->st[0], at = in / e->par[0] - *code;
    (void)c, (void)t;
    if (fabs(at) > 0.5 + 0.5 * e->par[1]) *code = floor(in / e->par[0] + 0.5);
    return *code * e->par[0];
}

/* Truncation with uneven steps: par[0] nominal, par[1] unevenness, par[2] phase. */
double uneven_converter(effect *e, const chain *c, double in, double t) {
    double q = e->par[0], code = floor(in / q + 0.5);
    (void)c, (void)t;
    for (double try = code + 1.0; try >= code - 1.0; try -= 1.0)
        if (in >= q * (try - 0.5 + e->par[1] * sin(12.9898 * try + e->par[2]))) return q * try;
    return q * (code - 1.0);
}
