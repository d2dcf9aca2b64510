# Cairn: one Makefile. `make help` lists every goal.
#
#   TARGET=host            what to build for (platform/<target>)
#   MISSION=paper          sizes and rig (mission_cfg/<mission>)
#   SAN=1                  build with the address and undefined-behaviour sanitizers

TARGET  ?= host
MISSION ?= paper
SAN     ?=

MISSIONS := $(notdir $(patsubst %/mission_values.hpp,%,$(wildcard mission_cfg/*/mission_values.hpp)))
ifeq ($(filter $(MISSION),$(MISSIONS)),)
  $(error MISSION=$(MISSION) is not one of: $(MISSIONS))
endif
ifeq ($(wildcard platform/$(TARGET)),)
  $(error TARGET=$(TARGET) is not one of: $(notdir $(wildcard platform/*)))
endif

B := build/$(TARGET)$(if $(filter-out paper,$(MISSION)),-$(MISSION))$(if $(SAN),-san)
.DEFAULT_GOAL := help
include platform/$(TARGET)/toolchain.mk

# V=1 shows each command.
Q := $(if $(V),,@)
say = @printf '  %-8s %s\n' '$(1)' '$(2)'

# ---- flags ---------------------------------------------------------------------------------------------------------
WARN    := -Wall -Wextra -Wshadow -Wvla -Walloca -Wcast-align -Wdouble-promotion -Wnon-virtual-dtor -Werror
EIGEN   := -DEIGEN_DONT_VECTORIZE -DEIGEN_NO_MALLOC -DEIGEN_NO_IO -DEIGEN_MAX_ALIGN_BYTES=0 -isystem /usr/include/eigen3
INC     := -Ifsw -Imission_cfg -Imission_cfg/$(MISSION) -I. $(EIGEN)
comma   := ,
SANFLAG := $(if $(SAN),-fsanitize=address$(comma)undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
COMMON  := -std=c++17 -g -ffp-contract=off -fno-math-errno -MMD -MP $(WARN) $(INC) $(SANFLAG)
# Flight code: no exceptions, RTTI, guarded statics or stack protector; one section a function, so that unused code goes.
FLIGHT  := $(COMMON) $(if $(SAN),-O1,$(OPT)) -fno-exceptions -fno-rtti -fno-threadsafe-statics -fno-stack-protector \
           -ffunction-sections -fdata-sections -fstack-usage -fcallgraph-info=su
GROUND  := $(COMMON) $(if $(SAN),-O1,-O2) -Iground_tools
TESTING := $(COMMON) $(if $(SAN),-O1,-O2) -Iground_tools -Iunit_tests -DCAIRN_SOURCE_DIR=\"$(CURDIR)\"

# ---- sources -------------------------------------------------------------------------------------------------------
FSW_SRC      := $(sort $(wildcard fsw/*/*.cpp))
PLATFORM_SRC := $(sort $(wildcard platform/$(TARGET)/*.cpp))
TOOL_MAIN    := ground_tools/cairn.cpp
TOOL_SRC     := $(sort $(filter-out $(TOOL_MAIN),$(wildcard ground_tools/*.cpp ground_tools/*/*.cpp)))
SUPPORT_SRC  := $(sort $(wildcard unit_tests/support/*.cpp unit_tests/hal_fakes/*.cpp))
TEST_SRC     := $(sort $(wildcard unit_tests/*/test_*.cpp))
OPENCV_TESTS := $(filter unit_tests/opencv/%,$(TEST_SRC))

obj = $(patsubst %.cpp,$(B)/%.o,$(1))
FSW_LIB      := $(B)/libcairn.a
PLATFORM_LIB := $(B)/libplatform.a
TOOL_LIB     := $(B)/libground.a
SUPPORT_LIB  := $(B)/libsupport.a
CAIRN        := $(B)/cairn
TESTS        := $(patsubst unit_tests/%.cpp,$(B)/tests/%,$(TEST_SRC))

