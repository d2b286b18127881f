#include "forms.h"

/* Dry friction by time stepping: at the end of a step the body has the speed that friction, wherever it lies
 * between its bounds, leaves it (M. Jean, The non-smooth contact dynamics method, Comput. Methods Appl. Mech.
 * Eng. 177, 1999; J. J. Moreau). No event is looked for, and smooth forces are taken at the middle of the
 * step. The plant is of first or second order, without zeros. */

enum { PARTS = 8 };     /* steps within one of the chain's */

/* Coulomb's: par[0], in the unit of what drives the body, at any speed. */
double dry_block(const effect *e, double speed) {
    (void)speed;
    return e->par[0];
}

/* Stribeck's: par[0], and par[1] more at rest, which is lost over a speed of par[2]. */
double stribeck_block(const effect *e, double speed) {
    return e->par[0] + e->par[1] * exp(-pow(speed / e->par[2], 2.0));
}

int gripped(const chain *c) {
    for (int i = 0; i < c->effects; i++)
        if (FORMS[c->effect[i].form].place == GRIP) return 1;
    return 0;
}

/* What friction takes at most, at this speed of the curvature. */
double held(const chain *c, double speed) {
    double force = 0.0;
    for (int i = 0; i < c->effects; i++) {
        const form *f = &FORMS[c->effect[i].form];
        if (f->hold) force += f->hold(&c->effect[i], speed);
    }
    return force;
}

/* What is left of `free` after friction has taken up to `most` off its size. */
static double left(double free, double most) { return fabs(free) <= most ? 0.0 : free - copysign(most, free); }

/* The implicit fractional step at rest is (1 + T) x = pull, and at `rest` x stays as it was. */
double gripped_pull(chain *c, double pull, double rest) { return rest + left(pull - rest, held(c, c->speed)); }

static void first_order(chain *c, double in, double h) {
    linear *s = &c->plant;
    double stiff = 0.5 * h * s->a[0], give = h / (1.0 + stiff);
    double moved = left((in - s->a[0] * s->x[0]) * give, give * held(c, c->speed));
    s->x[0] += moved;
    c->speed = s->b[0] * moved / h;
}

static void second_order_body(chain *c, double in, double h) {
    linear *s = &c->plant;
    double drag = 0.5 * h * s->a[1] + 0.25 * h * h * s->a[0], v = s->x[1];
    double free = (v * (1.0 - drag) + h * (in - s->a[0] * s->x[0])) / (1.0 + drag);
    s->x[1] = left(free, h / (1.0 + drag) * held(c, c->speed));
    s->x[0] += 0.5 * h * (v + s->x[1]);
    c->speed = s->b[0] * s->x[1];
}

/* The plant over one step of the chain, its drive in a straight line from `before` to `now`. */
double gripped_step(chain *c, double before, double now) {
    linear *s = &c->plant;
    for (int i = 0; i < PARTS; i++) {
        double in = before + (now - before) * (i + 0.5) / PARTS;
        if (s->order == 1) first_order(c, in, c->h / PARTS);
        else second_order_body(c, in, c->h / PARTS);
    }
    return s->b[0] * s->x[0];
}
