/* board.h: all that the examples need of a board. On yours, a few lines of its vendor's library each.
 *
 * SPDX-License-Identifier: 0BSD
 */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

/* Memory that a start does not clear and a battery keeps; a linker's section of your own. */
#ifdef BOARD_M4
#define BOARD_KEPT __attribute__((section(".bss.kept")))
#else
#define BOARD_KEPT
#endif

uint16_t board_adc(int channel);                                 /* 12 bits: 0 curvature, 1 pressure, 2 supply, 0 to 12 V */
void board_dac(uint16_t code);                                   /* 12 bits: 0 to 10 V */
void board_timer(uint32_t period_us, void (*handler)(void));     /* call it from now on */
void board_comparator(void (*handler)(void));                    /* call it when the supply fails */
float board_knob(void);                                          /* what somebody turns: a factor on the gain */
void board_report(float curvature, uint8_t flags, uint8_t refused);
void board_sleep(void);                                          /* until the next interrupt */
int board_on(void);                                              /* 0 where the example has run long enough */
void board_lock(void);                                           /* hold off the interrupts that share data */
void board_unlock(void);

#endif
