/* What the compiled loops of the chain simulator offer: see the file of each, and kernels.py, which reads these lines. */
enum { BALANCED = 2 };
enum { TABLES = 50, COUNTS = 12 }; /* of a plant, and numbers that each has of a step */
void focgen_keep_memory(void);
void focgen_modes(int n, const double *x, double *y, const unsigned char *rest, int m, const double *a,
    const double *b0, const double *b1, const double *pair, double through, int held, int switching, double
    place, double stiffness, double slide, double stick, double *z);
void focgen_lag(int n, const double *x, double *y, const unsigned char *rest, const double *up, const
    double *down);
void focgen_chamber(int n, const double *x, double *y, const unsigned char *rest, double h, const double
    *fill, const double *vent, double present, double most);
void focgen_orifice(int n, const double *x, double *y, const unsigned char *rest, double h, double tau,
    double vent, double scale, int sub);
void focgen_rate(int n, const double *x, double *y, const unsigned char *rest, double h, double rate,
    double tau, int soft, int sub);
void focgen_drawn(int n, const double *x, double *y, const unsigned char *rest, double h, double full,
    double draw, double refill);
void focgen_play(int n, const double *x, double *y, const unsigned char *rest, double width, double
    start);
void focgen_pressed(int n, const double *x, double *y, const unsigned char *rest, double even, double
    growing);
void focgen_stick(int n, const double *x, double *y, const unsigned char *rest, double band, double
    left, int anew, double place);
void focgen_bouc_wen(int n, const double *x, double *y, const unsigned char *rest, double width);
void focgen_spline(int n, const double *x, double *y, const unsigned char *rest, int pieces, const double
    *c);
void focgen_power_creep(int n, const double *x, double *y, const unsigned char *rest, double h, double tau,
    double scale, double power);
void focgen_filter(int n, const double *x, double *y, const unsigned char *rest, int m, const double *b,
    const double *a, double *w);
int focgen_innovations(int n, const double *y, double *out, const unsigned char *rest, const double
    *made, const double *weight, int coarse, int order, const double *ar, const double *less, double per,
    double *room);
void focgen_products(int n, int k, int known, const double *r, double *m);
void focgen_plant(int n, const double *x, double *y, const unsigned char *rest, const double *line, const
    double *bend, const double *twist, int order, int base, int fine, int last, int kept, const double *numbers,
    double *tables);
void focgen_bent_modes(int n, const double *x, double *y, const unsigned char *rest, int m, const double *a,
    const double *b0, const double *b1, const double *pair, double through, int held, int switching, const double
    *spring, double *z);
void focgen_bent_filter(int n, const double *x, double *y, const unsigned char *rest, int m, const double *b,
    const double *c, const double *a, const double *spring, double *w);
void focgen_paced_modes(int n, const double *x, double *y, const unsigned char *rest, int m, const double *a,
    const double *b0, const double *b1, const double *pair, double through, int held, int by, const double *pace, const
    double *share, double *z);
void focgen_paced_filter(int n, const double *x, double *y, const unsigned char *rest, int m, const double *b,
    const double *c, const double *a, int by, const double *pace, const double *share, double *w);
void focgen_levered_modes(int n, const double *x, double *y, const unsigned char *rest, int m, const double
    *a, const double *b0, const double *b1, const double *pair, double through, int held, const double *lever, double
    *z);
void focgen_levered_filter(int n, const double *x, double *y, const unsigned char *rest, int m, const double
    *b, const double *a, const double *lever, double *w);
void focgen_weak_modes(int n, const double *x, double *y, const unsigned char *rest, int m, const double *a,
    const double *b0, const double *b1, const double *pair, double through, int held, int by, const double *wear, const
    double *given, double *z);
void focgen_weak_filter(int n, const double *x, double *y, const unsigned char *rest, int m, const double *b,
    const double *c, const double *a, int by, const double *wear, const double *given, double *w);
