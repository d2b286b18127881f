/* A plant of first or second order with dry friction and a hysteretic spring in its own equation:
 *     m y'' + c y' + k y = u - F - w   or   m y' + k y = u - F - w.
 * F is Coulomb's: `slide` against the velocity, up to `stick` where nothing moves; of a plant of second order it rises by `rise`
 * (1 - exp(-|y'|/speed)) as it moves. w = soft (q - y) is what a hysteretic
 * spring takes away from the linear one: dq/dy = 1 - K |p|^power scale^(1 - power), p = q in the direction of motion, with K = `loading`
 * where p > 0 and -`unloading` where it is not (Bouc and Wen). Beside it the spring may bend, and an obstacle push, as in bent.h: w
 * holds that, too. A `preload` presses a plant of second order against a seat at y = 0, which catches what comes back to it: there
 * nothing moves until more than the preload pushes, and on either side that much is lost. A damper may be `falling` as strong as the
 * plant falls back to 0, where it is of second order: it has tables of its own.
 *
 * Between events the equation is linear, and a step is exact for an input that is a cubic: tables hold, for steps of h/2^level from
 * `level` = base on, what the state and the four coefficients of the input count. w is a cubic through its values and slopes at the
 * ends of a step. Where friction rises with the speed, the tables are those of a damper about as strong as it is at that speed, and what
 * is left of it is a cubic, too. Where that changes much within a step, steps are halved, down to `fine`. Where the velocity
 * changes sign or the friction gives way, they are halved down to `last`, and what is left there is run along a line, or, where nothing
 * holds what moves, in a step like any other.
 */
#include <math.h>
#include <string.h>
#include "bent.h"
#include "kernels.h"

enum { DIPS = 3, TERMS = 9 }; /* TERMS: of the exponential series */
enum { LONG = 4000 }; /* samples at most of a rest */
enum { DAMPERS = TABLES - 2, PLAIN = DAMPERS, FALLING }; /* tables: of dampers that stand for friction, the plant's own, as it falls */
static const double NEAR = 0.1, BESIDE = 0.03; /* how far Taylor series go: of q, as a part of it; of powers and exponentials */
static const double SAME = 0.01;    /* part of its steepness by which q's differs along a displacement that is as good as another */
static const double FEW = 0.1;      /* part of its steepness that q loses where it is taken from the way since 0 */
static const double APART = 0.1;    /* of `speed` from one damper that stands for friction to the next */
static const double LEAP = 0.5;     /* of `speed`: what a step may change the velocity by, about 0 */
static const double TINY = 0.05;    /* what a step has to be below, in the norm of its matrix, for the series to end */
static const double STILL = 1e-6;   /* part of the way that a plant at rest may still go in a sample */
static const double NOTHING = 40.0; /* speeds at which an exponential is 0 */

typedef struct {
    int order, base, fine, last;
    double h, m, c, k, slide, stick, soft, loading, unloading, power, scale, rise, speed;
    const double *bend;
    int bends, curved; /* whether the spring bends or meets an obstacle; whether there is a w, or friction that depends on the speed */
    double preload, falling, brisk; /* brisk: 1/s, of the longest step beside what rises as steeply as about 0 */
    int smooth;                     /* whether nothing changes at once as it turns round */
    char made[DAMPERS];             /* which tables are made, */
    double *tables;                 /* each of COUNTS numbers for every level: of DAMPERS, PLAIN, FALLING */
} Plant;

typedef struct {
    double y, v, q, grown; /* grown: |q|^power scale^(1 - power) */
    double speed, spared;  /* a magnitude of the velocity and exp(-|v|/speed) there, */
    double leap;           /* and how many times too long the step is that led here */
    int moving, side;      /* the sign of the velocity, 0: stuck; the side of the seat, 0: on it; */
    int turned;            /* whether a smooth plant turned round on the step that led here, by more than a `LEAP` */
} State;

/* Whether it moves towards 0 under a damper that is another there. */
static int falls(const Plant *p, const State *s) { return p->falling != p->c && s->moving * s->y < 0.0; }

static double damper(const Plant *p, const State *s) { return falls(p, s) ? p->falling : p->c; }

static double taken(const Plant *p, const State *s)
{
    double slope;
    return (p->soft != 0.0 ? p->soft * (s->q - s->y) : 0.0) + (p->bends ? pull(p->bend, s->y, &slope) : 0.0);
}

