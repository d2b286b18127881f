/* The loops of the chain simulator that Python would be too slow for: a session, sample by sample.
 * `n` samples of `x` give `n` samples of `y`. rest[k] is not 0 where an experiment begins: there a loop starts at rest at 0,
 * or, where it is BALANCED, in equilibrium with x[k] as if that had been held for ever; a loop of friction comes to it from 0.
 */
#include <math.h>
#include <string.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include "kernels.h"
#include "modes.h"

/* A session's signals are made and left again thousands of times a second. The C library gives memory of their size back to the system
 * each time, and has it cleared page by page when it asks anew, which takes longer than most loops here: it keeps some instead. */
void focgen_keep_memory(void)
{
#ifdef __GLIBC__
    enum { SIGNAL = 8 << 20, KEPT = 64 << 20 }; /* bytes: a million samples, and eight of them */
    mallopt(M_MMAP_THRESHOLD, SIGNAL);
    mallopt(M_TRIM_THRESHOLD, KEPT);
#endif
}

/* focgen_modes where nothing but the input moves them and they are no more than SEVERAL: less b1_i x[k], what is left of a mode goes
 * with past inputs alone, z_i <- a_i z_i + (a_i b1_i + b0_i) x[k-1], and so many numbers stay in the processor's registers. */
enum { SEVERAL = 32 };
static void undisturbed(int n, const double *x, double *y, const unsigned char *rest, int m, const double *a, const double *b0,
                        const double *b1, const double *pair, double through, int held)
{
    double keeps[SEVERAL] = {0.0}, takes[SEVERAL] = {0.0}, begins[SEVERAL] = {0.0}, z[SEVERAL] = {0.0};
    double zr = 0.0, zi = 0.0, past = 0.0, gr, gi, at_once = through;
    double p[6] = {pair[0], pair[1], held ? 0.0 : pair[2], held ? 0.0 : pair[3], pair[4], pair[5]};
    if (held) p[4] += pair[2], p[5] += pair[3];
    gain_at_rest(m, a, b0, b1, pair, through, &gr, &gi);
    settle(m, a, b0, b1, 1.0, begins);
    for (int i = 0; i < m; i++) {
        double before = held ? 0.0 : b0[i], now = held ? b0[i] + b1[i] : b1[i];
        keeps[i] = a[i], takes[i] = a[i] * now + before, begins[i] -= now, at_once += now;
    }
    for (int k = 0; k < n; k++) {
        double enters = entering(x, rest, k, held);
        if (rest[k]) {
            past = rest[k] == BALANCED ? x[k] : 0.0;
            for (int i = 0; i < SEVERAL; i++) z[i] = begins[i] * past;
            zr = gr * past, zi = gi * past;
        }
        double sum = 0.0;
        for (int i = 0; i < SEVERAL; i++) z[i] = keeps[i] * z[i] + takes[i] * past, sum += z[i];
        turn(p, past, enters, &zr, &zi);
        past = enters;
        y[k] = at_once * past + sum + zr;
    }
}

/* focgen_modes where an obstacle, friction or two paces come in. In `z`, too, b1_i x[k] is left out until the next sample: the sum then
 * says what the output is without the present input, which stands for itself. */
