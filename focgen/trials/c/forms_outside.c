#include "forms.h"

/* Effects that no name of the vocabulary covers. */

static double noise(effect *e) {    /* uniform in (0, 1); a linear congruence kept across rests */
    uint64_t s = (uint64_t)e->kept[0] * 6364136223846793ULL % 4503599627370449ULL;
    e->kept[0] = (double)((s + 1442695040888963ULL) % 4503599627370449ULL);
    return e->kept[0] / 4503599627370449.0;
}

/* A random telegraph: on for par[on] s and off for par[off] s on average. */
static int gate(effect *e, const chain *c, double on, double off) {
    if (noise(e) < c->h / (e->st[0] > 0.0 ? on : off)) e->st[0] = e->st[0] > 0.0 ? 0.0 : 1.0;
    return e->st[0] > 0.0;
}

/* Compressor strokes on the regulated pressure: par[0] amplitude, par[1] Hz, wandering phase. */
double supply_ripple(effect *e, const chain *c, double in, double t) {
    (void)t;
    e->st[1] += 2.0 * M_PI * e->par[1] * c->h * (1.0 + 0.6 * (noise(e) - 0.5));
    return in + e->par[0] * (sin(e->st[1]) + 0.4 * sin(2.0 * e->st[1] + 1.0));
}

/* A seam that opens and closes at random: par[0] of the pressure escapes meanwhile. */
double opening_seam(effect *e, const chain *c, double in, double t) {
    (void)t;
    double lost = gate(e, c, e->par[1], e->par[2]) ? e->par[0] * fmax(in, 0.0) : 0.0;
    e->st[1] += (lost - e->st[1]) * (1.0 - exp(-c->h / 0.2));
    return in - e->st[1];
}

/* The room's air conditioning: a baseline that swings with par[1] s. */
double room_swing(effect *e, const chain *c, double in, double t) {
    double phase = 2.0 * M_PI * t / e->par[1] + e->par[2];
    (void)c;
    return in + e->par[0] * (sin(phase) + 0.3 * sin(3.0 * phase));
}

/* A joint that works loose and catches again: the gain toggles at random. */
double loose_joint(effect *e, const chain *c, double in, double t) {
    (void)t;
    double goal = gate(e, c, e->par[1], e->par[2]) ? e->par[0] : 0.0;
    e->st[1] += (goal - e->st[1]) * (1.0 - exp(-c->h / 0.1));
    return in * (1.0 - e->st[1]);
}

/* Play par[1] whose ends are met with a knock that rings: par[0] amplitude, par[2] rad/s, par[3] s. */
double knocking_play(effect *e, const chain *c, double in, double t) {
    double *z = &e->st[0], *pushed = &e->st[1], *since = &e->st[2], *sign = &e->st[3], *last = &e->st[4];
    double way = in > *z + e->par[1] ? 1.0 : in < *z - e->par[1] ? -1.0 : 0.0;
    (void)t;
    *since += c->h;
    if (way != 0.0) {
        *z = in - way * e->par[1];
        if (way != *pushed && *since > 0.3) { *since = 0.0; *sign = way; *last = 1.0; }
        *pushed = way;
    }
    return *z + *last * *sign * e->par[0] * sin(e->par[2] * *since) * exp(-*since / e->par[3]);
}

/* Pick-up of a neighbour's drive: bursts of par[1] Hz. */
double pick_up(effect *e, const chain *c, double in, double t) {
    int on = gate(e, c, e->par[2], e->par[3]);
    e->st[1] += ((on ? 1.0 : 0.15) - e->st[1]) * (1.0 - exp(-c->h / 0.3));
    return in + e->par[0] * e->st[1] * sin(2.0 * M_PI * e->par[1] * t);
}

/* A loose plug: the reading falls away for moments. */
double loose_plug(effect *e, const chain *c, double in, double t) {
    (void)t;
    int was = e->st[0] > 0.0, on = gate(e, c, e->par[1], e->par[2]);
    if (on && !was) e->st[1] = noise(e);
    return on ? in - e->par[0] * (0.5 + e->st[1]) : in;
}

/* The reading cannot tell the side: folded about par[0]. par[1] rounds the fold. */
double folded_reading(effect *e, const chain *c, double in, double t) {
    double at = e->par[0], round = e->par[1], away = in - at;
    (void)c, (void)t;
    return hypot(away, round) - hypot(at, round);
}
