#include "chain.h"

int form_of(const char *name) {
    for (int i = 0; FORMS[i].name; i++)
        if (!strcmp(FORMS[i].name, name)) return i;
    return -1;
}

void at_rest(chain *c) {
    memset(c->regulator.x, 0, sizeof c->regulator.x);
    memset(c->plant.x, 0, sizeof c->plant.x);
    memset(c->sensor.x, 0, sizeof c->sensor.x);
    for (int i = 0; i < c->effects; i++) {
        memset(c->effect[i].st, 0, sizeof c->effect[i].st);
        memset(c->effect[i].ring, 0, sizeof c->effect[i].ring);
        c->effect[i].at = 0;
    }
    c->u = c->p = c->v = c->x = c->z = c->felt = c->y = c->speed = 0.0;
}

/* ---- linear stages: controllable companion form, Runge-Kutta with the input held over the step ---- */

static void slope(const linear *s, const double *x, double in, double *dx) {
    double top = in;
    for (int i = 0; i < s->order; i++) top -= s->a[i] * x[i];
    for (int i = 0; i + 1 < s->order; i++) dx[i] = x[i + 1];
    dx[s->order - 1] = top;
}

static void stage(const linear *s, const double *k, double h, double *x) {
    for (int i = 0; i < s->order; i++) x[i] = s->x[i] + h * k[i];
}

