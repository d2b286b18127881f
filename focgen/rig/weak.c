/* Actuators whose spring gives way while it is used: with a stiffness s in units of the nominal one they answer
 * x + (1 - s) y/gain as the nominal one answers x, and y is solved for at every sample.
 * s = given/(1 + growth (1 - exp(-w/scale))), LEAST ... MOST: w is the largest |y| so far BY_LARGEST, what |y| has risen by in all BY_WORK,
 * and how far |y| is below the largest BY_RETREAT.
 * `wear` = {growth, scale, before, gain}, `before` the largest, or the work, of an earlier session; `given` has a number for every sample.
 * `rest` is as in kernels.c.
 */
#include <math.h>
#include "kernels.h"
#include "modes.h"

enum { BY_LARGEST = 1, BY_WORK = 2, BY_RETREAT = 3, TURNS = 8, HALVINGS = 50 };
static const double LEAST = 0.2, MOST = 1.8, CLOSE = 1e-9;

typedef struct {
    double level, record; /* |y| a sample ago, and the largest, or the work, until then */
    double asked, gave;   /* w as asked for last, and 1 + growth (1 - exp(-w/scale)) there */
} Worn;

/* The largest, or the work, once |y| is `level`. */
static double reached(int by, const Worn *worn, double level)
{
    if (by == BY_WORK) return worn->record + (level > worn->level ? level - worn->level : 0.0);
    return level > worn->record ? level : worn->record;
}

/* s where the response is y. */
static double stiffness(int by, const double *wear, double given, Worn *worn, double y)
{
    double level = fabs(y), record = reached(by, worn, level), w = by == BY_RETREAT ? record - level : record;
    if (w != worn->asked) worn->asked = w, worn->gave = 1.0 - wear[0] * expm1(-w / wear[1]);
    double s = given / worn->gave;
    return s < LEAST ? LEAST : s > MOST ? MOST : s;
}

/* y = still + back (1 - s) y from the response before, s left as it is there; `back` is what of y comes back at once, 1 at rest. Turns come
 * to it where that is small, and else halvings do: y (1 - back (1 - s)) only grows with y, and s has its bounds. */
static double yielding(int by, const double *wear, double given, Worn *worn, double still, double back, double y, double *s)
{
    for (int turn = 0; turn < TURNS; turn++) {
        double before = y;
        *s = stiffness(by, wear, given, worn, y);
        y = still / (1.0 - back * (1.0 - *s));
        if (fabs(y - before) <= CLOSE * fabs(y)) return y;
    }
    double low = still / (1.0 - back * (1.0 - MOST)), high = still / (1.0 - back * (1.0 - LEAST));
    for (int halving = 0; halving < HALVINGS; halving++) {
        y = 0.5 * (low + high);
        *s = stiffness(by, wear, given, worn, y);
        if (fabs(y * (1.0 - back * (1.0 - *s))) < fabs(still)) low = y;
        else high = y;
    }
    return y;
}

/* Goes on to where the response is y. */
static void wears(int by, Worn *worn, double y)
{
    worn->record = reached(by, worn, fabs(y));
    worn->level = fabs(y);
}

/* As focgen_modes of kernels.c. */
void focgen_weak_modes(int n, const double *x, double *y, const unsigned char *rest, int m, const double *a, const double *b0,
                       const double *b1, const double *pair, double through, int held, int by, const double *wear, const double *given,
                       double *z)
{
    double zr = 0.0, zi = 0.0, past = 0.0, last = 0.0, entered = 0.0, s, gain = wear[3], direct = through + pair[4];
    Worn worn = {0.0, wear[2], 0.0, 1.0};
    for (int i = 0; i < m; i++) direct += b1[i];
    for (int k = 0; k < n; k++) {
        if (rest[k]) {
            for (int i = 0; i < m; i++) z[i] = 0.0;
            zr = zi = past = last = worn.level = 0.0;
        }
        if (rest[k] == BALANCED) {
            double gr, gi, whole = gain_at_rest(m, a, b0, b1, pair, through, &gr, &gi);
            last = yielding(by, wear, given[k], &worn, whole * x[k], 1.0, 0.0, &s);
            past = last / whole;
            settle(m, a, b0, b1, past, z);
            zr = gr * past, zi = gi * past;
        }
        double enters = entering(x, rest, k, held);
        if (held && !rest[k]) past += enters - entered; /* it jumped at the sample before, the response did not */
        entered = enters;
        double still = decay(m, a, b0, pair, past, zr, zi, z);
        last = y[k] = yielding(by, wear, given[k], &worn, still + direct * enters, direct / gain, last, &s);
        wears(by, &worn, last);
        double now = enters + (1.0 - s) * last / gain;
        enter(m, b1, pair, past, now, &zr, &zi, z);
        past = now;
    }
}

/* A discrete filter of denominator `a`: numerator `b` for the input, `c` for what of the response comes back, which runs in lines; m + 1
 * of each, w is scratch. */
void focgen_weak_filter(int n, const double *x, double *y, const unsigned char *rest, int m, const double *b, const double *c,
                        const double *a, int by, const double *wear, const double *given, double *w)
{
    double last = 0.0, s, up = 0.0, down = 0.0, gain = wear[3];
    Worn worn = {0.0, wear[2], 0.0, 1.0};
    for (int i = 0; i <= m; i++) up += b[i], down += a[i];
    for (int k = 0; k < n; k++) {
        if (rest[k]) {
            for (int i = 0; i <= m; i++) w[i] = 0.0;
            last = worn.level = 0.0;
        }
        if (rest[k] == BALANCED) {
            last = yielding(by, wear, given[k], &worn, up / down * x[k], 1.0, 0.0, &s);
            double back = (1.0 - s) * last / gain;
            for (int i = m; i >= 1; i--) w[i - 1] = b[i] * x[k] + c[i] * back - a[i] * last + (i < m ? w[i] : 0.0);
        }
        last = y[k] = yielding(by, wear, given[k], &worn, w[0] + b[0] * x[k], c[0] / gain, last, &s);
        wears(by, &worn, last);
        double back = (1.0 - s) * last / gain;
        for (int i = 1; i <= m; i++) w[i - 1] = b[i] * x[k] + c[i] * back - a[i] * last + (i < m ? w[i] : 0.0);
    }
}
