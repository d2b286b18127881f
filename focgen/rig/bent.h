/* A spring that bends takes y (first q + second q^2), q = |y|/scale, beyond the linear one; `spring` = {first, second, scale}.
 * Beyond q = FAR it goes on with the slope that it has there, or where that gives way with none: what yields ever more runs away. */
#include <math.h>

static const double FAR = 1.1;

static double bent(const double *spring, double y, double *slope)
{
    double q = fabs(y) / spring[2], near = q < FAR ? q : FAR;
    *slope = 2.0 * spring[0] * near + 3.0 * spring[1] * near * near;
    if (q > FAR && *slope < 0.0) *slope = 0.0;
    double size = spring[2] * ((spring[0] + spring[1] * near) * near * near + *slope * (q - near));
    return y < 0.0 ? -size : size;
}

/* The same with an obstacle: `spring` goes on with {place, stiffness}, and beyond y = place it takes stiffness (y - place). A place below
 * 0 stands for obstacles on both sides, as far away. */
static double pull(const double *spring, double y, double *slope)
{
    double taken = bent(spring, y, slope), place = spring[3], side = place < 0.0 && y < 0.0 ? -1.0 : 1.0;
    double beyond = side * y - fabs(place);
    if (beyond > 0.0) taken += side * spring[4] * beyond, *slope += spring[4];
    return taken;
}