/* |q|^power scale^(1 - power), from `then` where it was so at `old`: near there by the binomial series. */
static double grown(const Plant *p, double q, double old, double then)
{
    double n = p->power, e = (q - old) / old;
    if (n == 1.0) return fabs(q);
    if (!(fabs(e) < BESIDE)) return p->scale * exp(n * log(fabs(q) / p->scale));
    double last = 1.0 + (n - 3.0) / 4.0 * e * (1.0 + (n - 4.0) / 5.0 * e);
    return then * (1.0 + n * e * (1.0 + (n - 1.0) / 2.0 * e * (1.0 + (n - 2.0) / 3.0 * e * last)));
}

/* dq/dy where q in the direction of motion is `q`. */
static double steepness(const Plant *p, double q, double grown) { return 1.0 - (q > 0.0 ? p->loading : -p->unloading) * grown; }

/* exp(-|v|/speed) at the state's velocity, from where it was known: near there by its series. */
static double spared(const Plant *p, State *s)
{
    double now = fabs(s->v), e = (s->speed - now) / p->speed;
    s->speed = now;
    if (now > NOTHING * p->speed) { /* kept, it would shrink to numbers that processors are slow with */
        s->speed = INFINITY;
        return 0.0;
    }
    double end = 1.0 + e / 4.0 * (1.0 + e / 5.0 * (1.0 + e / 6.0));
    if (fabs(e) < BESIDE) s->spared *= 1.0 + e * (1.0 + e / 2.0 * (1.0 + e / 3.0 * end));
    else s->spared = exp(-now / p->speed);
    return s->spared;
}

/* What friction has risen by, against the side `sign`. */
static double risen(const Plant *p, State *s, int sign) { return p->rise != 0.0 ? sign * p->rise * (1.0 - spared(p, s)) : 0.0; }

/* What w and what friction has risen by take from the input `u` where it moves to the side `sign`, beside a damper of `lent` more that
 * stands for a part of that, and in `rate` their rate, times `span`. */
static double yielded(const Plant *p, State *s, int sign, double u, double span, double lent, double *rate)
{
    double slope = 0.0, held = p->bends ? pull(p->bend, s->y, &slope) : 0.0, gained = 0.0;
    if (p->soft != 0.0) {
        held += p->soft * (s->q - s->y);
        slope += p->soft * (steepness(p, sign * s->q, s->grown) - 1.0);
    }
    if (p->rise != 0.0) {
        double left = spared(p, s);
        if (p->smooth) sign = s->v < 0.0 ? -1 : 1;
        held += sign * p->rise * (1.0 - left);
        gained = (u - p->k * s->y - damper(p, s) * s->v - held - sign * p->slide - s->side * p->preload) / p->m;
        gained *= p->rise / p->speed * left - lent;
        held -= lent * s->v;
    }
    *rate = span * (s->v * slope + gained);
    return held;
}

/* q after `way` >= 0 in its direction, on one side of 0, for a power of 1. */
static double along(double q, double way, double bend)
{
    double x = bend * way;
    double mean = fabs(x) < 1e-3 ? 1.0 - x * (0.5 - x * (1.0 / 6.0 - x / 24.0)) : -expm1(-x) / x;
    return q + (1.0 - bend * q) * mean * way;
}

/* The same on both sides. */
static double across(const Plant *p, double q, double way)
{
    if (q >= 0.0) return along(q, way, p->loading);
    double bend = p->unloading, there = along(q, way, bend), inside = -bend * q;
    if (there <= 0.0) return there;
    return along(0.0, way - (fabs(inside) < 1e-9 ? -q : log1p(inside) / bend), p->loading);
}

/* The way from 0 to q, `lost` being the part of its steepness that q has lost there: the integral of 1/(1 - lost). */
static double since(const Plant *p, double q, double lost)
{
    double n = p->power;
    return q * (1.0 + lost * (1.0 / (n + 1.0) + lost * (1.0 / (2.0 * n + 1.0) + lost * (1.0 / (3.0 * n + 1.0) + lost / (4.0 * n + 1.0)))));
}

/* The same for another power, `size` being what it has grown to: by its Taylor series; about 0, where that has none, by the way since
 * 0; what is too steep for both by Runge and Kutta's rule. */