static void disturbed(int n, const double *x, double *y, const unsigned char *rest, int m, const double *a, const double *b0,
                      const double *b1, const double *pair, double through, int held, int switching, double place,
                      double stiffness, double slide, double stick, double *z)
{
    double zr = 0.0, zi = 0.0, past = 0.0, last = 0.0, entered = 0.0, at_once[2] = {through, through};
    const double *lately = b1;
    int moving = 0;
    for (int i = 0; i < 2 * m; i++) at_once[i >= m] += b1[i];
    for (int k = 0; k < n; k++) {
        if (rest[k]) {
            for (int i = 0; i < m; i++) z[i] = 0.0;
            zr = zi = past = last = 0.0, moving = 0, lately = b1;
            if (rest[k] == BALANCED) {
                double gr, gi, gain = gain_at_rest(m, a, b0, b1, pair, through, &gr, &gi);
                double left = fabs(x[k]) > slide ? x[k] - (x[k] < 0.0 ? -slide : slide) : 0.0;
                double beyond = (gain * left - place) / (1.0 + gain * stiffness);
                past = stiffness > 0.0 && beyond > 0.0 ? left - stiffness * beyond : left;
                settle(m, a, b0, b1, past, z);
                for (int i = 0; i < m; i++) z[i] -= b1[i] * past;
                zr = gr * past, zi = gi * past, last = gain * past;
            }
        }
        double now = entering(x, rest, k, held), sum = 0.0, since = past;
        if (held && !rest[k] && stick == 0.0) since += now - entered; /* it jumped at the sample before, an obstacle's force did not */
        entered = now;
        int down = switching && fabs(now) < fabs(last);
        const double *A = a + down * m, *B0 = b0 + down * m, *P = pair + 6 * down;
        for (int i = 0; i < m; i++) z[i] = A[i] * (z[i] + lately[i] * past) + B0[i] * since, sum += z[i];
        lately = b1 + down * m;
        if (stiffness > 0.0 || stick > 0.0) {
            double still = sum + P[0] * zr - P[1] * zi + P[2] * since, gain = at_once[down] + P[4];
            double pushed = stiffness > 0.0 && last > place ? stiffness * (last - place) : 0.0;
            double borne = now - pushed - (last - still) / gain; /* what stands still takes from x */
            if (stick > 0.0 && fabs(borne) <= (moving ? slide : stick)) {
                now -= borne + pushed, moving = 0;
            } else {
                double way = borne < 0.0 ? -slide : slide;
                if (stick > 0.0 && held) { /* what slides takes as much from the jump on: friction jumps with the input */
                    double more = now - pushed - way - since;
                    for (int i = 0; i < m; i++) z[i] += B0[i] * more, sum += B0[i] * more, still += B0[i] * more;
                    still += P[2] * more, since += more;
                }
                if (stick > 0.0) now -= way, moving = 1;
                double beyond = (still + gain * now - place) / (1.0 + gain * stiffness);
                if (stiffness > 0.0 && beyond > 0.0) now -= stiffness * beyond;
            }
        }
        turn(P, since, now, &zr, &zi);
        past = now;
        last = y[k] = at_once[down] * now + sum + zr;
    }
}

/* Both rows of m coefficients, each filled up with 0 to SEVERAL. */
static void filled(int m, const double *rows, double *to)
{
    for (int i = 0; i < 2 * SEVERAL; i++) to[i] = i % SEVERAL < m ? rows[i / SEVERAL * m + i % SEVERAL] : 0.0;
}

/* Sum of first-order modes and one complex mode pair; the input runs in lines between samples (first-order hold), or is `held`.
 * z_i <- a_i z_i + b0_i x[k-1] + b1_i x[k];  y = through x + sum(z) + Re(pair). Held, x[k-1] stands for both and what is taken from x
 * still runs in lines.
 * Coefficients come twice, for loading (first m) and unloading (next m): unloading is x[k] < y[k-1] where x > 0.
 * pair[s] = {a_re, a_im, b0_re, b0_im, b1_re, b1_im} for s = 0, 1.
 * Beyond y = `place` an obstacle takes `stiffness` (y - place) from x: y, linear in the present x, is solved for.
 * Friction takes `slide` from x against the motion since the last sample; what it takes to stay there it bears while that is no
 * more than `slide`, and than `stick` where nothing moved before. No more than SEVERAL modes are run as so many, which the compiler
 * unrolls. */
void focgen_modes(int n, const double *x, double *y, const unsigned char *rest, int m, const double *a, const double *b0, const double *b1,
                  const double *pair, double through, int held, int switching, double place, double stiffness, double slide, double stick,
                  double *z)
{
    double A[2 * SEVERAL], B0[2 * SEVERAL], B1[2 * SEVERAL], Z[SEVERAL];
    if (m > SEVERAL) {
        disturbed(n, x, y, rest, m, a, b0, b1, pair, through, held, switching, place, stiffness, slide, stick, z);
    } else if (switching || stiffness > 0.0 || stick > 0.0) {
        filled(m, a, A), filled(m, b0, B0), filled(m, b1, B1);
        disturbed(n, x, y, rest, SEVERAL, A, B0, B1, pair, through, held, switching, place, stiffness, slide, stick, Z);
    } else {
        undisturbed(n, x, y, rest, m, a, b0, b1, pair, through, held);
    }
}

/* First-order lag, x linear between samples, whose coefficients {a, of the past x, of the present x} differ up and down:
 * up where x lies above y. */
