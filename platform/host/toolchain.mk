# Host: the machine that builds. Baseline x86-64, so that every host gives the same bits.
CC      := gcc
CXX     := g++
AR      := ar
NM      := nm
READELF := readelf
OBJDUMP := objdump
ELF_MACHINE := Advanced Micro Devices X86-64
CPU     :=
OPT     := -O3
# Rooms that touch no pixels: -O3 makes their code half as large again.
$(B)/fsw/app/%.o $(B)/fsw/localizer/%.o $(B)/fsw/orbital_map/%.o $(B)/fsw/registration/%.o: FLIGHT += $(if $(SAN),,-O2)
# gold, of binutils as well: 150 tests are linked.
LINKER   = $(CXX) $(CPU) $(SANFLAG) -fuse-ld=gold
CMOCKA_LIB := -lcmocka
run_image = $(1)
