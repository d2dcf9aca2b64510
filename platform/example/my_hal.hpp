// SPDX-License-Identifier: Apache-2.0
/// What main.cpp sees of its board.
#pragma once

namespace my {

/// Text, number and text on the UART.
void print(const char* before, long number, const char* after);

extern int frames;           ///< that the flight module has reported
extern int frames_right;     ///< of these, with the motion that the camera made
extern unsigned long kicks;  ///< of the watchdog

}  // namespace my
