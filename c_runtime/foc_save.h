/* foc_save.h: how a controller's state is written down and read again, the same on every core.
 *
 * SPDX-License-Identifier: 0BSD
 *
 * Numbers stand byte by byte, the lowest first, without gaps. The first eight bytes name the configuration,
 * the last four are the check sum of all before them (CRC-32, as in Ethernet and zip).
 */
#ifndef FOC_SAVE_H
#define FOC_SAVE_H

#include <stdint.h>

/* Generated files ask for the version they were written for. */
#define FOC_SAVE_VERSION 2

/* Write the lowest bytes of a number to to[at] and on; return where the next one goes. bytes <= 8. */
static inline uint32_t foc_put(uint8_t *to, uint32_t at, uint64_t bits, uint8_t bytes)
{
    uint8_t i;

    for (i = 0; i < bytes; i++) {
        to[at + i] = (uint8_t)(bits & 0xffu);
        bits >>= 8;
    }
    return at + bytes;
}

/* Read such a number from from[at] and on, and move `at` behind it. */
static inline uint64_t foc_get(const uint8_t *from, uint32_t *at, uint8_t bytes)
{
    uint64_t bits = 0;
    uint8_t i;

    for (i = bytes; i > 0u; i--) {
        bits = (bits << 8) | from[*at + i - 1u];
    }
    *at += bytes;
    return bits;
}

/* One bit of a check sum. */
static inline uint32_t foc_crc_bit(uint32_t crc)
{
    return (crc & 1u) != 0u ? (crc >> 1) ^ 0xedb88320u : crc >> 1;
}

/* The check sum of so many bytes. Two bits at a time: of one at a time, clang makes a table of 1024 bytes. */
static inline uint32_t foc_crc32(const uint8_t *from, uint32_t count)
{
    uint32_t crc = 0xffffffffu;
    uint32_t i;

    for (i = 0; i < count; i++) {
        uint8_t pair;

        crc ^= from[i];
        for (pair = 0; pair < 4u; pair++) {
            crc = foc_crc_bit(foc_crc_bit(crc));
        }
    }
    return crc ^ 0xffffffffu;
}

#endif

/* Floating point, as in foc_rt.h. */
#if !defined(FOC_NO_FLOAT) && !defined(FOC_SAVE_FLOAT_H)
#define FOC_SAVE_FLOAT_H

/* The bits of a floating number, and the number of such bits. */
static inline uint64_t foc_bits_f32(float x)
{
    union {
        float value;
        uint32_t bits;
    } view;

    view.value = x;
    return view.bits;
}

static inline float foc_float_f32(uint64_t bits)
{
    union {
        float value;
        uint32_t bits;
    } view;

    view.bits = (uint32_t)bits;
    return view.value;
}

/* Where double has 32 bits, as it may on an AVR, the upper ones are 0. */
static inline uint64_t foc_bits_f64(double x)
{
    union {
        double value;
        uint64_t bits;
    } view;

    view.bits = 0;
    view.value = x;
    return view.bits;
}

static inline double foc_float_f64(uint64_t bits)
{
    union {
        double value;
        uint64_t bits;
    } view;

    view.bits = bits;
    return view.value;
}

#endif
