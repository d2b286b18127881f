#include "forms.h"

/* ---- on the command ---- */

/* Spool held by static friction par[0]; once loose it slides, with lag par[2], until kinetic friction
 * par[1] holds. */
double spool_friction(effect *e, const chain *c, double in, double t) {
    double *x = &e->st[0], *sliding = &e->st[1], pull = in - *x;
    (void)t;
    if (fabs(pull) > e->par[0]) *sliding = 1.0;
    if (*sliding > 0.0) {
        double excess = fmax(fabs(pull) - e->par[1], 0.0);
        *x += copysign(excess * (1.0 - exp(-c->h / e->par[2])), pull);
        if (excess < 0.02 * (e->par[0] - e->par[1]) + 1e-12) *sliding = 0.0;
    }
    return *x;
}

/* After each reversal nothing moves over a band S = par[0]; then a jump J = par[1], then following. */
double stick_band(effect *e, const chain *c, double in, double t) {
    double *last = &e->st[0], *turn = &e->st[1], *out = &e->st[2], *way = &e->st[3], *held = &e->st[4];
    double move = in - *last;
    (void)c, (void)t;
    if (move * *way < 0.0 || (*way == 0.0 && move != 0.0)) {
        *turn = *last;
        *way = move > 0.0 ? 1.0 : -1.0;
        *held = 1.0;
    }
    *last = in;
    if (*held > 0.0 && fabs(in - *turn) > e->par[0]) *held = 0.0;
    if (*held == 0.0 && *way != 0.0) *out = in - *way * 0.5 * (e->par[0] - e->par[1]);
    return *out;
}

/* ---- on the pressure ---- */

static double delayed(effect *e, double in, double steps) {
    int64_t whole = (int64_t)floor(steps);
    double part = steps - (double)whole;
    e->ring[e->at % RING] = in;
    double near = e->at >= whole ? e->ring[(e->at - whole) % RING] : 0.0;
    double far = e->at > whole ? e->ring[(e->at - whole - 1) % RING] : 0.0;
    e->at++;
    return near + part * (far - near);
}

/* A wave along the tube: par[0] s. */
double tube_wave(effect *e, const chain *c, double in, double t) {
    (void)t;
    return delayed(e, in, e->par[0] / c->h);
}

/* Most of par[0] s as a wave, the rest as six small volumes in a row. */
double tube_cells(effect *e, const chain *c, double in, double t) {
    double share = exp(-c->h / (e->par[0] * 0.2 / 6.0));
    double value = delayed(e, in, 0.8 * e->par[0] / c->h);
    (void)t;
    for (int i = 0; i < 6; i++) {
        double *inlet = &e->st[i], *cell = &e->st[6 + i], mean = 0.5 * (*inlet + value);
        *inlet = value;
        value = *cell = mean + share * (*cell - mean);
    }
    return value;
}

/* A resistive, compliant line of three cells, par[0] s each; four small Euler steps. */
double line_ladder(effect *e, const chain *c, double in, double t) {
    double *s = e->st;
    (void)t;
    for (int i = 0; i < 8; i++) {
        double k = c->h / (8.0 * e->par[0]);
        double d0 = in - 2.0 * s[0] + s[1], d1 = s[0] - 2.0 * s[1] + s[2], d2 = s[1] - s[2];
        s[0] += k * d0, s[1] += k * d1, s[2] += k * d2;
    }
    return s[2];
}

/* Overdamped second order: natural frequency par[0] rad/s, damping par[1]. */
double second_order(effect *e, const chain *c, double in, double t) {
    double *s = e->st, h = c->h / 4.0;
    (void)t;
    for (int i = 0; i < 4; i++) {
        s[1] += h * (e->par[0] * e->par[0] * (in - s[0]) - 2.0 * e->par[1] * e->par[0] * s[1]);
        s[0] += h * s[1];
    }
    return s[0];
}

/* Compressible flow through an orifice (critical ratio 0.528), 1 where it chokes. */
static double orifice(double upstream, double downstream) {
    double ratio = downstream / upstream;
    if (ratio >= 1.0) return 0.0;
    return ratio <= 0.528 ? 1.0 : sqrt(1.0 - pow((ratio - 0.528) / 0.472, 2.0));
}

