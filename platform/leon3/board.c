/* SPDX-License-Identifier: Apache-2.0 */
/* QEMU's generic LEON3: APBUART at 0x80000100, GPTIMER at 0x80000300. */
#include "../bare/board.h"

#define REGISTER(address) (*(volatile uint32_t*)(address))

/* start.S: traps with traps disabled, which end the emulation. */
extern void board_halt_ok(void) __attribute__((noreturn));
extern void board_halt_fail(void) __attribute__((noreturn));

void board_putc(char c) {
  if (c == '\n') board_putc('\r');
  while ((REGISTER(0x80000104) & 4U) == 0) { /* transmitter holding register empty */
  }
  REGISTER(0x80000100) = (uint8_t)c;
}

void board_exit(int code) {
  if (code == 0) board_halt_ok();
  board_halt_fail();
}

/* The timer counts down from 0xfffffffe at 1 MHz of emulated time; an instruction takes 1024 ns. It wraps after 4.3e9
   ticks, an hour of that time. */
uint64_t board_instructions(void) { return ((uint64_t)(0xfffffffeU - REGISTER(0x80000310)) * 125U) >> 7; }
