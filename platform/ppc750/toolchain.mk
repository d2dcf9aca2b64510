# PowerPC 750 (RAD750), bare metal. Debian's Linux cross compiler and newlib; runs on QEMU's PReP board, whose
# processor is a 750.
TRIPLE        := powerpc-linux-gnu-
CPU           := -mcpu=750 -mno-sdata -fno-pic
NEWLIB_TARGET := powerpc-eabi
NEWLIB_CPU    := -mcpu=750
NEWLIB_DEFS   := -D__IEEE_BIG_ENDIAN
LONG_DOUBLE   := -mlong-double-64
ELF_MACHINE   := PowerPC
# What the flight library may ask of libgcc and libm (ground_tools/checks/symbols.py); nothing of libm.
FLIGHT_NEEDS  := __udivdi3 __floatundidf
DEPS_TARGET   := g++-powerpc-linux-gnu qemu-system-ppc newlib-source
# One instruction is 2^7 ns of the emulated time. A failed exit is a guest panic.
EMULATOR      := qemu-system-ppc -M 40p -cpu 750 -m 128 -vga none -nic none -display none -serial stdio \
                 -monitor none -audiodev none,id=none -global cs4231a.audiodev=none -device pvpanic-pci \
                 -no-reboot -action panic=exit-failure -icount shift=7,sleep=off
# The board's ROM holds no more than a jump; the image comes into RAM beside it.
run_image      = $(EMULATOR) -bios $(BOOT) -device loader,file=$(1)
BOOT          := build/boot-ppc750.elf
BARE_BOARD     = $(BOOT)
include platform/bare/bare.mk

$(BOOT): platform/ppc750/boot.s
	@mkdir -p $(@D)
	$(Q)$(CC) -nostdlib -static -no-pie -Wl,-Ttext=0xfff00100,-e,_reset,--build-id=none,-z,noexecstack $< -o $@
