/* SPDX-License-Identifier: Apache-2.0 */
/* QEMU's virt board: 16550 at 0x10000000, test device at 0x100000, mtime of the CLINT at 0x0200bff8. */
#include "../bare/board.h"

#define REGISTER8(address) (*(volatile uint8_t*)(address))
#define REGISTER32(address) (*(volatile uint32_t*)(address))
#define REGISTER64(address) (*(volatile uint64_t*)(address))

void board_putc(char c) {
  if (c == '\n') board_putc('\r');
  while ((REGISTER8(0x10000005UL) & 0x20U) == 0) { /* transmitter holding register empty */
  }
  REGISTER8(0x10000000UL) = (uint8_t)c;
}

void board_exit(int code) {
  REGISTER32(0x100000UL) = code == 0 ? 0x5555U : 0x13333U; /* pass; fail with exit status 1 */
  for (;;) {
  }
}

/* The timer counts 10 MHz of emulated time; at 128 ns an instruction that is 1.28 ticks. */
uint64_t board_instructions(void) { return (REGISTER64(0x0200bff8UL) * 100U) >> 7; }