static double curving(const Plant *p, double q, double size, double way)
{
    double n = p->power, one = steepness(p, q, size), r = 1.0 / q;
    if (way * (fabs(one) + n * fabs(1.0 - one)) < NEAR * fabs(q)) {
        double first = n * (one - 1.0) * r, second = first * (n - 1.0) * r, third = second * (n - 2.0) * r;
        double fourth = first * first * first + one * (4.0 * first * second + one * third);
        return q + way * one * (1.0 + way / 2.0 * (first + way / 3.0 * (first * first + one * second + way / 4.0 * fourth)));
    }
    double goal = since(p, q, 1.0 - one) + way, at = goal, lost = 1.0 - one;
    for (int turn = 0; turn < 3 && fabs(lost) < FEW; turn++) {
        lost = 1.0 - steepness(p, at, grown(p, at, q, size));
        at -= (since(p, at, lost) - goal) * (1.0 - lost);
    }
    if (fabs(lost) < FEW) return at;
    at = q + 0.5 * way * one;
    double two = steepness(p, at, grown(p, at, q, size));
    at = q + 0.5 * way * two;
    double three = steepness(p, at, grown(p, at, q, size));
    at = q + way * three;
    return q + way / 6.0 * (one + 2.0 * two + 2.0 * three + steepness(p, at, grown(p, at, q, size)));
}

/* q of the state after the displacement `move`. */
static void wind(const Plant *p, State *s, double move)
{
    double side = move < 0.0 ? -1.0 : 1.0, was = s->q;
    if (p->soft == 0.0) return;
    s->q = side * (p->power == 1.0 ? across(p, side * was, fabs(move)) : curving(p, side * was, s->grown, fabs(move)));
    s->grown = grown(p, s->q, was, s->grown);
}

/* The state after a displacement of `move` instead of `moved`, for which q is known: by q's Taylor series there, where `move` is as good
 * as `moved`; else from `was` on. */
static void wound(const Plant *p, State *s, const State *was, double move, double moved)
{
    double side = moved < 0.0 ? -1.0 : 1.0, more = side * (move - moved), at = side * s->q;
    if (p->soft == 0.0) return;
    double one = steepness(p, at, s->grown), bent = p->power * (one - 1.0);
    if (fabs(more * bent) < SAME * fabs(at) && move * side >= 0.0) {
        s->q += side * more * one * (1.0 + 0.5 * more * bent / at);
        s->grown = grown(p, s->q, side * at, s->grown);
    } else {
        s->q = was->q, s->grown = was->grown;
        wind(p, s, move);
    }
}

/* The table of a step twice as long. */
static void doubled(double *t)
{
    double a = t[0], b = t[1], c = t[2], d = t[3], f[8];
    memcpy(f, t + 4, sizeof f);
    for (int row = 0; row < 2; row++) {
        const double *g = f + 4 * row, *kept = t + 2 * row;
        double first[4], *to = t + 4 + 4 * row;
        for (int i = 0; i < 4; i++) first[i] = (kept[0] * f[i] + kept[1] * f[4 + i]) / (double)(1 << i);
        to[0] = first[0] + g[0];
        to[1] = first[1] + 0.5 * (g[0] + g[1]);
        to[2] = first[2] + 0.25 * (g[0] + g[2]) + 0.5 * g[1];
        to[3] = first[3] + 0.125 * (g[0] + g[3]) + 0.375 * (g[1] + g[2]);
    }
    t[0] = a * a + b * c, t[1] = b * (a + d), t[2] = c * (a + d), t[3] = d * d + b * c;
}

/* The table of a short step of the state's matrix `a` and of what a force counts, by the series of the exponential: powers of the matrix
 * for what was, and for an input t^i over the step the sum of A^j b i!/(i + j + 1)! step^(j + 1). */
static void series(const double *a, const double *force, double step, double *t)
{
    double power[4] = {1.0, 0.0, 0.0, 1.0}, count[4] = {1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0}, part = 1.0;
    memset(t, 0, COUNTS * sizeof *t);
    t[0] = t[3] = 1.0;
    for (int j = 0; j < TERMS; j++) {
        part /= j + 1.0;
        for (int row = 0; row < 2; row++) {
            double x = power[2 * row], y = power[2 * row + 1], driven = (x * force[0] + y * force[1]) * step;
            for (int i = 0; i < 4; i++) t[4 + 4 * row + i] += driven * count[i];
            power[2 * row] = (x * a[0] + y * a[2]) * step, power[2 * row + 1] = (x * a[1] + y * a[3]) * step;
        }
        for (int i = 0; i < 4; i++) count[i] /= i + j + 2.0, t[i] += power[i] * part;
    }
}

