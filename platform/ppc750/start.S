/* SPDX-License-Identifier: Apache-2.0 */
/* Bare-metal start for PowerPC 750 on qemu-system-ppc -M 40p (PReP map).
   boot.s at the reset vector comes here, to 0x2000. */
    .section .text.start, "ax"
    .globl  _start
_start:
    li      3, 0x2000              /* MSR: FP=1, IP=0, ME=0, EE=0 */
    mtmsr   3
    isync
    lis     1, __stack_top@ha
    addi    1, 1, __stack_top@l
    li      0, 0
    stwu    0, -16(1)
    lis     13, _SDA_BASE_@ha
    addi    13, 13, _SDA_BASE_@l
    li      2, 0
    /* paint the stack for high-water measurement */
    lis     3, __stack_bottom@ha
    addi    3, 3, __stack_bottom@l
    lis     5, 0xdead
    ori     5, 5, 0xbeef
0:  cmplw   3, 1
    bge     1f
    stw     5, 0(3)
    addi    3, 3, 4
    b       0b
    /* bss */
1:  lis     3, __bss_start@ha
    addi    3, 3, __bss_start@l
    lis     4, __bss_end@ha
    addi    4, 4, __bss_end@l
2:  cmplw   3, 4
    bge     3f
    stw     0, 0(3)
    addi    3, 3, 4
    b       2b
3:  mtfsf   0xff, 0
    mtfsb1  29                      /* NI: underflow to zero, as the other targets' units do */
    bl      runtime_main
4:  b       4b

    .section .text.setjmp, "ax"    /* goes where nothing calls it, and with it the need of a C library */
    .globl  _setjmp
_setjmp:
    b       setjmp

    /* exception vectors 0x100..0x1400 (IP=0): report vector and stop with failure */
    .section .vectors, "ax"
    .macro  VEC off
    .org    \off
    li      3, \off
    mfspr   4, 26                   /* SRR0 */
    b       _vec_common
    .endm
    VEC 0x100
    VEC 0x200
    VEC 0x300
    VEC 0x400
    VEC 0x500
    VEC 0x600
    VEC 0x700
    VEC 0x800
    VEC 0x900
    VEC 0xc00
    VEC 0xd00
    .org 0x1500
_vec_common:
    lis     1, __estack_top@ha
    addi    1, 1, __estack_top@l
    lis     5, runtime_trap@ha
    addi    5, 5, runtime_trap@l
    mtctr   5
    li      0, 0
    stwu    0, -16(1)
    mfmsr   6
    ori     6, 6, 0x2000
    mtmsr   6
    isync
    bctrl
    .section .note.GNU-stack,"",@progbits
