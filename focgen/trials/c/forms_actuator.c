#include "forms.h"

/* ---- hysteresis ---- */

/* Everett's function of a Preisach density that is uneven in width (par[1]) and in level (par[2]). */
static double everett(const effect *e, double a, double b) {
    return a > b ? pow(a - b, e->par[1]) * (1.0 + e->par[2] * (a + b)) : 0.0;
}

/* Preisach's model by its memory of extrema, st[1 …]; st[0] counts them. Level from -0.3 on, in units of
 * the span. */
static double preisach(effect *e, double w) {
    const double low = -0.3;
    double *m = &e->st[2];
    int count = (int)e->st[0];          /* m[0], m[1], …: maximum, minimum, maximum, … */
    double last = count ? m[count - 1] : low;
    if (count == 0) m[count++] = w;
    else if (count % 2) {               /* the last entry is a maximum, rising or just turned */
        if (w >= last) m[count - 1] = w;
        else m[count++] = w;
    } else {
        if (w <= last) m[count - 1] = w;
        else m[count++] = w;
    }
    for (int wiped = 1; wiped && count >= 3;) {     /* what the new extremum passes is forgotten */
        int rising = count % 2;
        wiped = rising ? m[count - 1] >= m[count - 3] : m[count - 1] <= m[count - 3];
        if (wiped) { m[count - 3] = m[count - 1]; count -= 2; }
    }
    if (count > STATES - 6) {           /* the smallest loop gives way */
        m[count - 3] = m[count - 1];
        count -= 2;
    }
    e->st[0] = count;
    double sum = 0.0, floor_ = low;
    for (int i = 0; i < count; i += 2) {
        sum += everett(e, m[i], floor_);
        if (i + 1 < count) { sum -= everett(e, m[i], m[i + 1]); floor_ = m[i + 1]; }
    }
    return sum;
}

/* A share par[0] of the drive passes a Preisach operator; par[3] = span of the drive. */
double preisach_share(effect *e, const chain *c, double in, double t) {
    double w = fmax(in / e->par[3], -0.29), empty = everett(e, 0.0, -0.3), full = everett(e, 1.0, -0.3);
    (void)c, (void)t;
    double out = (preisach(e, w) - empty) / (full - empty);
    return in + e->par[0] * (e->par[3] * out - in);
}

/* Duhem friction whose hold grows with the level: par[0] amplitude, par[1] span, par[2] steepness, par[3]
 * power. */
double duhem_friction(effect *e, const chain *c, double in, double t) {
    double *before = &e->st[0], *H = &e->st[1];
    double move = (in - *before) / e->par[1];
    int parts = 1 + (int)(fabs(move) * e->par[2] * 10.0);
    (void)c, (void)t;
    *before = in;
    for (int i = 0; i < parts; i++) {
        double room = fmax(1.0 - copysign(*H, move * *H >= 0.0 ? 1.0 : -1.0), 0.0);
        *H += e->par[2] * move / parts * pow(room, e->par[3]);
    }
    return in - e->par[0] * e->par[1] * (0.4 + 0.6 * fmax(in, 0.0) / e->par[1]) * *H;
}

/* ---- slow and history-dependent ---- */

/* Logarithmic creep: the memory's kernel is ln(1 + t/t0); par[0] its share. */
double log_creep(effect *e, const chain *c, double in, double t) {
    (void)t;
    return in + e->par[0] * c->creep_now;
}

/* Thermally activated flow (Eyring): par[0] share, par[1] s, par[2] the stress at which flow becomes
 * exponential. */
double eyring_creep(effect *e, const chain *c, double in, double t) {
    double *strain = &e->st[0], s = e->par[2];
    (void)t;
    *strain += c->h / e->par[1] * s * sinh(fmin(fmax((c->v - *strain) / s, -8.0), 8.0));
    return in + e->par[0] * *strain;
}

/* Pseudo-elastic softening (Ogden and Roxburgh): stiff on the first way up, softer below the largest load
 * seen. */
double roxburgh(effect *e, const chain *c, double in, double t) {
    double *most = &e->kept[0], span = e->par[1];
    (void)c, (void)t;
    *most = fmax(*most, in);
    return in * (1.0 + e->par[0] * erf((*most - in) / (span * e->par[2] + e->par[3] * *most)) * *most / span);
}

/* Damage by the work done, saturating after par[2] strokes. */
double worked_soft(effect *e, const chain *c, double in, double t) {
    double *work = &e->kept[0], *before = &e->st[0], span = e->par[1];
    (void)c, (void)t;
    *work += fabs(in * in - *before * *before) / (span * span);
    *before = in;
    return in * (1.0 + e->par[0] * (1.0 - exp(-*work / e->par[2])));
}

/* Saturating gain drift: par[0] in the end, par[1] s. */
double warming_gain(effect *e, const chain *c, double in, double t) {
    (void)c;
    return in * (1.0 + e->par[0] * (1.0 - exp(-t / e->par[1])));
}

