/* SPDX-License-Identifier: Apache-2.0 */
/* From start.S to main and back; traps. No library below it. */
#include "board.h"

#include <stddef.h>

extern uint32_t __stack_bottom[];
extern uint32_t __stack_top[];
extern void (*__init_array_start[])(void);
extern void (*__init_array_end[])(void);
int main(void);
void runtime_main(void);
void runtime_trap(uint32_t vector, uint32_t pc);

void board_put(const char* text) {
  while (*text != '\0') board_putc(*text++);
}

void board_put_hex(uint32_t value) {
  for (int shift = 28; shift >= 0; shift -= 4) board_putc("0123456789abcdef"[(value >> shift) & 15U]);
}

uint32_t board_stack_used(void) {
  const uint32_t* p = __stack_bottom;
  while (p < __stack_top && *p == 0xdeadbeefU) ++p;
  return (uint32_t)((const char*)__stack_top - (const char*)p);
}

void runtime_main(void) {
  for (void (**construct)(void) = __init_array_start; construct < __init_array_end; ++construct) (*construct)();
  board_exit(main());
}

/* Any exception that is not the window's own (SPARC): none is expected, so that it is a fault of the image. */
void runtime_trap(uint32_t vector, uint32_t pc) {
  board_put("\ntrap ");
  board_put_hex(vector);
  board_put(" at ");
  board_put_hex(pc);
  board_put("\n");
  board_exit(1);
}