void focgen_lag(int n, const double *x, double *y, const unsigned char *rest, const double *up, const double *down)
{
    double now = 0.0, past = 0.0;
    for (int k = 0; k < n; k++) {
        if (rest[k]) now = past = rest[k] == BALANCED ? x[k] : 0.0;
        const double *c = 0.5 * (past + x[k]) > now ? up : down;
        now = c[0] * now + c[1] * past + c[2] * x[k];
        past = x[k];
        y[k] = now;
    }
}

/* What is left of the gap towards x after h in a chamber of lag tau whose flow is at most `rate`: less than that only
 * where the gap is below tau rate. */
static double choked(double gap, double h, double tau, double rate)
{
    double until = fabs(gap) / rate - tau, way = gap > 0.0 ? 1.0 : -1.0;
    return until < h ? way * tau * rate * exp(-(h - until) / tau) : gap - way * rate * h;
}

/* What is left of `gap` > 0 after h in a chamber behind a throat: the difference of pressures is
 * tau y' + tau² y'²/scale, of laminar and of turbulent flow. By v = sqrt(1 + 4 gap/scale) - 1 that is
 * v + ln v falling by 1/tau; ln v by Newton's method from above, where it cannot overshoot. */
static double throttled(double gap, double h, double tau, double scale)
{
    double share = 4.0 * gap / scale, v = share / (1.0 + sqrt(1.0 + share));
    double to = v + log(v) - h / tau, u = to > 1.0 ? log(to) : to;
    if (to < -700.0) return 0.0; /* no number's size any more, and 0 has no logarithm */
    for (int i = 0; i < 20; i++) {
        double step = (exp(u) + u - to) / (exp(u) + 1.0);
        u -= step;
        if (step < 1e-12) break;
    }
    v = exp(u);
    return 0.25 * scale * v * (v + 2.0);
}

/* Chamber that fills and vents each with its own {a, of the past x, of the present x, lag, highest rate, scale of its
 * throat, none where that is 0}, and cannot pass `most`. Which it does tells x, `present` of it as it is now and the rest
 * as it was: 0.5 where it runs in lines, 0 where it is held. */
void focgen_chamber(int n, const double *x, double *y, const unsigned char *rest, double h, const double *fill, const double *vent, double present, double most)
{
    double now = 0.0, past = 0.0;
    for (int k = 0; k < n; k++) {
        if (rest[k]) now = past = rest[k] == BALANCED ? x[k] : 0.0;
        if (now > most) now = most;
        double to = past + present * (x[k] - past), gap = to - now;
        const double *c = gap > 0.0 ? fill : vent;
        if (c[5] > 0.0) {
            double size = fabs(gap), left = fmax(throttled(size, h, c[3], c[5]), size - c[4] * h);
            now = to - copysign(left, gap);
        } else if (fabs(gap) > c[3] * c[4])
            now = to - choked(gap, h, c[3], c[4]);
        else
            now = c[0] * now + c[1] * past + c[2] * x[k];
        if (now > most) now = most;
        past = x[k];
        y[k] = now;
    }
}

/* Chamber behind a valve: fills with the lag `tau` towards x; vents with the flow of an orifice,
 * y' = -speed sqrt((y - x) scale) limited to the same lag close to x; `sub` steps a sample. */
void focgen_orifice(int n, const double *x, double *y, const unsigned char *rest, double h, double tau, double vent, double scale, int sub)
{
    double now = 0.0, past = 0.0, step = h / sub;
    for (int k = 0; k < n; k++) {
        if (rest[k]) now = past = rest[k] == BALANCED ? x[k] : 0.0;
        for (int j = 0; j < sub; j++) {
            double to = past + (x[k] - past) * (j + 1.0) / sub, gap = to - now;
            double root = sqrt(fabs(gap) * scale), share;
            double time = (gap > 0.0 ? tau : vent) * (root / scale + 0.02);
            share = time > 0.0 ? 1.0 - exp(-step / time) : 1.0;
            now += share * gap;
        }
        past = x[k];
        y[k] = now;
    }
}

/* tanh, by its series where it is close to a line. */
static double bounded(double x)
{
    double square = x * x;
    if (square < 1e-3) return x * (1.0 - square / 3.0 * (1.0 - 0.4 * square * (1.0 - 17.0 / 42.0 * square)));
    return 1.0 - 2.0 / (exp(2.0 * x) + 1.0);
}