/* The exhaust is an orifice to the atmosphere: at most par[0] span/s, proportional within par[2] of the set
 * pressure. par[1] = span, par[3] = atmosphere, par[4] < 0: the filling side instead, from par[5]. */
double exhaust_orifice(effect *e, const chain *c, double in, double t) {
    double *p = &e->st[0], atm = e->par[3], sign = e->par[4] < 0.0 ? -1.0 : 1.0;
    double gap = sign * (*p - in), most;
    (void)t;
    if (sign > 0.0) most = orifice(*p + atm, atm) * (*p + atm) / (e->par[1] + atm);
    else most = orifice(e->par[5] + atm, *p + atm);
    if (gap <= 0.0) return *p = in;
    double flow = e->par[0] * e->par[1] * most * fmin(gap / e->par[2], 1.0);
    double moved = fmin(flow * c->h, gap);
    return *p -= sign * moved;
}

/* Laminar exhaust: the gap closes at a rate that grows with absolute pressure; par[0] s, par[1] span. */
double exhaust_laminar(effect *e, const chain *c, double in, double t) {
    double *p = &e->st[0], gap = *p - in;
    (void)t;
    if (gap <= 0.0) return *p = in;
    double rate = (0.5 + 0.8 * fmax(*p, 0.0) / e->par[1]) / e->par[0];
    return *p -= gap * (1.0 - exp(-rate * c->h));
}

/* A servo valve whose opening saturates softly: rate at most par[0], small gaps closed within par[1] s. */
double flow_servo(effect *e, const chain *c, double in, double t) {
    double *p = &e->st[0], h = c->h / 4.0;
    (void)t;
    for (int i = 0; i < 4; i++) {
        double want = (in - *p) / e->par[1];
        *p += h * want / sqrt(1.0 + want * want / (e->par[0] * e->par[0]));
    }
    return *p;
}

/* Choked both ways: nearly constant flow, par[0] per s, a little dependent on the level; par[1] span. */
double flow_choked(effect *e, const chain *c, double in, double t) {
    double *p = &e->st[0], level = *p / e->par[1];
    double up = e->par[0] * (1.05 - 0.1 * level), down = e->par[0] * (0.95 + 0.1 * level);
    (void)t;
    return *p = fmin(fmax(in, *p - down * c->h), *p + up * c->h);
}

/* Supply at par[0], approached softly over par[1]. */
double supply_soft(effect *e, const chain *c, double in, double t) {
    double over = (in - e->par[0]) / e->par[1];
    (void)c, (void)t;
    return in - e->par[1] * (over > 30.0 ? over : log1p(exp(over)));
}

/* A tank at par[0] that filling drains (par[1]) and the compressor refills within par[2] s. */
double supply_tank(effect *e, const chain *c, double in, double t) {
    double *sag = &e->st[0], *p = &e->st[1], before = *p;
    (void)t;
    *p = fmin(in, e->par[0] - *sag);
    *sag += e->par[1] * fmax(*p - before, 0.0) - *sag * c->h / e->par[2];
    return *p;
}

/* A turbulent leak behind a restriction: the chamber sags by par[0] sqrt-like, within par[1] s; par[2]
 * span. */
double leak_turbulent(effect *e, const chain *c, double in, double t) {
    double *sag = &e->st[0], level = fmax(in - *sag, 0.0) / e->par[2];
    double lost = e->par[0] * e->par[2] * sqrt(level * (level + 0.15)) / sqrt(1.15);
    (void)t;
    *sag += (lost - *sag) * (1.0 - exp(-c->h / e->par[1]));
    return in - *sag;
}

/* A laminar leak (a crack): the difference of squared absolute pressures. par as above, par[3] atmosphere. */
double leak_laminar(effect *e, const chain *c, double in, double t) {
    double *sag = &e->st[0], p = fmax(in - *sag, 0.0), span = e->par[2], atm = e->par[3];
    double lost = e->par[0] * span * p * (p + 2.0 * atm) / (span * (span + 2.0 * atm));
    (void)t;
    *sag += (lost - *sag) * (1.0 - exp(-c->h / e->par[1]));
    return in - *sag;
}
