/* What a sum of first-order modes and one complex pair does, whatever bends what enters it: see focgen_modes in kernels.c. */

/* The response at rest to an input of 1; *re + i *im is the pair's part. */
static double gain_at_rest(int m, const double *a, const double *b0, const double *b1, const double *pair, double through,
                           double *re, double *im)
{
    double dr = 1.0 - pair[0], di = -pair[1], br = pair[2] + pair[4], bi = pair[3] + pair[5], size = dr * dr + di * di;
    *re = (br * dr + bi * di) / size, *im = (bi * dr - br * di) / size;
    double gain = through + *re;
    for (int i = 0; i < m; i++) gain += (b0[i] + b1[i]) / (1.0 - a[i]);
    return gain;
}

/* The modes z at rest under the input `held`. */
static void settle(int m, const double *a, const double *b0, const double *b1, double held, double *z)
{
    for (int i = 0; i < m; i++) z[i] = (b0[i] + b1[i]) / (1.0 - a[i]) * held;
}

/* The pair *re + i *im one sample on, its input going from `past` to `now`. */
static void turn(const double *pair, double past, double now, double *re, double *im)
{
    double on = pair[0] * *re - pair[1] * *im + pair[2] * past + pair[4] * now;
    *im = pair[0] * *im + pair[1] * *re + pair[3] * past + pair[5] * now;
    *re = on;
}

/* What of x enters at sample k: x runs in lines there, or is `held` at what it was a sample ago. */
static inline double entering(const double *x, const unsigned char *rest, int k, int held)
{
    if (!held) return x[k];
    return !rest[k] ? x[k - 1] : rest[k] == BALANCED ? x[k] : 0.0;
}

/* The modes one sample on without the present input; returns what the response is without it. */
static inline double decay(int m, const double *a, const double *b0, const double *pair, double past, double re, double im, double *z)
{
    double still = pair[0] * re - pair[1] * im + pair[2] * past;
    for (int i = 0; i < m; i++) {
        z[i] = a[i] * z[i] + b0[i] * past;
        still += z[i];
    }
    return still;
}

/* The present input enters the modes and the pair. */
static inline void enter(int m, const double *b1, const double *pair, double past, double now, double *re, double *im, double *z)
{
    for (int i = 0; i < m; i++) z[i] += b1[i] * now;
    turn(pair, past, now, re, im);
}