/* Rate limit: y follows x through a lag `tau` with |y'| <= rate; soft > 0.5 takes rate tanh(.). */
void focgen_rate(int n, const double *x, double *y, const unsigned char *rest, double h, double rate, double tau, int soft, int sub)
{
    double now = 0.0, past = 0.0, step = h / sub, most = rate * step;
    double keep = tau > 0.0 ? -expm1(-step / tau) : 1.0;
    for (int k = 0; k < n; k++) {
        if (rest[k]) now = past = rest[k] == BALANCED ? x[k] : 0.0;
        for (int j = 0; j < sub; j++) {
            double to = past + (x[k] - past) * (j + 1.0) / sub, move = keep * (to - now);
            if (soft) move = most * bounded(move / most);
            now += move > most ? most : move < -most ? -most : move;
        }
        past = x[k];
        y[k] = now;
    }
}

/* What a tank lets through that gives `draw` of every rise of the pressure, and is refilled by `refill` a second up to `full`:
 * they meet where the tank has as much left as the pressure it made, and the valve lets nothing back. At rest the tank is
 * full. */
void focgen_drawn(int n, const double *x, double *y, const unsigned char *rest, double h, double full, double draw, double refill)
{
    double tank = full, now = 0.0;
    for (int k = 0; k < n; k++) {
        if (rest[k]) tank = full, now = rest[k] == BALANCED ? fmin(x[k], full) : 0.0;
        double most = (tank + draw * now) / (1.0 + draw), next = fmin(x[k], fmax(most, now));
        tank = fmin(tank - draw * fmax(next - now, 0.0) + refill * h, full);
        y[k] = now = isnan(x[k]) ? x[k] : next;
    }
}

/* Play (backlash) of half width `width`, starting in the middle of its slack at `start`. */
void focgen_play(int n, const double *x, double *y, const unsigned char *rest, double width, double start)
{
    double now = start;
    for (int k = 0; k < n; k++) {
        if (rest[k]) now = start;
        if (now < x[k] - width) now = x[k] - width;
        if (now > x[k] + width) now = x[k] + width;
        y[k] = now;
    }
}

/* Play whose half width `even` grows by `growing` of the level at which it is, starting in the middle of its slack at 0. */
void focgen_pressed(int n, const double *x, double *y, const unsigned char *rest, double even, double growing)
{
    double now = 0.0;
    for (int k = 0; k < n; k++) {
        double width = even + growing * fabs(x[k]);
        if (rest[k]) now = 0.0;
        if (now < x[k] - width) now = x[k] - width;
        if (now > x[k] + width) now = x[k] + width;
        y[k] = now;
    }
}

/* Stick-slip: held until x has left the band around it, then jumps to x less `left` of the band, and follows there until x turns
 * round; `anew`: it is held again at once. Where x was the same for ever, it lies `place` below x, or where coming from 0 left it. */
void focgen_stick(int n, const double *x, double *y, const unsigned char *rest, double band, double left, int anew, double place)
{
    double now = 0.0, past = 0.0, way = 0.0;
    for (int k = 0; k < n; k++) {
        if (rest[k]) now = past = way = 0.0;
        if (rest[k] == BALANCED && !isnan(place)) now = x[k] - place, past = x[k];
        if (anew || (x[k] - past) * way <= 0.0) way = 0.0;
        if (fabs(x[k] - now) > band) way = x[k] > now ? 1.0 : -1.0;
        if (way != 0.0) now = x[k] - way * left;
        past = x[k];
        y[k] = now;
    }
}

/* 1 - exp(-way): of short ways, as most are from sample to sample, by its series, to 1e-12 of it. */
static double decayed(double way)
{
    if (way > 0.03) return 1.0 - exp(-way);
    double square = way * way;
    return way - square * ((0.5 - way * (1.0 / 6)) + square * ((1.0 / 24 - way * (1.0 / 120)) + square * (1.0 / 720)));
}

/* Bouc-Wen hysteretic variable, |z| <= 1, exactly: dz = dx/width on the way to 0, dx/width (1 - |z|) away from it. */
void focgen_bouc_wen(int n, const double *x, double *y, const unsigned char *rest, double width)
{
    double z = 0.0, past = 0.0;
    for (int k = 0; k < n; k++) {
        if (rest[k]) z = past = 0.0;
        double way = fabs(x[k] - past) / width, side = x[k] < past ? -1.0 : 1.0, away = decayed(way);
        if (side * z >= 0.0) z = (1.0 - away) * z + side * away;
        else if (way <= fabs(z)) z += side * way;
        else z = side * decayed(way - fabs(z));
        past = x[k];
        y[k] = z;
    }
}

