# LEON3 (SPARC V8), bare metal. Debian's 64-bit SPARC cross compiler with -m32, and newlib; runs on
# QEMU's generic LEON3.
# Images must be pure V8: libgcc_v8.c stands in for the parts of libgcc that are not.
# ERRATA=gr712rc|ut700|ut699|at697f has the compiler go round that part's errata (doc/guide/integration.md).
ERRATA        ?=
TRIPLE        := sparc64-linux-gnu-
# Sums over unrolled windows have more operands than there are registers; without -fsched-pressure all are loaded
# before the first is used, and those that don't fit go through the write buffer.
CPU           := -m32 -mcpu=leon3 -fno-pic -fsched-pressure $(ERRATA:%=-mfix-%)
NEWLIB_TARGET := sparc-leon3-elf
NEWLIB_CPU    := -m32 -mcpu=leon3
NEWLIB_DEFS   :=
LONG_DOUBLE   := -mlong-double-64
ELF_MACHINE   := Sparc
# What the flight library may ask of libgcc (libgcc_v8.c has it); nothing of libm.
FLIGHT_NEEDS  := __udivdi3 __floatundidf
DEPS_TARGET   := g++-multilib-sparc64-linux-gnu gcc-multilib-sparc64-linux-gnu qemu-system-sparc newlib-source
# One instruction is 2^10 ns of the emulated time. A failed exit is a trap with traps off: QEMU aborts.
EMULATOR      := qemu-system-sparc -M leon3_generic -cpu LEON3 -m 128 -display none -serial stdio -monitor none \
                 -nic none -no-reboot -icount shift=10,sleep=off
run_image      = $(EMULATOR) -kernel $(1)
include platform/bare/bare.mk