/* A smooth random way, zero at t = 0: par[0] amplitude, par[1] s, par[2 … 6] its half waves. */
static double wandering(const effect *e, double t) {
    double sum = 0.0;
    for (int i = 0; i < 5; i++) {
        double phase = M_PI * (i + 0.5) * t / e->par[1];
        sum += e->par[2 + i] * sin(phase) / ((i + 0.5) * (i + 0.5));
    }
    return e->par[0] * sum;
}

double wandering_gain(effect *e, const chain *c, double in, double t) {
    (void)c;
    return in * (1.0 + wandering(e, t));
}

/* ---- direction ---- */

/* The springpot is more viscous while it recovers: factor 1 + par[0], blended over par[1]. */
double recovery_viscosity(const effect *e, double pull) {
    return 1.0 + e->par[0] / (1.0 + exp(fmin(fmax(pull / e->par[1], -40.0), 40.0)));
}

/* Ribs that stick together while opening: a lag on the way down only, longer near zero. */
double sticky_release(effect *e, const chain *c, double in, double t) {
    double *z = &e->st[0];
    (void)t;
    if (in >= *z) return *z = in;
    double lag = e->par[0] * (1.4 - 0.8 * fmin(fmax(*z, 0.0) / e->par[1], 1.0));
    return *z += (in - *z) * (1.0 - exp(-c->h / lag));
}

/* ---- static curves ---- */

/* Chains that run out of length: linear at first, never beyond par[0]; par[1] how suddenly. */
double locking_chain(effect *e, const chain *c, double in, double t) {
    (void)c, (void)t;
    return in / pow(1.0 + pow(fabs(in) / e->par[0], e->par[1]), 1.0 / e->par[1]);
}

/* Ballooning: the gain passes a bump around par[2] of the span, of width par[3]. */
double balloon_curve(effect *e, const chain *c, double in, double t) {
    double w = in / e->par[1], s = 1.0 / e->par[3];
    (void)c, (void)t;
    double bump = tanh(s * (w - e->par[2])) + tanh(s * e->par[2]);
    return in + e->par[0] * e->par[1] * bump;
}

/* Slack that is taken up smoothly around par[0]: a soft hinge of width par[1]. */
double slack_hinge(effect *e, const chain *c, double in, double t) {
    double d = e->par[0], w = e->par[1];
    (void)c, (void)t;
    double at = (in - d) / w, zero = -d / w;
    return w * ((at > 30.0 ? at : log1p(exp(at))) - log1p(exp(zero)));
}

/* A preload par[0] before anything moves; the ramp after it is slightly curved over par[1]. */
double preload(effect *e, const chain *c, double in, double t) {
    double over = in - e->par[0];
    (void)c, (void)t;
    return over > 0.0 ? over - e->par[1] * (1.0 - exp(-over / e->par[1])) * 0.5 : 0.0;
}

/* ---- contact ---- */

/* Hertz: par[0] times the drive's span times (penetration / par[2])^1.5 beyond par[1] pushes back. */
void hertz_load(const effect *e, double x, double *force, double *stiffness) {
    double deep = (x - e->par[1]) / e->par[2];
    if (deep <= 0.0) return;
    *force += e->par[0] * e->par[2] * pow(deep, 1.5);
    *stiffness += e->par[0] * 1.5 * sqrt(deep);
}

/* A foam pad that hardens: logarithmic beyond par[1]; par[0] its depth. */
double foam_pad(effect *e, const chain *c, double in, double t) {
    double deep = in - e->par[1];
    (void)c, (void)t;
    return deep > 0.0 ? e->par[1] + e->par[0] * log1p(deep / e->par[0]) : in;
}

/* ---- resonance ---- */

static double oscillator(effect *e, const chain *c, double in, double hardening) {
    double *s = e->st, h = c->h / 4.0, w2 = e->par[1] * e->par[1];
    for (int i = 0; i < 4; i++) {
        double gap = in - s[0], rel = gap / e->par[3];
        s[1] += h * (w2 * gap * (1.0 + hardening * rel * rel) - 2.0 * e->par[2] * e->par[1] * s[1]);
        s[0] += h * s[1];
    }
    return s[0];
}

/* A share par[0] of the drive goes through a hardening oscillator: par[1] rad/s, par[2] damping, par[3]
 * span. */
double duffing_share(effect *e, const chain *c, double in, double t) {
    (void)t;
    return in + e->par[0] * (oscillator(e, c, in, 0.5) - in);
}

/* A mode beside the main motion, excited by the drive: only its vibration adds to the curvature. */
double side_mode(effect *e, const chain *c, double in, double t) {
    (void)t;
    return in + e->par[0] * (oscillator(e, c, c->v, 0.0) - c->v);
}