/* The tables of a damper, a step of h/2^base first. */
static void tabulate(const Plant *p, double damper, double *to)
{
    double a[4] = {0.0, 1.0, -p->k / p->m, -damper / p->m}, force[2] = {0.0, 1.0 / p->m}, step = p->h, t[COUNTS];
    int level = p->last;
    if (p->order == 1) a[0] = a[2], a[1] = a[2] = a[3] = 0.0, force[0] = force[1], force[1] = 0.0;
    step /= (double)(1L << level);
    for (; (fabs(a[0]) + fabs(a[1]) + fabs(a[2]) + fabs(a[3])) * step > TINY; level++) step *= 0.5;
    for (series(a, force, step, t); level >= p->base; level--, doubled(t))
        if (level <= p->last) memcpy(to + COUNTS * (level - p->base), t, sizeof t);
}

/* The tables by which the plant moves: where friction rises with the speed, those of the damper that stands for it. */
static int pick(const Plant *p, const State *s)
{
    if (falls(p, s)) return FALLING;
    double far = p->rise != 0.0 ? fabs(s->v) / p->speed / APART + 0.5 : PLAIN;
    return far < DAMPERS ? (int)far : PLAIN;
}

/* What such a damper has more than the plant's own. */
static double lent_by(const Plant *p, int set) { return set < DAMPERS ? p->rise / p->speed * exp(-APART * set) : 0.0; }

static const double *table(Plant *p, int set, int level)
{
    double *t = p->tables + COUNTS * (p->last - p->base + 1) * set;
    if (set < DAMPERS && !p->made[set]) {
        tabulate(p, p->c + lent_by(p, set), t);
        p->made[set] = 1;
    }
    return t + COUNTS * (level - p->base);
}

/* How many times too long a step of `level` from `s` to `to` is for friction that rises, beside a damper of `lent` more. */
static double leap(const Plant *p, const State *s, State *to, int level, double lent)
{
    double left = spared(p, to), same = lent * p->speed / p->rise;
    double off = fmax(fabs(left - same), fabs(s->spared - same)) * p->h * p->brisk / (double)(1 << level);
    return fmax(off, fabs(to->v - s->v) * sqrt(sqrt(fmax(left, s->spared))) / (LEAP * p->speed));
}

/* The state after a step of `level` with the input `d` (4 coefficients over the step), friction at `sign` times `slide`. */
static State stepped(Plant *p, State s, const double *d, int level, int sign)
{
    int set = pick(p, &s);
    const double *t = table(p, set, level);
    double borne = sign * p->slide + s.side * p->preload, lent = lent_by(p, set);
    double span = p->h / (double)(1 << level), f[4] = {d[0] - borne, d[1], d[2], d[3]};
    double at_end = d[0] + d[1] + d[2] + d[3] - borne, slope = 0.0;
    double before = p->curved ? yielded(p, &s, sign, d[0], span, lent, &slope) : 0.0;
    double then = before + slope, steep = slope;
    double moved = 0.0;
    State to = s;
    to.leap = 0.0, to.turned = 0;
    for (int round = 0; round < (p->curved ? 2 : 1); round++) {
        double g[4] = {f[0] - before, f[1] - slope, f[2] - 3.0 * (then - before) + 2.0 * slope + steep,
                       f[3] - slope - steep + 2.0 * (then - before)};
        to.y = t[0] * s.y + t[1] * s.v + t[4] * g[0] + t[5] * g[1] + t[6] * g[2] + t[7] * g[3];
        if (p->order == 2) to.v = t[2] * s.y + t[3] * s.v + t[8] * g[0] + t[9] * g[1] + t[10] * g[2] + t[11] * g[3];
        if (!p->curved) break;
        if (p->smooth && sign * to.v < 0.0 && fabs(to.v - s.v) > LEAP * p->speed) to.turned = 1;
        if (p->rise != 0.0) to.leap = fmax(to.leap, leap(p, &s, &to, level, lent));
        if (round == 0) wind(p, &to, moved = to.y - s.y);
        else wound(p, &to, &s, to.y - s.y, moved);
        then = yielded(p, &to, sign, at_end + borne, span, lent, &steep);
    }
    if (p->order == 1) to.v = (at_end - p->k * to.y - taken(p, &to)) / p->m;
    return to;
}

/* What pushes a plant at rest when the input is `u`. */
static double push(const Plant *p, const State *s, double u) { return u - p->k * s->y - taken(p, s) - s->side * p->preload; }

/* What it takes to move a plant at rest. */
static double holds(const Plant *p, const State *s) { return s->side ? p->stick : p->stick + p->preload; }

