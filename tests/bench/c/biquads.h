/* Cascades of second-order sections in the two forms that DSP libraries for Cortex-M offer, each with any
   number of samples a call. Coefficients of a section: b0, b1, b2, -a1, -a2. */
#include <stdint.h>

typedef struct {
    uint32_t sections;
    float *state; /* two words a section */
    const float *coefficients;
} df2t_f32;

/* Direct form II, transposed. */
__attribute__((noinline)) void run_f32(const df2t_f32 *cascade, const float *in, float *out, uint32_t count)
{
    const float *c = cascade->coefficients;
    float *state = cascade->state;
    uint32_t left = cascade->sections, k;

    do {
        const float b0 = c[0], b1 = c[1], b2 = c[2], a1 = c[3], a2 = c[4];
        float d1 = state[0], d2 = state[1];

        for (k = 0; k < count; k++) {
            const float x = in[k];
            const float y = b0 * x + d1;

            d1 = b1 * x + a1 * y + d2;
            d2 = b2 * x + a2 * y;
            out[k] = y;
        }
        state[0] = d1;
        state[1] = d2;
        state += 2;
        c += 5;
        in = out;
    } while (--left > 0u);
}

typedef struct {
    uint32_t sections;
    int32_t *state; /* four words a section */
    const int32_t *coefficients;
    uint32_t shift; /* coefficients are in units of 2^(shift - 31) */
} df1_q31;

/* Direct form I; products of 64 bits are added up, and the sum is cut to 32. */
__attribute__((noinline)) void run_q31(const df1_q31 *cascade, const int32_t *in, int32_t *out, uint32_t count)
{
    const int32_t *c = cascade->coefficients;
    const uint32_t down = 31u - cascade->shift;
    int32_t *state = cascade->state;
    uint32_t left = cascade->sections, k;

    do {
        const int32_t b0 = c[0], b1 = c[1], b2 = c[2], a1 = c[3], a2 = c[4];
        int32_t x1 = state[0], x2 = state[1], y1 = state[2], y2 = state[3];

        for (k = 0; k < count; k++) {
            const int32_t x = in[k];
            int64_t sum = (int64_t)b0 * x;

            sum += (int64_t)b1 * x1;
            sum += (int64_t)b2 * x2;
            sum += (int64_t)a1 * y1;
            sum += (int64_t)a2 * y2;
            x2 = x1;
            x1 = x;
            y2 = y1;
            y1 = (int32_t)(sum >> down);
            out[k] = y1;
        }
        state[0] = x1;
        state[1] = x2;
        state[2] = y1;
        state[3] = y2;
        state += 4;
        c += 5;
        in = out;
    } while (--left > 0u);
}
