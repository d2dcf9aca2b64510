# Host: the machine that builds. Baseline x86-64, so that every host gives the same bits.
CC      := gcc
CXX     := g++
AR      := ar
NM      := nm
SIZE    := size
READELF := readelf
OBJDUMP := objdump
CPU     :=
OPT     := -O3
LINKER   = $(CXX) $(CPU) $(SANFLAG)
CMOCKA_LIB := -lcmocka
run_image = $(1)
