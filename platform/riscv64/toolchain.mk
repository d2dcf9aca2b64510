# RV64GC (PIC64-HPSC, NOEL-V), bare metal. Debian's Linux cross compiler and newlib; runs on QEMU's virt board.
TRIPLE        := riscv64-linux-gnu-
CPU           := -march=rv64gc -mabi=lp64d -mcmodel=medany -fno-pic -msmall-data-limit=0
NEWLIB_TARGET := riscv64-unknown-elf
NEWLIB_CPU    := -march=rv64gc -mabi=lp64d -mcmodel=medany
NEWLIB_DEFS   :=
LONG_DOUBLE   :=
ELF_MACHINE   := RISC-V
# What the flight library may ask of libgcc and libm: nothing.
FLIGHT_NEEDS  :=
DEPS_TARGET   := g++-riscv64-linux-gnu qemu-system-misc newlib-source
# One instruction is 2^7 ns of the emulated time. The test device ends QEMU with what is written to it.
EMULATOR      := qemu-system-riscv64 -M virt -cpu rv64 -m 128 -bios none -display none -serial stdio -monitor none \
                 -nic none -no-reboot -icount shift=7,sleep=off
run_image      = $(EMULATOR) -kernel $(1)
include platform/bare/bare.mk
