/* Stages gain/(1 + Q) whose pace is not even: (1 + s Q) y = gain x, and s, how many times as slow the stage is at a sample, depends on
 * the response itself, on how fast it goes, or on time. With `fast` the least s at levels above 0, (1 + fast Q) y = gain v of
 * v = x w + y/gain (1 - w), w = fast/s: the stage is run at an even pace, and what enters it is solved for at every sample.
 * `pace` = {gain, fast, rate, scale, curve}: s is exp(rate q + curve q^2), q = y/(gain scale) BY_LEVEL, -1 ... 1, and
 * |x - y/gain|/scale BY_SPEED, 1 at most; otherwise `share` has w at every sample.
 * `rest` is as in kernels.c.
 */
#include <math.h>
#include "kernels.h"
#include "modes.h"

enum { BY_LEVEL = 1, BY_SPEED = 2, TURNS = 40 };
static const double CLOSE = 1e-7;

/* w where the response is y. */
static double part(int by, const double *pace, double x, double y)
{
    double now = y / pace[0], q = by == BY_LEVEL ? now / pace[3] : fabs(x - now) / pace[3];
    q = q > 1.0 ? 1.0 : q < -1.0 ? -1.0 : q;
    return pace[1] * exp(-(pace[2] + pace[4] * q) * q);
}

/* y = still + first x w + second y/gain (1 - w), from the response before: `w` is left as it is there. */
static double paced(int by, const double *pace, double still, double first, double second, double x, double y, double *w)
{
    double back = second / pace[0];
    for (int turn = 0; turn < TURNS; turn++) {
        double before = *w;
        if (by) *w = part(by, pace, x, y);
        y = (still + first * x * *w) / (1.0 - back * (1.0 - *w));
        if (!by || (turn && fabs(*w - before) <= CLOSE * before)) break;
    }
    return y;
}

/* As focgen_modes of kernels.c, where the modes have the stage's gain, pace[0]. */
void focgen_paced_modes(int n, const double *x, double *y, const unsigned char *rest, int m, const double *a, const double *b0,
                        const double *b1, const double *pair, double through, int held, int by, const double *pace, const double *share,
                        double *z)
{
    double zr = 0.0, zi = 0.0, past = 0.0, last = 0.0, entered = 0.0, w = 1.0, direct = through + pair[4];
    for (int i = 0; i < m; i++) direct += b1[i];
    for (int k = 0; k < n; k++) {
        if (rest[k]) {
            for (int i = 0; i < m; i++) z[i] = 0.0;
            zr = zi = past = last = 0.0;
        }
        if (rest[k] == BALANCED) {
            double gr, gi, gain = gain_at_rest(m, a, b0, b1, pair, through, &gr, &gi);
            past = x[k], last = gain * past;
            settle(m, a, b0, b1, past, z);
            zr = gr * past, zi = gi * past;
        }
        double enters = entering(x, rest, k, held);
        if (held && !rest[k]) past += (enters - entered) * w; /* it jumped at the sample before, the response did not */
        entered = enters;
        double still = decay(m, a, b0, pair, past, zr, zi, z);
        if (!by) w = share[k];
        last = y[k] = paced(by, pace, still, direct, direct, enters, last, &w);
        double now = enters * w + last / pace[0] * (1.0 - w);
        enter(m, b1, pair, past, now, &zr, &zi, z);
        past = now;
    }
}

/* A discrete filter of denominator `a`: numerator `b` for what of the input enters, `c` for what of the response does, which runs in
 * lines; m + 1 of each, w is scratch. */
void focgen_paced_filter(int n, const double *x, double *y, const unsigned char *rest, int m, const double *b, const double *c,
                         const double *a, int by, const double *pace, const double *share, double *w)
{
    double last = 0.0, of_x = 1.0;
    for (int k = 0; k < n; k++) {
        if (rest[k]) {
            for (int i = 0; i <= m; i++) w[i] = 0.0;
            last = 0.0;
        }
        if (!by) of_x = share[k];
        if (rest[k] == BALANCED) {
            last = pace[0] * x[k];
            if (by) of_x = part(by, pace, x[k], last);
            for (int i = m; i >= 1; i--)
                w[i - 1] = (b[i] * of_x + c[i] * (1.0 - of_x)) * x[k] - a[i] * last + (i < m ? w[i] : 0.0);
        }
        last = y[k] = paced(by, pace, w[0], b[0], c[0], x[k], last, &of_x);
        double past = x[k] * of_x, back = last / pace[0] * (1.0 - of_x);
        for (int i = 1; i <= m; i++) w[i - 1] = b[i] * past + c[i] * back - a[i] * last + (i < m ? w[i] : 0.0);
    }
}
