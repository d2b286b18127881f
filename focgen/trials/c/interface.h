#define ORDER 3
#define PARAMETERS 12
#define STATES 160
#define RING 4096
#define EFFECTS 4
#define POINTS 8

typedef struct {
    int order;
    double a[ORDER], b[ORDER], through, x[ORDER];
} linear;

/* increments d of a signal, weights w of its past, far[n]: what earlier blocks contribute */
typedef struct {
    int on;
    const double *w;
    double *d;
    const double *far;
} memory;

typedef struct {
    int form;
    double par[PARAMETERS];
    double st[STATES];      /* forgotten at rest */
    double kept[4];         /* outlives a rest */
    int64_t at;
    double ring[RING];
} effect;

typedef struct {
    double h, clock;        /* step in s; the session's time at sample 0 */
    linear regulator, plant, sensor;
    int fractional, gains;
    double viscosity;       /* T h^-alpha / Gamma(2 - alpha) */
    double gain[6], offset, bias;
    int effects;
    effect effect[EFFECTS];
    memory past, creep, electrode;
    double creep_now, electrode_now;    /* the two memories' present values, for the forms that use them */
    double u, p, v, x, z, felt, y;
    double speed;           /* of what dry friction acts on; 0: it is held */
} chain;

typedef struct {
    int length, points;
    double Ts, low, high;               /* the integrator's limits */
    double applied_low, applied_high;   /* what the actuator can follow */
    int told;                           /* whether the integrator hears of that */
    double breakpoint[POINTS], gain[POINTS];
    double coefficient_lsb, signal_lsb, output_lsb;     /* 0: exact */
    double integral, before;
    int64_t count;
    const double *weights;  /* length + 1 */
    double *errors;         /* length + 1, a ring */
} controller;

int form_of(const char *name);
void at_rest(chain *c);
void advance(chain *c, int64_t first, int64_t stop, const double *u, double *p, double *z, double *y);
void read_samples(chain *c, double *y, int64_t count);
void close_loop(chain *c, controller *k, int64_t first, int64_t stop, const double *ref, const uint8_t *tick,
                const double *noise_y, const double *noise_p, double *u, double *p, double *z, double *y,
                double *seen_y, double *seen_p);
void run_controller(controller *k, const double *error, const double *p, double *u, int64_t count);
