/* SPDX-License-Identifier: Apache-2.0 */
/* Bare-metal start for LEON3 (SPARC V8), qemu-system-sparc -M leon3_generic. RAM at 0x40000000. */
#define NWIN 8
    .section .text.traps, "ax"
    .globl  _trap_table, _start
    .align  4096
#define TRAP(label)  sethi %hi(label), %l4; jmpl %l4 + %lo(label), %g0; rd %psr, %l0; nop
#define BAD(n)       rd %psr, %l0; sethi %hi(_bad), %l4; jmpl %l4 + %lo(_bad), %g0; mov n, %l3
_trap_table:
    BAD(0); BAD(1); BAD(2); BAD(3); BAD(4)          /* 0 reset, 1 iacc, 2 illegal, 3 priv, 4 fp disabled */
    TRAP(_win_ovf)                                  /* 5 window overflow  */
    TRAP(_win_unf)                                  /* 6 window underflow */
    .set n, 7
    .rept 0x80 - 7
    BAD(n)
    .set n, n + 1
    .endr
    BAD(0x80); BAD(0x81); BAD(0x82)
    TRAP(_flush_windows)                            /* 0x83 = ta 3 (setjmp/longjmp) */
    .set n, 0x84
    .rept 0x100 - 0x84
    BAD(n)
    .set n, n + 1
    .endr

    .text
_win_ovf:
    mov     %wim, %l3
    mov     %g1, %l7
    srl     %l3, 1, %g1
    sll     %l3, NWIN - 1, %l4
    or      %l4, %g1, %g1
    save
    mov     %g1, %wim
    nop; nop; nop
    std     %l0, [%sp + 0]
    std     %l2, [%sp + 8]
    std     %l4, [%sp + 16]
    std     %l6, [%sp + 24]
    std     %i0, [%sp + 32]
    std     %i2, [%sp + 40]
    std     %i4, [%sp + 48]
    std     %i6, [%sp + 56]
    restore
    mov     %l7, %g1
    jmp     %l1
    rett    %l2
_win_unf:
    mov     %wim, %l3
    sll     %l3, 1, %l4
    srl     %l3, NWIN - 1, %l5
    or      %l5, %l4, %l5
    mov     %l5, %wim
    nop; nop; nop
    restore
    restore
    ldd     [%sp + 0],  %l0
    ldd     [%sp + 8],  %l2
    ldd     [%sp + 16], %l4
    ldd     [%sp + 24], %l6
    ldd     [%sp + 32], %i0
    ldd     [%sp + 40], %i2
    ldd     [%sp + 48], %i4
    ldd     [%sp + 56], %i6
    save
    save
    jmp     %l1
    rett    %l2
_flush_windows:                     /* ta 3: continue in the interrupted window at _do_flush (clobbers %g1,%g2) */
    mov     %l2, %g1                /* npc = instruction after the ta */
    set     _do_flush, %l4
    jmp     %l4
    rett    %l4 + 4
_do_flush:                          /* NWIN-2 saves force every older window onto its stack */
    mov     NWIN - 2, %g2
1:  save    %sp, -96, %sp
    deccc   %g2
    bne     1b
    nop
    mov     NWIN - 2, %g2
2:  restore
    deccc   %g2
    bne     2b
    nop
    jmp     %g1
    nop
_bad:                               /* l0=psr l1=pc l3=tt : run handler on a fresh stack, traps on */
    set     __estack_top - 96, %sp
    mov     %l3, %o0
    mov     %l1, %o1
    wr      %g0, %wim               /* never returns: no more window traps */
    or      %l0, 0x0f00, %l0        /* PIL = 15 */
    wr      %l0, 0x20, %psr
    nop; nop; nop
    call    runtime_trap
    nop

_start:
    set     _trap_table, %g1
    wr      %g1, %tbr
    wr      %g0, 2, %wim            /* window 1 invalid, CWP = 0 */
    set     0x00001fc0, %g1         /* EF=1 S=1 PS=1 ET=0 PIL=15 CWP=0 */
    wr      %g1, %psr
    nop; nop; nop
    set     fsr0, %g1
    ld      [%g1], %fsr
    set     __stack_top - 96, %sp
    clr     %fp
    set     0x00001fe0, %g1         /* ET=1 */
    wr      %g1, %psr
    nop; nop; nop
    set     __stack_bottom, %g2     /* paint stack */
    set     0xdeadbeef, %g3
1:  cmp     %g2, %sp
    bgeu    2f
    nop
    st      %g3, [%g2]
    ba      1b
    add     %g2, 4, %g2
2:  set     __bss_start, %g2
    set     __bss_end, %g3
3:  cmp     %g2, %g3
    bgeu    4f
    nop
    st      %g0, [%g2]
    ba      3b
    add     %g2, 4, %g2
4:  call    runtime_main
    nop
5:  ba      5b
    nop

    .globl  board_halt_ok, board_halt_fail
board_halt_ok:                        /* ta 0 with ET=0: QEMU LEON3 "power down" -> exit status 0 */
    set     0x10c0, %g1
    wr      %g1, %psr
    nop; nop; nop
    ta      0
    nop
board_halt_fail:                      /* any other trap with ET=0: error mode -> QEMU aborts (rc 134) */
    set     0x10c0, %g1
    wr      %g1, %psr
    nop; nop; nop
    ta      1
    nop
    .section .rodata
    .align 4
fsr0: .word 0x00400000             /* NS: underflow to zero, no trap on subnormal operands; nearest; no traps */
    .section .note.GNU-stack,"",@progbits
