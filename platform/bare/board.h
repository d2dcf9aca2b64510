// SPDX-License-Identifier: Apache-2.0
/* What a board gives the runtime. Each target has its own board.c. */
#ifndef CAIRN_BOARD_H
#define CAIRN_BOARD_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

void board_putc(char c);
/* Ends the emulation: 0 is success, all else failure. A flight board would reset or halt here. */
void board_exit(int code) __attribute__((noreturn));
/* Instructions since the start, from the emulated timer (EMULATOR in toolchain.mk sets how long one takes). */
uint64_t board_instructions(void);

/* runtime.c */
void board_put(const char* text);
void board_put_hex(uint32_t value);
/* The deepest the stack has been, bytes: it was painted at the start. */
uint32_t board_stack_used(void);

#ifdef __cplusplus
}
#endif

#endif
