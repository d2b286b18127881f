/* Plants whose spring bends: what they take from the input depends on the response itself, which is solved for at every sample.
 * `spring` = {first, second, scale, place, stiffness}: the spring takes y (first q + second q^2), q = |y|/scale, from the input, and
 * beyond q = FAR no more than its slope there; an obstacle beyond y = `place` takes stiffness (y - place).
 * Two more numbers, `slide` and `stick`, are of dry friction, as in kernels.c. The next, `preload`, presses the spring against a seat at
 * y = 0: what is there stays until more than that pushes it, and what moves back comes to rest there. The last two, `share` and
 * `power`, are of a spring or an outflow that goes with a power of y: that share of what is linear in y goes with q^power instead, which
 * is as much at q = 1. Below q = LOW it is straight, for a power below 1 has no slope at 0.
 * `rest` is as in kernels.c.
 */
#include <math.h>
#include "bent.h"
#include "kernels.h"
#include "modes.h"

enum { TURNS = 40 };
static const double FLAT = 0.05, CLOSE = 1e-7; /* Newton's step squares what is missing */
static const double LOW = 0.003;               /* of the scale: 1 mm of a tank that is filled to 0.3 m */

/* What spring and obstacle take at y, and what goes with a power of it more than in a line. */
static double drawn(const double *spring, double y, double *slope)
{
    double taken = pull(spring, y, slope), share = spring[8], power = spring[9], q = fabs(y) / spring[2];
    if (share == 0.0) return taken;
    double straight = pow(q > LOW ? q : LOW, power - 1.0);
    *slope += share * ((q > LOW ? power : 1.0) * straight - 1.0);
    return taken + share * (straight - 1.0) * y;
}

/* y = still + gain (x - drawn(y)), by Newton's rule from `y`; a spring that gives way altogether is kept from it. What goes with a power
 * is steepest at 0: a step that passes that is begun anew from there. */
static double solved(const double *spring, double still, double gain, double x, double y)
{
    double goal = still + gain * x;
    for (int turn = 0; turn < TURNS; turn++) {
        if (spring[8] != 0.0 && y * goal < 0.0) y = 0.0;
        double slope, miss = goal - gain * drawn(spring, y, &slope) - y, steep = 1.0 + gain * slope;
        y += miss / (steep > FLAT ? steep : FLAT);
        if (fabs(miss) <= CLOSE * (fabs(y) + spring[2])) break;
    }
    return y;
}

/* What a preload of this size takes at y = 0 of what pushes there, `most` at most, and beyond to the side of `y`. */
static double seated(double preload, double y, double pushed)
{
    if (y == 0.0 && fabs(pushed) <= preload) return pushed;
    return (y == 0.0 ? pushed : y) < 0.0 ? -preload : preload;
}

/* The same with dry friction and a preload, from the place `last` of the sample before; `taken` is what all of them take from x. Where x
 * was held, still grows `per` as much as `since`, what is left of x at the begin of the sample. Friction and preload jump with x: what
 * moves has them from there on. */
static double moved(const double *spring, double still, double gain, double x, double last, double per, double *since, int *moving,
                    double *taken)
{
    double slope, drag = 0.0, slide = spring[5], stick = spring[6], preload = spring[7];
    if (stick > 0.0) {
        double pushed = x - (last - still) / gain, pulled = drawn(spring, last, &slope);
        pulled += seated(preload, last, pushed - pulled);
        if (fabs(pushed - pulled) <= (*moving ? slide : stick)) {
            *moving = 0, *taken = pushed;
            return last;
        }
        *moving = 1, drag = pushed < pulled ? -slide : slide;
    }
    double held = seated(preload, 0.0, x - drag + still / gain); /* all that pushes at the seat, or the preload */
    if (preload > 0.0 && fabs(held) < preload) {
        *taken = x + still / gain;
        return 0.0;
    }
    if (per != 0.0) {
        double start = x - drawn(spring, last, &slope) - drag - held;
        still += per * (start - *since), *since = start;
        held = seated(preload, 0.0, x - drag + still / gain);
    }
    double y = solved(spring, still, gain, x - drag - held, last);
    *taken = drawn(spring, y, &slope) + drag + held;
    return y;
}