/* A spline of `pieces` cubics over as many even parts of 0 to 1, and level beyond: rows of c (4, pieces), the highest power first, in
 * the distance from where a part begins. What is no number stays none. */
void focgen_spline(int n, const double *x, double *y, const unsigned char *rest, int pieces, const double *c)
{
    (void)rest; /* a curve knows no past */
    for (int k = 0; k < n; k++) {
        double q = x[k] > 1.0 ? 1.0 : x[k], along = q * pieces;
        int part = along >= 1.0 ? (along < pieces ? (int)along : pieces - 1) : 0;
        const double *own = c + part;
        double from = q - (double)part / pieces;
        y[k] = ((own[0] * from + own[pieces]) * from + own[2 * pieces]) * from + own[3 * pieces];
    }
}

/* (1 + u)^-n: of what is little, as most is from sample to sample, by the binomial series, to 1e-12. */
static double lessened(double u, double n)
{
    if ((n + 5.0) * u > 0.01) return pow(1.0 + u, -n);
    double later = 1.0 - (n + 2.0) * (1.0 / 3) * u * (1.0 - (n + 3.0) * (1.0 / 4) * u * (1.0 - (n + 4.0) * (1.0 / 5) * u));
    return 1.0 - n * u * (1.0 - (n + 1.0) * (1.0 / 2) * u * later);
}

/* Power-law creep: dz/dt = sign(e) scale/tau |e/scale|^power, e = x - z, power > 1; exact for an input held at
 * the mean of neighbouring samples. */
void focgen_power_creep(int n, const double *x, double *y, const unsigned char *rest, double h, double tau, double scale,
                        double power)
{
    double z = 0.0, past = 0.0, left = power - 1.0;
    for (int k = 0; k < n; k++) {
        if (rest[k]) z = past = rest[k] == BALANCED ? x[k] : 0.0;
        double held = 0.5 * (past + x[k]), e = (held - z) / scale, size = fabs(e);
        double slower = size > 0.0 ? lessened(left * h / tau * pow(size, left), 1.0 / left) : 1.0;
        z = held - scale * e * slower;
        past = x[k];
        y[k] = z;
    }
}

/* The delays w of a rational filter where an experiment begins, at rest at 0 or in equilibrium with x. One that integrates (the sum of
 * a is no more than rounding) is in equilibrium with 0 only. */
static void begun(int balanced, double x, int m, const double *b, const double *a, double *w)
{
    double up = 0.0, down = 0.0, size = 0.0;
    for (int i = 0; i <= m; i++) w[i] = 0.0, up += b[i], down += a[i], size += fabs(a[i]);
    double still = balanced && fabs(down) > 1e-14 * size ? up / down * x : 0.0;
    for (int i = m; i >= 1 && still != 0.0; i--) w[i - 1] = b[i] * x - a[i] * still + (i < m ? w[i] : 0.0);
}

/* Rational filter of order `m` in direct form: y = sum b_i x[k-i] - sum a_i y[k-i], a_0 = 1; w holds the delays. Those of order 2,
 * which most stages are, fit in registers. */
void focgen_filter(int n, const double *x, double *y, const unsigned char *rest, int m, const double *b, const double *a,
                   double *w)
{
    for (int k = 0; k < n && m != 2; k++) {
        if (rest[k]) begun(rest[k] == BALANCED, x[k], m, b, a, w);
        double out = b[0] * x[k] + w[0];
        for (int i = 1; i <= m; i++) w[i - 1] = b[i] * x[k] - a[i] * out + (i < m ? w[i] : 0.0);
        y[k] = out;
    }
    double next = 0.0, later = 0.0;
    for (int k = 0; k < n && m == 2; k++) {
        if (rest[k]) {
            begun(rest[k] == BALANCED, x[k], m, b, a, w);
            next = w[0], later = w[1];
        }
        double out = b[0] * x[k] + next;
        next = b[1] * x[k] - a[1] * out + later;
        later = b[2] * x[k] - a[2] * out;
        y[k] = out;
    }
}

enum { AT_ONCE = 1024 }; /* samples that stay in the processor's cache while they are looked at many times */