GDAL_LIBS    := -lgdal
OPENCV_LIBS  := -lopencv_features2d -lopencv_calib3d -lopencv_imgproc -lopencv_core
OPENCV_INC   := -isystem /usr/include/opencv4

##@ Goals
help: ## list every goal
	@awk 'BEGIN {FS = ":.*## "} /^##@/ {printf "\n%s\n", substr($$0, 5)} /^[a-z][a-z_-]*:.*## / {printf "  make %-10s %s\n", $$1, $$2}' $(firstword $(MAKEFILE_LIST))
	@printf '\nSettings\n  TARGET=%s   MISSION=%s\n  SAN=1 (sanitizers)\n' '$(notdir $(patsubst %/,%,$(sort $(dir $(wildcard platform/*/toolchain.mk)))))' '$(MISSIONS)'

all: $(FSW_LIB) $(CAIRN) ## build the flight library and the ground tool (build/<target>/)

lib: $(FSW_LIB) ## build the flight library alone

clean: ## remove build/
	rm -rf build

# ---- rules ---------------------------------------------------------------------------------------------------------
$(B)/fsw/%.o: fsw/%.cpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(FLIGHT) -c $< -o $@
$(B)/platform/%.o: platform/%.cpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(GROUND) -c $< -o $@
$(B)/ground_tools/%.o: ground_tools/%.cpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(GROUND) -isystem /usr/include/gdal -c $< -o $@
$(B)/unit_tests/opencv/%.o: unit_tests/opencv/%.cpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(TESTING) $(OPENCV_INC) -isystem /usr/include/gdal -c $< -o $@
$(B)/unit_tests/%.o: unit_tests/%.cpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(TESTING) -isystem /usr/include/gdal -c $< -o $@

archive = $(Q)rm -f $@ && $(AR) rcsD $@ $(filter %.o,$^)
$(FSW_LIB): $(call obj,$(FSW_SRC))
	$(archive)
$(PLATFORM_LIB): $(call obj,$(PLATFORM_SRC))
	$(archive)
$(TOOL_LIB): $(call obj,$(TOOL_SRC))
	$(archive)
$(SUPPORT_LIB): $(call obj,$(SUPPORT_SRC))
	$(archive)

LIBS_ALL = $(TOOL_LIB) $(SUPPORT_LIB) $(PLATFORM_LIB) $(FSW_LIB)
link = $(Q)$(CXX) $(CPU) $(SANFLAG) $(filter %.o,$^) -Wl,--start-group $(filter %.a,$^) -Wl,--end-group
$(CAIRN): $(call obj,$(TOOL_MAIN)) $(TOOL_LIB) $(PLATFORM_LIB) $(FSW_LIB)
	$(link) $(GDAL_LIBS) -lfmt -o $@
# The OpenCV oracles and the integration tests see the ground tools; unit tests see flight code, support and fakes alone.
$(B)/tests/opencv/%: $(B)/unit_tests/opencv/%.o $(LIBS_ALL)
	@mkdir -p $(@D)
	$(link) -lcmocka $(OPENCV_LIBS) $(GDAL_LIBS) -lfmt -o $@
$(B)/tests/ground_tools/%: $(B)/unit_tests/ground_tools/%.o $(LIBS_ALL)
	@mkdir -p $(@D)
	$(link) -lcmocka $(GDAL_LIBS) -lfmt -o $@
$(B)/tests/integration/%: $(B)/unit_tests/integration/%.o $(LIBS_ALL)
	@mkdir -p $(@D)
	$(link) -lcmocka $(GDAL_LIBS) -lfmt -o $@
$(B)/tests/%: $(B)/unit_tests/%.o $(SUPPORT_LIB) $(FSW_LIB)
	@mkdir -p $(@D)
	$(link) -lcmocka -o $@

-include $(shell find $(B) -name '*.d' 2>/dev/null)
.PHONY: help all lib clean
.SECONDARY:
.DELETE_ON_ERROR:
