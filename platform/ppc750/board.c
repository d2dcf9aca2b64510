/* SPDX-License-Identifier: Apache-2.0 */
/* PReP board (QEMU: 40p): 16550 at ISA 0x3f8, ISA in the window at 0x80000000, PCI configuration at cf8/cfc. */
#include "../bare/board.h"

#define ISA8(port) (*(volatile uint8_t*)(0x80000000U + (port)))
#define ISA32(port) (*(volatile uint32_t*)(0x80000000U + (port)))

static void in_order(void) { __asm__ volatile("eieio" ::: "memory"); }

void board_putc(char c) {
  if (c == '\n') board_putc('\r');
  while ((ISA8(0x3fd) & 0x20U) == 0) {
  }
  ISA8(0x3f8) = (uint8_t)c;
  in_order();
}

static void select_pci(uint32_t device, uint32_t reg) {
  ISA32(0xcf8) = __builtin_bswap32(0x80000000U | device << 11 | reg);
  in_order();
}
static uint32_t read_pci(uint32_t device, uint32_t reg) {
  select_pci(device, reg);
  return __builtin_bswap32(ISA32(0xcfc));
}
static void write_pci(uint32_t device, uint32_t reg, uint32_t value) {
  select_pci(device, reg);
  ISA32(0xcfc) = __builtin_bswap32(value);
  in_order();
}

/* Success: the keyboard controller pulses the reset line, on which QEMU ends with 0 (-no-reboot). Failure: the PCI
   device 1b36:0011 reports a panic, on which it ends with 1 (-action panic=exit-failure). */
void board_exit(int code) {
  if (code == 0) {
    ISA8(0x64) = 0xfe;
    in_order();
  }
  for (uint32_t device = 1; code != 0 && device < 32; ++device) {
    if (read_pci(device, 0) != 0x00111b36U) continue;
    write_pci(device, 0x10, 0x01000000U);
    write_pci(device, 4, 2);
    *(volatile uint8_t*)0xc1000000U = 1;
  }
  for (;;) {
  }
}

/* The time base is 100 MHz of emulated time; at 128 ns an instruction that is 12.8 ticks. */
uint64_t board_instructions(void) {
  uint32_t high;
  uint32_t low;
  uint32_t again;
  do {
    __asm__ volatile("mftbu %0\n\tmftb %1\n\tmftbu %2" : "=r"(high), "=r"(low), "=r"(again));
  } while (high != again);
  return (((uint64_t)high << 32 | low) * 10U) >> 7;
}
