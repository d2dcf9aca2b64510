# Host: the machine that builds. Baseline x86-64, so that every host gives the same bits.
CXX := g++
AR  := ar
NM  := nm
CPU :=
OPT := -O3
SIZE := size