static double linear_step(linear *s, double held, double now, double h) {
    double out = s->through * now;
    if (s->order > 0) {
        double k1[ORDER], k2[ORDER], k3[ORDER], k4[ORDER], t[ORDER];
        slope(s, s->x, held, k1);
        stage(s, k1, 0.5 * h, t);
        slope(s, t, held, k2);
        stage(s, k2, 0.5 * h, t);
        slope(s, t, held, k3);
        stage(s, k3, h, t);
        slope(s, t, held, k4);
        for (int i = 0; i < s->order; i++) s->x[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
    }
    for (int i = 0; i < s->order; i++) out += s->b[i] * s->x[i];
    return out;
}

/* ---- the chain from step n - 1 to step n; `first` is where the current block begins ---- */

static double recall(const memory *m, int64_t n, int64_t first) {
    double sum = m->far[n];
    for (int64_t k = first; k < n; k++) sum += m->w[n - k] * m->d[k];
    return sum;
}

static double remember(memory *m, int64_t n, int64_t first, double increment) {
    if (!m->on) return 0.0;
    m->d[n] = increment;
    return recall(m, n, first) + m->w[0] * increment;
}

static double through(chain *c, int place, double value, double t) {
    for (int i = 0; i < c->effects; i++) {
        const form *f = &FORMS[c->effect[i].form];
        if (f->place == place) value = f->act(&c->effect[i], c, value, t);
    }
    return value;
}

static double drive(const chain *c, double p) {
    double K = 0.0;
    for (int i = c->gains - 1; i >= 0; i--) K = K * p + c->gain[i];
    return K * p + c->bias;
}

/* T D^alpha x + x + force(x) = v by Newton's method; T and the force may depend on the state */
static double fractional_step(chain *c, int64_t n, int64_t first) {
    double T = c->viscosity, old = c->x;
    for (int i = 0; i < c->effects; i++) {
        const form *f = &FORMS[c->effect[i].form];
        if (f->resist) T *= f->resist(&c->effect[i], c->v - old);
    }
    double pull = c->v + T * (old - recall(&c->past, n, first));
    if (gripped(c)) pull = gripped_pull(c, pull, (1.0 + T) * old);
    double x = pull / (1.0 + T);
    for (int pass = 0; pass < 30; pass++) {
        double force = 0.0, stiffness = 0.0;
        for (int i = 0; i < c->effects; i++) {
            const form *f = &FORMS[c->effect[i].form];
            if (f->load) f->load(&c->effect[i], x, &force, &stiffness);
        }
        double move = ((1.0 + T) * x + force - pull) / (1.0 + T + stiffness);
        x -= move;
        if (fabs(move) <= 1e-12 * fabs(x) + 1e-300) break;
    }
    c->past.d[n] = x - old;
    c->speed = (x - old) / c->h;
    return x;
}

static void step(chain *c, int64_t n, int64_t first, double u) {
    double t = c->clock + (double)n * c->h, v_old = c->v, felt_old = c->felt;
    c->u = through(c, COMMAND, u, t);
    c->p = through(c, PRESSURE, linear_step(&c->regulator, c->u, c->u, c->h), t);
    c->v = through(c, DRIVE, drive(c, c->p), t);
    c->creep_now = remember(&c->creep, n, first, c->v - v_old);
    double mean = 0.5 * (c->v + v_old);
    if (c->fractional) c->x = fractional_step(c, n, first);
    else c->x = gripped(c) ? gripped_step(c, v_old, c->v) : linear_step(&c->plant, mean, c->v, c->h);
    double z_old = c->z;
    c->z = through(c, CURVATURE, c->x, t);
    c->electrode_now = remember(&c->electrode, n, first, c->z - z_old);
    c->felt = through(c, READING, c->z, t);
    c->y = through(c, OUTPUT, linear_step(&c->sensor, 0.5 * (c->felt + felt_old), c->felt, c->h), t);
}

static void store(const chain *c, int64_t n, double *p, double *z, double *y) {
    p[n] = c->p;
    z[n] = c->z + c->offset;
    y[n] = c->y + c->offset;
}

/* Steps first … stop - 1; u[n] holds from n to n + 1. Step 0 is the rest before anything happens. */
void advance(chain *c, int64_t first, int64_t stop, const double *u, double *p, double *z, double *y) {
    for (int64_t n = first; n < stop; n++) {
        if (n > 0) step(c, n, first, u[n - 1]);
        store(c, n, p, z, y);
    }
}

/* What acts on the samples themselves, noise included. */
void read_samples(chain *c, double *y, int64_t count) {
    for (int64_t n = 0; n < count; n++) y[n] = through(c, SAMPLE, y[n], 0.0);
}

/* ---- the controller ---- */

static double rounded(double value, double lsb) { return lsb > 0.0 ? lsb * floor(value / lsb + 0.5) : value; }

static double between(double value, double low, double high) { return fmin(fmax(value, low), high); }

static double scheduled(const controller *k, double p) {
    int i = 0;
    if (p <= k->breakpoint[0] || k->points == 1) return k->gain[0];
    if (p >= k->breakpoint[k->points - 1]) return k->gain[k->points - 1];
    while (p > k->breakpoint[i + 1]) i++;
    double share = (p - k->breakpoint[i]) / (k->breakpoint[i + 1] - k->breakpoint[i]);
    return k->gain[i] + share * (k->gain[i + 1] - k->gain[i]);
}

static double control(controller *k, double error, double p) {
    int64_t size = k->length + 1;
    error = rounded(error, k->signal_lsb);
    if (k->count == 0)
        for (int64_t i = 0; i < size; i++) k->errors[i] = error;   /* as if it had been so for ever */
    k->errors[k->count % size] = error;
    double sum = 0.0;
    for (int64_t j = 0; j < size; j++)
        sum += rounded(k->weights[j], k->coefficient_lsb) * k->errors[((k->count - j) % size + size) % size];
    double rate = rounded(sum * scheduled(k, p), k->signal_lsb > 0.0 ? k->output_lsb / k->Ts : 0.0);
    if (k->count > 0) k->integral += 0.5 * k->Ts * (rate + k->before);
    k->before = rate;
    k->count++;
    k->integral = rounded(between(k->integral, k->low, k->high), k->output_lsb);
    double applied = between(k->integral, k->applied_low, k->applied_high);
    if (k->told) k->integral = applied;
    return applied;
}

/* tick[n] = 1: a sample is taken and the controller runs; noise is consumed in the order of the samples. */
void close_loop(chain *c, controller *k, int64_t first, int64_t stop, const double *ref, const uint8_t *tick,
                const double *noise_y, const double *noise_p, double *u, double *p, double *z, double *y,
                double *seen_y, double *seen_p) {
    for (int64_t n = first; n < stop; n++) {
        if (n > 0) step(c, n, first, u[n - 1]);
        store(c, n, p, z, y);
        u[n] = n > 0 ? u[n - 1] : 0.0;
        if (tick[n]) {
            seen_y[n] = through(c, SAMPLE, y[n] + noise_y[n], 0.0);
            seen_p[n] = p[n] + noise_p[n];
            u[n] = control(k, ref[n] - seen_y[n], seen_p[n]);
        }
    }
}

/* The controller alone on what it saw: errors and pressures (count) give outputs. */
void run_controller(controller *k, const double *error, const double *p, double *u, int64_t count) {
    for (int64_t n = 0; n < count; n++) u[n] = control(k, error[n], p[n]);
}
