/* Stages whose input pulls g(y) = 1 + first q + second q^2 times as strongly, q = y/scale, where they are: the response to x g, which is
 * solved for at every sample. Beyond q = FAR either side it pulls as there, and never less than LEAST.
 * `lever` = {first, second, scale}; `rest` is as in kernels.c.
 */
#include <math.h>
#include "kernels.h"
#include "modes.h"

enum { TURNS = 40 };
static const double FAR = 1.1, LEAST = 0.05, FLAT = 0.05, CLOSE = 1e-13;

static double strength(const double *lever, double y, double *slope)
{
    double q = y / lever[2], near = q > FAR ? FAR : q < -FAR ? -FAR : q, g = 1.0 + (lever[0] + lever[1] * near) * near;
    *slope = near == q && g > LEAST ? (lever[0] + 2.0 * lever[1] * q) / lever[2] : 0.0;
    return g > LEAST ? g : LEAST;
}

/* y = still + gain x g(y) by Newton's rule from `y`; g is left in `pull`. */
static double driven(const double *lever, double still, double gain, double x, double y, double *pull)
{
    for (int turn = 0; turn < TURNS; turn++) {
        double slope, miss = still - y + gain * x * (*pull = strength(lever, y, &slope)), steep = 1.0 - gain * x * slope;
        if (fabs(miss) <= CLOSE * lever[2]) break;
        y += miss / (steep > FLAT ? steep : FLAT);
    }
    return y;
}

/* As focgen_modes of kernels.c. */
void focgen_levered_modes(int n, const double *x, double *y, const unsigned char *rest, int m, const double *a, const double *b0,
                          const double *b1, const double *pair, double through, int held, const double *lever, double *z)
{
    double zr = 0.0, zi = 0.0, past = 0.0, last = 0.0, entered = 0.0, pull = 1.0, direct = through + pair[4];
    for (int i = 0; i < m; i++) direct += b1[i];
    for (int k = 0; k < n; k++) {
        if (rest[k]) {
            for (int i = 0; i < m; i++) z[i] = 0.0;
            zr = zi = past = last = 0.0;
        }
        if (rest[k] == BALANCED) {
            double gr, gi, gain = gain_at_rest(m, a, b0, b1, pair, through, &gr, &gi);
            last = driven(lever, 0.0, gain, x[k], 0.0, &pull);
            past = x[k] * pull;
            settle(m, a, b0, b1, past, z);
            zr = gr * past, zi = gi * past;
        }
        double enters = entering(x, rest, k, held);
        if (held && !rest[k]) past += (enters - entered) * pull; /* it jumped at the sample before, the response did not */
        entered = enters;
        double still = decay(m, a, b0, pair, past, zr, zi, z);
        last = y[k] = driven(lever, still, direct, enters, last, &pull);
        double now = enters * pull;
        enter(m, b1, pair, past, now, &zr, &zi, z);
        past = now;
    }
}

/* A discrete filter; m + 1 coefficients each, w is scratch. */
void focgen_levered_filter(int n, const double *x, double *y, const unsigned char *rest, int m, const double *b, const double *a,
                           const double *lever, double *w)
{
    double last = 0.0, pull = 1.0, up = 0.0, down = 0.0;
    for (int i = 0; i <= m; i++) up += b[i], down += a[i];
    for (int k = 0; k < n; k++) {
        if (rest[k]) {
            for (int i = 0; i <= m; i++) w[i] = 0.0;
            last = 0.0;
        }
        if (rest[k] == BALANCED) {
            last = driven(lever, 0.0, up / down, x[k], 0.0, &pull);
            for (int i = m; i >= 1; i--) w[i - 1] = b[i] * x[k] * pull - a[i] * last + (i < m ? w[i] : 0.0);
        }
        last = y[k] = driven(lever, w[0], b[0], x[k], last, &pull);
        for (int i = 1; i <= m; i++) w[i - 1] = b[i] * x[k] * pull - a[i] * last + (i < m ? w[i] : 0.0);
    }
}
