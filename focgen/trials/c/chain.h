/* The true rig of a sealed case, stepped at 1 to 5 ms.
 *
 * Linear stages are integrated by the classical Runge-Kutta method, the fractional stage by the implicit L1
 * scheme on its full history, state-dependent effects inside the step. History older than the current
 * block arrives in `far` (summed by fast convolution outside); the block's own part is summed here.
 */
#ifndef CHAIN_H
#define CHAIN_H
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "interface.h"

/* where in the chain a form acts; what holds (GRIP) is dry friction on the motion */
enum { COMMAND, PRESSURE, DRIVE, RATE, GRIP, CURVATURE, READING, OUTPUT, SAMPLE };

typedef struct {
    const char *name;
    int place;
    double (*act)(effect *e, const chain *c, double in, double t);   /* the signal after it */
    double (*resist)(const effect *e, double pull);                  /* RATE: factor on T */
    void (*load)(const effect *e, double x, double *force, double *stiffness);   /* RATE: what pushes back */
    double (*hold)(const effect *e, double speed);                   /* GRIP: dry friction at a speed */
} form;

extern const form FORMS[];

/* friction.c */
double held(const chain *c, double speed);
int gripped(const chain *c);
double gripped_step(chain *c, double before, double now);
double gripped_pull(chain *c, double pull, double rest);

#endif