/* The products of row `a` with four rows from `b` on, which lie `n` apart, over `count` samples: each sample of a is read once for four. */
static void four(int count, const double *a, const double *b, int n, double *to)
{
    const double *c = b + n, *d = c + n, *e = d + n;
    double sum[4] = {0.0};
    for (int t = 0; t < count; t++) sum[0] += a[t] * b[t], sum[1] += a[t] * c[t], sum[2] += a[t] * d[t], sum[3] += a[t] * e[t];
    for (int i = 0; i < 4; i++) to[i] += sum[i];
}

/* m[i][j] = sum over samples of r[i] r[j], for the k rows of n samples; one thread, for the rows are few and the calls many. `m` is 0 but
 * for the products of the first rows, which are known. */
void focgen_products(int n, int k, int known, const double *r, double *m)
{
    for (int first = 0; first < n; first += AT_ONCE) {
        int count = n - first < AT_ONCE ? n - first : AT_ONCE;
        for (int i = known; i < k; i++) {
            const double *a = r + (long)i * n + first;
            int j = 0;
            for (; j + 3 <= i; j += 4) four(count, a, r + (long)j * n + first, n, m + i * k + j);
            for (; j <= i; j++) {
                const double *b = r + (long)j * n + first;
                double sum = 0.0;
                for (int t = 0; t < count; t++) sum += a[t] * b[t];
                m[i * k + j] += sum;
            }
        }
    }
    for (int i = known; i < k; i++) for (int j = 0; j < i; j++) m[j * k + i] = m[i * k + j];
}

/* (y - made) weight of `count` values of `coarse` samples each, in the mean. */
static void averaged(int count, int coarse, const double *y, const double *made, const double *weight, double *mean)
{
    for (int k = 0; k < count && coarse == 1; k++) mean[k] = weight[k] * (y[k] - made[k]);
    for (int k = 0; k < count && coarse != 1; k++) {
        double sum = 0.0;
        for (int i = k * coarse; i < (k + 1) * coarse; i++) sum += weight[i] * (y[i] - made[i]);
        mean[k] = sum / coarse;
    }
}

/* The first sample from `k` on at which an experiment begins, or n. */
static int next_begin(const unsigned char *rest, int k, int n)
{
    for (unsigned long long eight = 0; k + 8 <= n && !eight; k += eight ? 0 : 8) memcpy(&eight, rest + k, 8);
    while (k < n && !rest[k]) k++;
    return k;
}

/* What the taps ar[1] … ar[order] add to `count` values of `to` from those before each in `from`, four taps at a time. */
static void whiten(int count, int order, const double *ar, const double *from, double *to)
{
    int i = 1;
    for (; i + 3 <= order; i += 4) {
        const double *f = from - i;
        for (int k = 0; k < count; k++) to[k] += ar[i] * f[k] + ar[i + 1] * f[k - 1] + ar[i + 2] * f[k - 2] + ar[i + 3] * f[k - 3];
    }
    for (; i <= order; i++) for (int k = 0; k < count; k++) to[k] += ar[i] * from[k - i];
}

/* Innovations of the residual (y - made) weight, experiment by experiment: means of `coarse` neighbours (what does not fill the
 * last one is left out), through the whitening filter `ar` of `order`, ahead of which all was 0; at most 1e3 in size; `per` times what
 * they are more than `less`, if that is not NULL. `room` is scratch (AT_ONCE + order). Returns how many there are in `out`. */
int focgen_innovations(int n, const double *y, double *out, const unsigned char *rest, const double *made, const double *weight,
                       int coarse, int order, const double *ar, const double *less, double per, double *room)
{
    int total = 0;
    double *mean = room + order;
    for (int first = 0, last; first < n; first = last) {
        last = next_begin(rest, first + 1, n);
        int count = (last - first) / coarse;
        for (int i = 0; i < order; i++) room[i] = 0.0;
        for (int a = 0, b; a < count; a = b) {
            b = count - a < AT_ONCE ? count : a + AT_ONCE;
            int at = first + a * coarse, many = b - a;
            double *to = out + total + a;
            averaged(many, coarse, y + at, made + at, weight + at, mean);
            for (int k = 0; k < many; k++) to[k] = ar[0] * mean[k];
            whiten(many, order, ar, mean, to);
            memmove(room, room + many, order * sizeof *room);
            for (int k = 0; k < many; k++) to[k] = to[k] < -1e3 ? -1e3 : to[k] < 1e3 ? to[k] : 1e3;
            for (int k = 0; k < many && less; k++) to[k] = per * (to[k] - less[total + a + k]);
        }
        total += count;
    }
    return total;
}