/* What is left of x for what has come to rest from 0. */
static double came(const double *spring, double x)
{
    double most = spring[5] + spring[7];
    return fabs(x) > most ? x - (x < 0.0 ? -most : most) : 0.0;
}

/* As focgen_modes of kernels.c. */
void focgen_bent_modes(int n, const double *x, double *y, const unsigned char *rest, int m, const double *a, const double *b0,
                       const double *b1, const double *pair, double through, int held, int switching, const double *spring,
                       double *z)
{
    double zr = 0.0, zi = 0.0, past = 0.0, last = 0.0, entered = 0.0, slope, taken;
    int moving = 0;
    for (int k = 0; k < n; k++) {
        if (rest[k]) {
            for (int i = 0; i < m; i++) z[i] = 0.0;
            zr = zi = past = last = 0.0, moving = 0;
        }
        if (rest[k] == BALANCED) {
            double gr, gi, gain = gain_at_rest(m, a, b0, b1, pair, through, &gr, &gi);
            last = solved(spring, 0.0, gain, came(spring, x[k]), 0.0);
            past = came(spring, x[k]) - drawn(spring, last, &slope);
            settle(m, a, b0, b1, past, z);
            zr = gr * past, zi = gi * past;
        }
        double enters = entering(x, rest, k, held);
        int jumps = held && !rest[k], bears = spring[6] > 0.0 || spring[7] > 0.0;
        if (jumps && !bears) past += enters - entered; /* it jumped at the sample before, what the spring takes did not */
        entered = enters;
        int down = switching && fabs(enters) < fabs(last);
        const double *A = a + down * m, *B0 = b0 + down * m, *B1 = b1 + down * m, *P = pair + 6 * down;
        double still = P[0] * zr - P[1] * zi + P[2] * past, gain = through + P[4], per = P[2], since = past;
        for (int i = 0; i < m; i++) {
            z[i] = A[i] * z[i] + B0[i] * past;
            still += z[i];
            gain += B1[i], per += B0[i];
        }
        last = y[k] = moved(spring, still, gain, enters, last, jumps && bears ? per : 0.0, &since, &moving, &taken);
        double now = enters - taken;
        for (int i = 0; i < m; i++) z[i] += B0[i] * (since - past) + B1[i] * now;
        turn(P, since, now, &zr, &zi);
        past = now;
    }
}

/* A discrete filter of denominator `a`: numerator `b` for the input, `c` for what the spring takes from it; m + 1 of each, w is scratch. */
void focgen_bent_filter(int n, const double *x, double *y, const unsigned char *rest, int m, const double *b, const double *c,
                        const double *a, const double *spring, double *w)
{
    double last = 0.0, slope, taken;
    int moving = 0;
    for (int k = 0; k < n; k++) {
        if (rest[k]) {
            for (int i = 0; i <= m; i++) w[i] = 0.0;
            last = 0.0, moving = 0;
        }
        if (rest[k] == BALANCED) {
            double up = 0.0, down = 0.0;
            for (int i = 0; i <= m; i++) up += b[i], down += a[i];
            last = solved(spring, 0.0, up / down, came(spring, x[k]), 0.0);
            taken = drawn(spring, last, &slope) + x[k] - came(spring, x[k]);
            for (int i = m; i >= 1; i--) w[i - 1] = b[i] * x[k] - c[i] * taken - a[i] * last + (i < m ? w[i] : 0.0);
        }
        last = y[k] = moved(spring, w[0] + b[0] * x[k], c[0], 0.0, last, 0.0, &slope, &moving, &taken);
        for (int i = 1; i <= m; i++) w[i - 1] = b[i] * x[k] - c[i] * taken - a[i] * last + (i < m ? w[i] : 0.0);
    }
}
