# SPDX-License-Identifier: Apache-2.0
# The reset vector of a 750 (MSR[IP] = 1): on to _start (link.ld) in RAM.
    .globl _reset
_reset:
    li      3, 0x2000
    mtctr   3
    bctr