/* Stuck, moving on, or turned round, by what pushes it. */
static void decide(const Plant *p, State *s, double u)
{
    if (s->moving && p->order == 2) return;
    double pushed = push(p, s, u);
    int stopped = p->order == 1 && s->moving && s->moving * pushed <= p->slide;
    if (s->moving && !stopped) {
        s->v = (pushed - s->moving * p->slide) / p->m;
        return;
    }
    s->moving = fabs(pushed) > holds(p, s) ? (pushed > 0.0 ? 1 : -1) : 0;
    if (!s->side) s->side = s->moving;
    s->v = s->moving && p->order == 1 ? (pushed - s->moving * p->slide) / p->m : 0.0;
}

static void rolled(State *s, const Plant *p, double way)
{
    s->y += way;
    wind(p, s, way);
}

/* From 0 velocity on for `time`, so short that the push changes in a line, from `first` of the input to `u`. */
static void started(const Plant *p, State *s, double first, double u, double time)
{
    decide(p, s, u);
    if (!s->moving) return;
    double rate = (push(p, s, 0.5 * (first + u)) - s->moving * p->slide) / p->m;
    rolled(s, p, p->order == 2 ? 0.5 * rate * time * time : rate * time);
    if (p->order == 2) s->v = rate * time * (1.0 - 0.5 * p->c / p->m * time);
}

/* Whether a step that ended well may have turned round twice on its way. */
static int dips(const Plant *p, State *s, State *to, const double *d)
{
    if (p->order == 1) return 0;
    int sign = s->moving;
    double first = push(p, s, d[0]) - damper(p, s) * s->v - sign * p->slide - risen(p, s, sign);
    if (sign * first >= 0.0) return 0;
    return sign * (push(p, to, d[0] + d[1] + d[2] + d[3]) - damper(p, to) * to->v - sign * p->slide - risen(p, to, sign)) > 0.0;
}

/* The input's coefficients over the step that begins at `at` and is `part` of the sample. */
static void cut(const double *c, double at, double part, double *d)
{
    d[0] = c[0] + at * (c[1] + at * (c[2] + at * c[3]));
    d[1] = part * (c[1] + at * (2.0 * c[2] + 3.0 * at * c[3]));
    d[2] = part * part * (c[2] + 3.0 * at * c[3]);
    d[3] = part * part * part * c[3];
}

/* One sample under the input c[0] + c[1] t + c[2] t^2 + c[3] t^3, t = 0 ... 1. */
static void sample(Plant *p, State *s, const double *c)
{
    long whole = 1L << p->last, at = 0;
    int level = p->base;
    while (at < whole) {
        double d[4];
        cut(c, (double)at / whole, 1.0 / (double)(1 << level), d);
        decide(p, s, d[0]);
        if (p->smooth && !s->moving) s->moving = 1;
        double u = d[0] + d[1] + d[2] + d[3], span = p->h / (double)(1 << level);
        State to = s->moving ? stepped(p, *s, d, level, s->moving) : *s;
        double ahead = s->moving ? s->moving * to.v : holds(p, s) - fabs(push(p, s, u));
        if (p->order == 1 && s->moving) ahead = s->moving * push(p, &to, u) - p->slide;
        int seats = p->preload > 0.0 && s->side * to.y < 0.0;
        int turns = p->smooth ? to.turned : ahead < 0.0;
        int again = turns || seats || (s->moving && !p->smooth && level < p->base + DIPS && dips(p, s, &to, d));
        if ((again && level < p->last) || (s->moving && to.leap > 1.0 && level < p->fine)) {
            level++;
            continue;
        }
        if (seats) {
            double part = s->side * s->y > 0.0 ? s->y / (s->y - to.y) : 0.0;
            rolled(s, p, -s->y);
            s->v = 0.0, s->moving = s->side = 0;
            started(p, s, d[0] + part * (u - d[0]), u, (1.0 - part) * span);
        } else if (turns && p->order == 2 && p->stick == 0.0 && (s->moving || p->preload == 0.0)) {
            if (!s->moving) {
                s->moving = push(p, s, u) < 0.0 ? -1 : 1;
                to = stepped(p, *s, d, level, s->moving);
            }
            *s = to, s->moving = to.v < 0.0 ? -1 : 1; /* nothing holds it: it turns round, or sets out */
        } else if (turns) { /* the event is in this short step: what is left of it, by lines */
            double was = s->moving ? s->moving * s->v : holds(p, s) - fabs(push(p, s, d[0]));
            if (p->order == 1 && s->moving) was = s->moving * push(p, s, d[0]) - p->slide;
            double part = was > 0.0 ? was / (was - ahead) : 0.0;
            if (s->moving) {
                double way = p->order == 2 ? 0.5 * s->v * part * span : part * (to.y - s->y);
                rolled(s, p, way);
            }
            s->moving = 0, s->v = 0.0;
            started(p, s, d[0] + part * (u - d[0]), u, (1.0 - part) * span);
        } else {
            *s = to;
            if (p->smooth) s->moving = to.v < 0.0 ? -1 : 1;
        }
        at += whole >> level;
        int as_long = s->moving && s->leap > 0.5; /* twice as long it would be too long */
        while (level > p->base && !(as_long && level <= p->fine) && at % (whole >> (level - 1)) == 0) level--;
    }
}

