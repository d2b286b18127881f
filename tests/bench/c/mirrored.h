/* What is written by hand for a long sum: a ring that is kept twice, so that the past stands in one piece, and
   a product of two vectors in the forms that DSP libraries for Cortex-M offer, four products a loop. */
#include <stdint.h>

static inline uint32_t pair(const int16_t **from)
{
    uint32_t two;

    __builtin_memcpy(&two, *from, 4);
    *from += 2;
    return two;
}

/* The sum of two products of 16 bits, added to 64. */
static inline int64_t smlald(uint32_t x, uint32_t y, int64_t sum)
{
    uint32_t low = (uint32_t)sum, high = (uint32_t)((uint64_t)sum >> 32);

    __asm__("smlald %0, %1, %2, %3" : "+r"(low), "+r"(high) : "r"(x), "r"(y));
    return (int64_t)((uint64_t)high << 32 | low);
}

__attribute__((noinline)) void dot_q15(const int16_t *a, const int16_t *b, uint32_t count, int64_t *result)
{
    int64_t sum = 0;
    uint32_t left;

    for (left = count >> 2; left > 0u; left--) {
        sum = smlald(pair(&a), pair(&b), sum);
        sum = smlald(pair(&a), pair(&b), sum);
    }
    for (left = count & 3u; left > 0u; left--) {
        sum += (int32_t)*a++ * *b++;
    }
    *result = sum;
}

__attribute__((noinline)) void dot_q31(const int32_t *a, const int32_t *b, uint32_t count, int64_t *result)
{
    int64_t sum = 0;
    uint32_t left;

    for (left = count >> 2; left > 0u; left--) {
        sum += ((int64_t)*a++ * *b++) >> 14;
        sum += ((int64_t)*a++ * *b++) >> 14;
        sum += ((int64_t)*a++ * *b++) >> 14;
        sum += ((int64_t)*a++ * *b++) >> 14;
    }
    for (left = count & 3u; left > 0u; left--) {
        sum += ((int64_t)*a++ * *b++) >> 14;
    }
    *result = sum;
}

__attribute__((noinline)) void dot_f32(const float *a, const float *b, uint32_t count, float *result)
{
    float sum = 0.0f;
    uint32_t left;

    for (left = count >> 2; left > 0u; left--) {
        sum += *a++ * *b++;
        sum += *a++ * *b++;
        sum += *a++ * *b++;
        sum += *a++ * *b++;
    }
    for (left = count & 3u; left > 0u; left--) {
        sum += *a++ * *b++;
    }
    *result = sum;
}
