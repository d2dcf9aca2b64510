/* SPDX-License-Identifier: Apache-2.0 */
/* Bare-metal start for RV64GC on qemu-system-riscv64 -M virt: machine mode, hart 0. */
    .section .text.start, "ax"
    .globl  _start
_start:
    csrr    t0, mhartid
    bnez    t0, park
    .option push
    .option norelax
    la      gp, __global_pointer$
    .option pop
    la      sp, __stack_top
    la      t0, trap
    csrw    mtvec, t0
    li      t0, 0x6000              /* mstatus.FS: floating point on */
    csrs    mstatus, t0
    csrwi   fcsr, 0                 /* round to nearest; this unit never traps and keeps subnormals */
    /* paint the stack for high-water measurement */
    la      t0, __stack_bottom
    li      t1, 0xdeadbeef
0:  bgeu    t0, sp, 1f
    sw      t1, 0(t0)
    addi    t0, t0, 4
    j       0b
    /* bss */
1:  la      t0, __bss_start
    la      t1, __bss_end
2:  bgeu    t0, t1, 3f
    sd      zero, 0(t0)
    addi    t0, t0, 8
    j       2b
3:  call    runtime_main
park:
    wfi
    j       park

    /* report cause and place, and stop with failure, on a stack of its own */
    .balign 4
trap:
    la      sp, __estack_top
    csrr    a0, mcause
    csrr    a1, mepc
    tail    runtime_trap

    .section .text.setjmp, "ax"     /* goes where nothing calls it, and with it the need of a C library */
    .globl  _setjmp
_setjmp:
    tail    setjmp
    .section .note.GNU-stack,"",@progbits