/* The plant at `y`, come there from 0 in one go. */
static State come(const Plant *p, double y)
{
    State s = {0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0, 0, 0};
    for (int j = 0; j < 32; j++) wind(p, &s, y / 32.0);
    s.y = y, s.side = (y > 0.0) - (y < 0.0);
    return s;
}

/* Where the plant rests under `u` when it has come there from 0. */
static State balanced(const Plant *p, double u)
{
    double left = fabs(u) - p->slide - p->preload, side = u < 0.0 ? -1.0 : 1.0;
    if (left <= 0.0 || p->k <= 0.0) return come(p, 0.0);
    double low = 0.0, high = p->curved ? 20.0 * left / p->k : left / p->k;
    for (int i = 0; i < 60 && p->curved; i++) {
        double y = 0.5 * (low + high);
        State s = come(p, y);
        if (p->k * y + taken(p, &s) < left) low = y;
        else high = y;
    }
    return come(p, side * high);
}

/* Leave a plant under `u` until it rests; the input comes there from `last` within a sample. */
static void settled(Plant *p, State *s, double last, double u)
{
    double c[4] = {last, u - last, 0.0, 0.0}, far = fabs(s->y);
    for (int k = 0; k < LONG; k++) {
        double was = s->y;
        sample(p, s, c);
        far = fmax(far, fabs(s->y));
        if (k && (!s->moving || fabs(s->y - was) <= STILL * far)) break;
        c[0] = u, c[1] = 0.0;
    }
}

/* n samples of the input: `line`, `bend` and `twist` are what it changes by in a line in the sample that ends at each, and the
 * coefficients of t (t - 1) and t (t - 1)(2 t - 1) beside it; at the first of an experiment, of the sample ahead of it. `tables` is room
 * for TABLES of last - base + 1 steps. Where the plant is `kept`, a later experiment begins where the one before left it, after a rest. */
void focgen_plant(int n, const double *x, double *y, const unsigned char *rest, const double *line, const double *bend, const double *twist,
                  int order, int base, int fine, int last, int kept, const double *numbers, double *tables)
{
    const double *a = numbers;
    int bends = a[13] != 0.0 || a[14] != 0.0 || a[17] != 0.0;
    Plant p = {order, base, fine, last, a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], a[11], a[12], a + 13,
               bends, bends || a[6] != 0.0 || a[11] != 0.0, a[18], a[19], a[20], 0, {0}, tables};
    p.smooth = p.rise != 0.0 && p.slide == 0.0 && p.stick == 0.0 && p.preload == 0.0 && p.soft == 0.0 && p.falling == p.c;
    tabulate(&p, p.c, tables + COUNTS * (last - base + 1) * PLAIN);
    if (p.falling != p.c) tabulate(&p, p.falling, tables + COUNTS * (last - base + 1) * FALLING);
    State s = come(&p, 0.0);
    for (int k = 0; k < n; k++) {
        double c[4] = {0.0, 0.0, 0.0, 0.0};
        if (rest[k]) {
            if (kept && k) settled(&p, &s, x[k - 1], rest[k] == BALANCED ? x[k] : 0.0);
            else s = rest[k] == BALANCED ? balanced(&p, x[k]) : come(&p, 0.0);
            c[1] = line[k];
            if (line[k] != 0.0) sample(&p, &s, c);
        } else {
            c[0] = x[k - 1], c[1] = line[k] - bend[k] + twist[k], c[2] = bend[k] - 3.0 * twist[k], c[3] = 2.0 * twist[k];
            sample(&p, &s, c);
        }
        y[k] = s.y;
    }
}
