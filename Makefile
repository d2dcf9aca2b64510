# Cairn: one Makefile. `make help` lists every goal.
#
#   TARGET=host            what to build for (platform/<target>)
#   MISSION=paper          sizes and rig (mission_cfg/<mission>)
#   SAN=1                  build with the address and undefined-behaviour sanitizers
#   DEBUG=-g               variables for a debugger, not lines alone

TARGET  ?= host
MISSION ?= paper
SAN     ?=
# Lines only: what a debugger wants besides (-g) is a quarter of the time to build and nine tenths of the library.
DEBUG   ?= -g1

MISSIONS := $(notdir $(patsubst %/mission_values.hpp,%,$(wildcard mission_cfg/*/mission_values.hpp)))
ifeq ($(filter $(MISSION),$(MISSIONS)),)
  $(error MISSION=$(MISSION) is not one of: $(MISSIONS))
endif
TARGETS := $(patsubst platform/%/toolchain.mk,%,$(wildcard platform/*/toolchain.mk))
ifeq ($(filter $(TARGET),$(TARGETS)),)
  $(error TARGET=$(TARGET) is not one of: $(TARGETS))
endif

# Makes within makes say nothing of folders that nobody left.
MAKEFLAGS += --no-print-directory

B := build/$(TARGET)$(if $(filter-out paper,$(MISSION)),-$(MISSION))$(if $(SAN),-san)
include platform/$(TARGET)/toolchain.mk
.DEFAULT_GOAL := $(if $(BARE),all,help)

# V=1 shows each command.
Q := $(if $(V),,@)
say = @printf '  %-8s %s\n' '$(1)' '$(2)'
# Builds within recipes, by as many jobs as the outer one was told: $(build) GOALS. Goals for people begin with
# $(call ready,KIND,GOALS): the packages of deps-KIND, then GOALS.
JOBS ?= $(shell nproc)
jobs  = $(if $(findstring jobserver,$(MAKEFLAGS)),,-j$(JOBS))
build = @+$(MAKE) $(jobs)
ready = @+$(MAKE) deps-$(1) && $(MAKE) $(jobs) $(2)
board = @$(if $(BARE),:,echo 'make $@: give TARGET=$(subst $() ,|,$(filter-out host,$(TARGETS)))'; exit 1)

# ---- flags ---------------------------------------------------------------------------------------------------------
WARN    := -Wall -Wextra -Wshadow -Wvla -Walloca -Wcast-align -Wdouble-promotion -Wnon-virtual-dtor -Werror
EIGEN_HOME := /usr/include/eigen3
EIGEN_TERMS := $(wildcard /usr/share/doc/libeigen3-dev/copyright)
# Unrolled beyond 64 operations (3 x 3), matrices make the flight code 7 kB larger and no faster; the bits are the same.
EIGEN   := -DEIGEN_DONT_VECTORIZE -DEIGEN_UNROLLING_LIMIT=64 -DEIGEN_NO_MALLOC -DEIGEN_NO_IO \
           -DEIGEN_MAX_ALIGN_BYTES=0 -isystem $(EIGEN_HOME)
INC     := -Ifsw -Imission_cfg -Imission_cfg/$(MISSION) -I. $(EIGEN)
comma   := ,
SANFLAG := $(if $(SAN),-fsanitize=address$(comma)undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
COMMON  := -std=c++17 -ffp-contract=off -fno-math-errno -MMD -MP $(WARN) $(INC) $(SANFLAG) $(BARE_DEFS)
# Where size_t has 32 bits, the casts that others of these ask for on 64 would be called useless; and what the
# sanitizers put around shifts converts signs.
FLIGHT_WARN := -Wpedantic -Wconversion -Wsign-conversion -Wold-style-cast -Wcast-qual -Wundef \
           $(if $(BARE),,-Wuseless-cast) $(if $(SAN),-Wno-sign-conversion)
# Flight code: no exceptions, RTTI, guarded statics, stack protector; a section a function, so that unused code goes.
FLIGHT  := $(COMMON) $(FLIGHT_WARN) $(DEBUG) $(if $(SAN),-O1,$(OPT) -fno-asynchronous-unwind-tables) \
           -fno-exceptions -fno-rtti -fno-threadsafe-statics -fno-stack-protector \
           -ffunction-sections -fdata-sections -fstack-usage -fcallgraph-info=su -fno-partial-inlining
# Of a null that is used the address sanitizer tells as well, and alignment matters on flight processors: outside flight
# code the two checks that take half of the sanitizers' time to build are left out.
HOST_SAN := $(if $(SAN),-O1 -fno-sanitize=null$(comma)alignment,-O2)
GROUND  := $(COMMON) $(DEBUG) $(HOST_SAN) -Iground_tools
BARE_CXX := $(if $(BARE),-fno-exceptions -fno-rtti -fno-threadsafe-statics -ffunction-sections -fdata-sections)
TESTING := $(COMMON) $(DEBUG) $(HOST_SAN) -Iground_tools -Iunit_tests -DCAIRN_SOURCE_DIR=\"$(CURDIR)\" $(BARE_CXX)

# ---- sources -------------------------------------------------------------------------------------------------------
FSW_SRC      := $(sort $(wildcard fsw/*/*.cpp platform/$(TARGET)/flight/*.cpp))
PLATFORMS    := platform/$(TARGET) $(if $(BARE),platform/bare)
PLATFORM_SRC := $(sort $(wildcard $(foreach room,$(PLATFORMS),$(addprefix $(room)/*.,cpp c S))))
TAPE_SRC     := platform/tape/tape_hal.cpp platform/tape/player.cpp
TOOL_MAIN    := ground_tools/commands/cairn.cpp
TOOL_SRC     := $(sort $(filter-out $(TOOL_MAIN) ground_tools/checks/%,$(wildcard ground_tools/*/*.cpp)))
SUPPORT_SRC  := $(filter-out $(if $(BARE),%/image_file.cpp),$(sort $(wildcard unit_tests/support/*.cpp)))
# Missions that have a data set, and the test that needs it, in their own sizes.
DATA_TEST    := unit_tests/integration/test_mission_data.cpp
DATA         := $(or $(CAIRN_DATA),../shared/data)
DATA_MISSIONS := euroc kitti lunar
DATA_OF_euroc := euroc_still
DATA_OF_kitti := kitti06
DATA_OF_lunar := lac_stereo
ALL_TESTS    := $(wildcard unit_tests/*/test_*.cpp unit_tests/ground_tools/*/test_*.cpp)
TEST_SRC     := $(sort $(filter-out $(if $(DATA_OF_$(MISSION)),,$(DATA_TEST)),$(ALL_TESTS)))
# Those of ground tools and those that read files are the host's alone.
HOST_TESTS   := $(foreach room,ground_tools integration opencv,unit_tests/$(room)/%)
# What the data sets' test needs of the ground tools.
NOT_FOR_DATA := ortho/heights% cmap/corridor% cmap/delta_% cmap/uplink% cmap/upload_%
DATA_TOOLS   := $(foreach room,base dataset ortho cmap,$(wildcard ground_tools/$(room)/*.cpp))
DATA_TOOLS   := $(filter-out $(NOT_FOR_DATA:%=ground_tools/%),$(DATA_TOOLS))

obj = $(addprefix $(B)/,$(addsuffix .o,$(basename $(1))))
# Compiled a folder at a time, so that headers are read once: ground tools, and flight code where it is only to be
# checked. Flight code that flies is compiled file by file. $(call rooms,WHERE,SOURCES): the objects.
rooms = $(patsubst %/,$(1)/%.room.o,$(sort $(dir $(2))))
# A folder's file: all of them, if they are among SOURCES: $(call room,SOURCES). Makes side by side may write it.
define room
@mkdir -p $(@D)
@printf '#include "%s"  // NOLINT(bugprone-suspicious-include)\n' $(filter $*/%,$(1)) >$@.$$$$; \
  if cmp -s $@.$$$$ $@; then rm $@.$$$$; else mv $@.$$$$ $@; fi
endef
# Loops over pixels, for vectors: -O2 of GCC 12 makes none of them.
PIXEL_LOOPS := $(addprefix ground_tools/,detect/row_kernels.cpp detect/shadow_fit.cpp detect/shadow_spots.cpp \
                 ortho/raster_source.cpp ortho/grey_range.cpp)
TOOL_ROOMS  := $(filter-out $(PIXEL_LOOPS),$(TOOL_SRC))
FSW_LIB      := $(B)/libcairn.a
PLATFORM_LIB := $(B)/libplatform.a
TOOL_LIB     := $(B)/libground.a
SUPPORT_LIB  := $(B)/libsupport.a
TAPE_LIB     := $(B)/libtape.a
CAIRN        := $(B)/cairn
tests_of      = $(patsubst unit_tests/%.cpp,$(B)/tests/%,$(filter-out $(if $(BARE),$(HOST_TESTS)),$(1)))
TESTS        := $(call tests_of,$(TEST_SRC))
# Those that run the program, and all that start processes, kill or wait: what they share is how they do it.
RUNS_PROGRAM := "ground_tools/program\.hpp"
STARTS_OTHER := std::system|popen|\b(fork|kill)[(]
WITH_PROGRAM := $(call tests_of,$(shell grep -lE '$(RUNS_PROGRAM)' $(TEST_SRC)))
WAITING      := $(call tests_of,$(shell grep -lE '$(RUNS_PROGRAM)|$(STARTS_OTHER)' $(TEST_SRC)))

SAMPLE       := unit_tests/integration/sample
DATASET      ?= $(SAMPLE)
DEMO         := build/demo
CAMPAIGN     := build/campaign$(if $(filter-out paper,$(MISSION)),-$(MISSION))

# What integrators get: the files of the board beside the library, and what cairn.pc says. Inline functions of the
# headers must be compiled alike on both sides, so that the flags with a say in layout or in a result go along.
SDK          := $(abspath $(or $(PREFIX),$(B)/sdk))
SDK_BOARD    := $(wildcard $(addprefix platform/,$(addprefix $(TARGET)/*.,c S s ld) bare/board.h bare/runtime.c))
SDK_FLAGS    := -std=% -ffp-contract=% -fno-math-errno -fno-exceptions -fno-rtti -fno-threadsafe-statics -DEIGEN%
RUN           = $(if $(BARE),$(patsubst $(or $(BARE_BOARD),-),$${board}/boot.elf,$(call run_image,IMAGE)))

TOOL_LIBS    := -lgdal -lembree3 -lmpi -lyaml-cpp
OPENCV_LIBS  := -lopencv_features2d -lopencv_calib3d -lopencv_imgproc -lopencv_core
OPENCV_INC   := -isystem /usr/include/opencv4

# ---- packages of Debian 12 -----------------------------------------------------------------------------------------
DEPS_BUILD := g++ make libeigen3-dev libcli11-dev libfmt-dev libgdal-dev nlohmann-json3-dev libtomlplusplus-dev \
              libembree-dev libopenmpi-dev openmpi-bin libyaml-cpp-dev
DEPS_TEST  := libcmocka-dev libopencv-core-dev libopencv-imgproc-dev libopencv-features2d-dev libopencv-calib3d-dev \
              qemu-user
DEPS_CHECK := clang-format clang-tidy cppcheck python3 clang libclang-rt-dev eslint libcmocka-dev
install     = @platform/host/install.sh $(1)

##@ Goals
help: ## list every goal
	@awk -F ':.*## ' '/^##@/ {printf "\n%s\n", substr($$0, 5)} \
	  /^[a-z-]+:.*## / {printf "  make %-12s %s\n", $$1, $$2}' $(firstword $(MAKEFILE_LIST))
	@printf '  make %-12s one of: %s\n' check-NAME '$(sort $(filter-out self-%,$(CHECKS:check-%=%)))'
	@printf '\nSettings\n  TARGET=%s   MISSION=%s\n' '$(TARGETS)' '$(MISSIONS)'
	@printf '  SAN=1 (sanitizers)   DEBUG=-g (variables)\n'

demo: ## render a fresh stretch of terrain, map it, drive over it, and tell how it went
	$(call ready,build,$(CAIRN))
	@mission_cfg/scenes/demo.sh $(CAIRN) $(DEMO)

paper: ## the paper's evaluation: 100 m, 7 map resolutions (SEEDS='1 2 ...' METHOD=shadow); goes on where it was stopped
	$(call ready,build,$(CAIRN))
	@printf 'Rendering sites and drives: %s\n' '$(SEEDS:%=$(PAPER_DATA)/%)'
	@+$(MAKE) $(SEEDS:%=$(PAPER_DATA)/%/data/.rendered)
	@printf 'Preparing maps, driving over them\n'
	$(build) $(PAPER_ALL:%=%/summary.json)
	@$(CAIRN) table $(PAPER_ALL) -o $(PAPER)/table.csv
	@$(CAIRN) report $(PAPER_RUNS:%=$(PAPER)/$(firstword $(SEEDS))/%) -o $(PAPER)/report.html

hirise: ## a mast rig over maps of 25 cm a pixel, VO as it is and worsened (SEEDS='1 2 ...' K=0.15): table, report
	@+$(MAKE) deps-build && $(MAKE) $(jobs) TARGET=host MISSION=mast SAN= build/host-mast/cairn
	@printf 'Rendering sites and drives: %s\n' '$(SEEDS:%=$(HIRISE)/%)'
	@+$(MAKE) $(SEEDS:%=$(HIRISE)/%/data/.rendered)
	@printf 'Preparing maps, driving over them\n'
	$(build) $(HIRISE_ALL:%=%/summary.json)
	@$(HIRISE_CAIRN) table $(HIRISE_ALL) -o $(HIRISE)/table.csv
	@$(HIRISE_CAIRN) report $(HIRISE_ALL) -o $(HIRISE)/report.html
	@for seed in $(SEEDS); do printf 'Boulders seen from the ground, terrain %s\n' $$seed; \
	  run=$(HIRISE)/$$seed/as_it_is-250; \
	  $(HIRISE_CAIRN) map score $$run/boulders.csv --way $$run/truth.tum \
	    --truth $(HIRISE)/$$seed/data/truth_rocks.csv --within 10 --recall-diameter 0.75 --precision-diameter 0.45 \
	    --entry-diameter 0.6 --distance 0.3; done

drone: ## the paper's rig over maps of 5 cm a pixel, VO as it is and worsened (SEEDS='1 2 ...' K=0.07 MM=100): table
	@+$(MAKE) deps-build && $(MAKE) $(jobs) TARGET=host MISSION=drone SAN= build/host-drone/cairn
	@printf 'Rendering sites and drives: %s\n' '$(SEEDS:%=$(DRONE)/%)'
	@+$(MAKE) $(SEEDS:%=$(DRONE)/%/data/.rendered)
	@printf 'Preparing maps, driving over them\n'
	$(build) $(DRONE_ALL:%=%/summary.json)
	@$(DRONE_CAIRN) table $(DRONE_ALL) -o $(DRONE)/table-$(MM)mm.csv

campaign: N ?= 30
campaign: ## drives over N random terrains (N=30): errors, fixes, confidence intervals; goes on where it was stopped
	$(call ready,build,$(CAIRN))
	@$(CAIRN) campaign --trials $(N) -o $(CAMPAIGN)

realism: ## OpenCV's SIFT odometry and grey levels on simulated pairs, beside REFERENCE=folder where given
	$(call ready,test,$(CAIRN) $(B)/sift_vo)
	@$(CAIRN) sim mission_cfg/scenes/realism.toml -o build/realism
	@$(B)/sift_vo build/realism $(REFERENCE)

bench: ## CPU time and operations of a frame on this machine (DATASET=folder, default the sample)
	$(call ready,build,$(CAIRN))
	@$(CAIRN) bench --dataset $(DATASET)

# ROSCO's rocks of a HiRISE picture (Apache 2.0), where they are at hand.
ROSCO ?=
bench-codec: ## bits of a .cmap beside their limits, zstd and xz (ROSCO=file of its rocks)
	$(call install,$(DEPS_BUILD) zstd xz-utils)
	$(build) -s $(B)/codec_table
	@$(B)/codec_table $(ROSCO)

bench-fix: ## point-set trials of the fix: per cent right, declined, false (N=trials a cell; SUITES='start ...')
	$(call ready,test,-s $(B)/bench_fix)
	@$(B)/bench_fix --trials $(N) $(SUITES)

# Drives with spoilt pairs against truth; the folder has truth and true rocks.
bench-faults: DATASET := $(if $(wildcard ../shared/data/rendered_dev),../shared/data/rendered_dev,$(SAMPLE))
bench-faults: ## what pose, sigma and trust say while pairs are spoilt: a row a fault (FAULTS='dark ...')
	$(call ready,test,-s $(B)/fault_table)
	@$(B)/fault_table $(DATASET) $(FAULTS)

shadow-weights: ## fit the shadow method's weights to rendered fields; fails where the source has others (30 min, 2 GB)
	$(call ready,build,$(B)/shadow_weights)
	@$(B)/shadow_weights build/shadow-fields ground_tools/detect/shadow_weights.cpp

sun-weights: ## fit what tells the sun by an image to rendered fields; fails where the source has others (15 min, 2 GB)
	$(call ready,build,$(B)/sun_weights)
	@$(B)/sun_weights build/shadow-fields ground_tools/detect/sun_weights.cpp

bench-detect: ## the shadow method on rendered craters and boulders: recall, precision, reliability (10 min, 2 GB)
	$(call ready,build,$(B)/bench_detect)
	@$(B)/bench_detect build/shadow-fields

bench-map: ## speed and memory of `cairn map build` on up to 60000 x 60000 pixels, OpenCV beside it (1.2 GB of disk)
	$(call ready,test,$(CAIRN) $(B)/bench_map)
	@$(B)/bench_map $(CAIRN) build/bench-map

# An image on the emulated processor, counted: $(call counted,IMAGE,OUT,MORE) leaves OUT.log and OUT.tsv.
counted = $(Q)$(call run_image,$(1)) -plugin $(PROFILER),elf=$(1),timing=$(TIMING),out=$(2).tsv$(3) >$(2).log || \
          { cat $(2).log; exit 1; }
TIMING  = platform/$(TARGET)/timing.toml
bench-decode: ## instructions a boulder that reading a map takes on the emulated processor (TARGET=...; MAP=file)
	$(board)
	$(call ready,test,-s $(B)/decode.elf $(PROFILER) $(BARE_BOARD))
	$(call counted,$(B)/decode.elf,$(B)/decode)
	@awk -F '\t' -f platform/tape/decode.awk $(B)/decode.log $(B)/decode.tsv

stress: ## a drive made to be hard in build/stress, for `make profile DRIVE=build/stress TAPE_FRAMES=180`
	$(call ready,test,$(B)/stress_drive)
	@$(B)/stress_drive $(SAMPLE) build/stress

VARIANTS = $(shell sed -n 's/^\[variant\.\([a-z_]*\).*/\1/p' $(TIMING))
WATCHED  = $(comma)budget=$(TIME_BUDGET)$(FRAME:%=$(comma)frame=%)$(VARIANT:%=$(comma)variant=%)
PROFILE  = $(B)/profile$(DRIVE_NAME:%=-%)$(FROM)$(SLICE:%=-slice-%)$(VARIANT:%=-%)
profile: ## model cycles of each job on the emulated processor against its budget (TARGET=...; DRIVE=...; FRAME=n)
	$(board)
	$(call ready,test,host-cairn $(PROFILER) $(B)/replay.elf $(BARE_BOARD))
	@mkdir -p $(PROFILE)
	@printf 'Running %s on the emulated processor, a few minutes\n' '$(or $(DRIVE),the sample)'
	$(call counted,$(B)/replay.elf,$(PROFILE)/run,$(WATCHED))
	@build/host/cairn profile $(PROFILE)/run.tsv --budget $(TIME_BUDGET) --target $(TARGET) -o $(PROFILE) \
	  --console $(PROFILE)/run.log \
	  $(CLOCK_MHZ:%=--clock %) $(if $(FORGIVING),2>/dev/null) $(if $(SLICE)$(FORGIVING),|| true)

# Nothing is refused here for its budget: boards that the mission doesn't have are asked after.
sensitivity: ## the jobs' time with other memory, caches and FPU of the processor's model (TARGET=...; DRIVE=...)
	$(board)
	@+for variant in '' $(VARIANTS); do $(MAKE) profile VARIANT=$$variant FORGIVING=1 >$(B)/sensitivity.log || \
	  { cat $(B)/sensitivity.log; exit 1; }; printf '  %-8s %s\n' COUNTED "$${variant:-$(TIMING)}"; done
	@build/host/cairn profile-diff $(PROFILE) $(VARIANTS:%=$(PROFILE)-%)

profile-diff: ## two profiles side by side: jobs, and the functions that changed (BEFORE=folder AFTER=folder)
	@$(if $(and $(BEFORE),$(AFTER)),:,echo 'make $@: give BEFORE=folder AFTER=folder'; exit 1)
	$(call ready,build,host-cairn)
	@build/host/cairn profile-diff $(BEFORE) $(AFTER)

# The replay is the host's of the same mission: operations are the same on each target.
HOST_BUILD := build/host$(if $(filter-out paper,$(MISSION)),-$(MISSION))
wcet: ## bounds of each task and of cycle() in time, beside the longest seen (TARGET=...; DRIVE=folder adds a drive)
	$(board)
	@+$(MAKE) deps-build && $(MAKE) TARGET=host SAN= $(jobs) $(HOST_BUILD)/replay.elf $(UNITS) $(ROWS)
	@mkdir -p $(HOST_BUILD)/ops
	@$(HOST_BUILD)/replay.elf >$(HOST_BUILD)/ops/$(or $(DRIVE_NAME),sample).log
	@$(CHECK)/wcet.py $(TIME_BUDGET) --target $(TARGET) $(ROWS) $(UNITS) $(HOST_BUILD)/ops/*.log

fuzz: ## fuzz the readers and the whole module with sanitizers (RUNS=10000000 executions); findings are in build/fuzz
	$(call ready,check,$(FUZZERS))
	@unit_tests/fuzz/run.sh $(RUNS) 20 build/fuzz/found $(FUZZERS)

size: ## code, constants and static memory of the flight library, by module and part, against their budgets
	$(call ready,check,check-memory)

all: $(FSW_LIB) $(if $(BARE),$(TESTS),$(CAIRN)) ## the flight library and the ground tool; of a board, tests and SDK
	@+$(if $(BARE),$(MAKE) sdk,:)

lib: $(FSW_LIB) ## build the flight library alone

sdk: ## for integrators: library, headers, cairn.pc, board files, example; in build/<target>/sdk or PREFIX=folder
	$(call install,g++ make libeigen3-dev pkg-config $(DEPS_TARGET))
	$(build) -s $(FSW_LIB) $(BARE_BOARD)
	@TARGET='$(TARGET)' MISSION='$(MISSION)' BARE='$(BARE)' BOOT='$(BARE_BOARD)' EIGEN='$(EIGEN_HOME)' \
	  EIGEN_TERMS='$(EIGEN_TERMS)' BOARD_FILES='$(SDK_BOARD)' CXX='$(CXX)' CPU='$(CPU)' RUN='$(RUN)' \
	  FLAGS='$(filter $(SDK_FLAGS),$(FLIGHT))' platform/make_sdk.sh $(FSW_LIB) $(SDK)

# As a stranger would: the example, copied away, knows the SDK alone. What the guide promises of it must hold.
GUIDE    := doc/guide/integration.md
MY_ROVER := $(B)/my_rover
try-sdk: ## the integration guide's example on emulated boards, and the guide's figures (TARGET=..., default all)
ifdef BARE
	$(call ready,test,sdk)
	@printf 'The integration example on an emulated %s\n' '$(TARGET)'
	@rm -rf $(MY_ROVER) && cp -R $(SDK)/example $(MY_ROVER)
	@+$(MAKE) -s -C $(MY_ROVER) SDK=$(SDK)
	@timeout 600 $(MAKE) -s -C $(MY_ROVER) SDK=$(SDK) run >$(MY_ROVER)/run.log; \
	  ended=$$?; cat $(MY_ROVER)/run.log; exit $$ended
	@$(CHECK)/integration.py $(TOOLS) --target $(TARGET) --needs '$(FLIGHT_NEEDS)' --size $(SIZE) \
	  $(GUIDE) $(FSW_LIB) $(MY_ROVER)
else
	@+faults=0; for t in $(filter-out host,$(TARGETS)); do \
	  $(MAKE) TARGET=$$t try-sdk || faults=1; done; exit $$faults
endif

clean: ## remove build/
	rm -rf build

test: ## build and run all tests, plain and then with the sanitizers; on other targets than host, under emulation
	@+$(MAKE) deps-test || exit 1; faults=0; \
	run() { printf 'Tests, %s\n' "$$1"; shift; $(MAKE) run-tests "$$@" || faults=1; }; \
	run '$(if $(BARE),on an emulated $(TARGET),plain)' SAN=; \
	$(if $(BARE),$(MAKE) try-sdk || faults=1;, \
	$(foreach m,$(filter-out $(MISSION),$(DATA_MISSIONS)),\
	  if [ -e '$(DATA)/$(DATA_OF_$m)' ]; then \
	    run 'data of mission $m' SAN= MISSION=$m TEST_SRC=$(DATA_TEST) TOOL_SRC='$(DATA_TOOLS)'; \
	  else printf 'Tests, data of mission $m: left out, there is no %s\n' '$(DATA)/$(DATA_OF_$m)'; fi;) \
	run 'with the address and undefined-behaviour sanitizers' SAN=1;) \
	exit $$faults

test-flaky: N ?= 50
test-flaky: ## tests that start processes, kill or wait, each N times (N=50) beside two busy loops
	$(call ready,test,$(WAITING))
	@unit_tests/flaky.sh $(N) $(WAITING)

SAME_BITS := unit_tests/replay/test_replay.cpp unit_tests/core/test_square_root.cpp
# Side by side, since each board's newlib is configured by one process alone; what they share comes first.
same-bits: ## the sample drive on all targets: the same telemetry to the bit (a part of `make test` of each)
	@+for t in $(TARGETS); do $(MAKE) TARGET=$$t deps-test || exit 1; done
	@+$(MAKE) $(jobs) TARGET=host SAN= build/host/cairn && \
	  $(MAKE) TARGET=$(lastword $(filter-out host,$(TARGETS))) $(SAMPLE_TAPE) build/cmocka-src/.done
	@+$(MAKE) $(jobs) -k $(TARGETS:%=same-bits-on-%)
$(TARGETS:%=same-bits-on-%): same-bits-on-%:
	@+printf 'The sample drive on %s\n' '$*'; $(MAKE) TARGET=$* run-tests TEST_SRC='$(SAME_BITS)'

same-drive: ## any drive on all targets: the same sums of all its telemetry (DRIVE=folder, or the sample; TAPE_FRAMES=n)
	@+sums=; faults=0; for t in $(TARGETS); do \
	  $(MAKE) -s TARGET=$$t replay >build/same-drive.log && told=$$(tail -1 build/same-drive.log | tr -d '\r') || \
	    { tail -3 build/same-drive.log; exit 1; }; \
	  printf '%-8s %s\n' "$$t" "$$told"; [ "$$told" = "$${sums:=$$told}" ] || faults=1; \
	done; exit $$faults

replay: ## play a tape on the target (TAPE=file, default the sample): sums of the telemetry
	$(call ready,test,-s $(B)/replay.elf)
	@$(call run_image,$(B)/replay.elf)

check: ## proofs of the flight library; floors, traces, names, layout, format; static analysis; short fuzzing
	$(call ready,check,-k $(CHECKS))

icd: ## make the ICD's tables from the code: telemetry, telecommands, numbers of statuses
	@$(CHECK)/icd.py --write

fmt: ## format all C++ and JavaScript (clang-format)
	clang-format -i $(CXX_FILES) $(filter %.js,$(PAGES))

deps-build: ## install what building asks for and is missing (apt)
	$(call install,$(DEPS_BUILD))
deps-test: ## the same for the tests
	$(call install,$(DEPS_BUILD) $(if $(BARE),$(DEPS_TARGET) xz-utils,$(DEPS_TEST)))
deps-check: ## the same for the checks
	$(call install,$(DEPS_BUILD) $(DEPS_CHECK) $(DEPS_TARGET))

# ---- rules ---------------------------------------------------------------------------------------------------------
# Eigen, half of the time to compile flight code, is read once. Each file includes it all the same where it is used.
EIGEN_READ := $(B)/fsw/eigen_read.hpp
$(EIGEN_READ).gch: fsw/core/eigen.hpp
	@mkdir -p $(@D)
	@echo '#include "core/eigen.hpp"' >$(EIGEN_READ)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(FLIGHT) -x c++-header $(EIGEN_READ) -o $@
$(B)/fsw/%.o: fsw/%.cpp $(EIGEN_READ).gch
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(FLIGHT) -include $(EIGEN_READ) -c $< -o $@
$(B)/platform/$(TARGET)/flight/%.o: platform/$(TARGET)/flight/%.cpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(FLIGHT) -c $< -o $@
$(B)/platform/%.o: platform/%.cpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(GROUND) $(BARE_CXX) -c $< -o $@
$(B)/platform/%.o: platform/%.c
	@mkdir -p $(@D)
	$(call say,CC,$<)
	$(Q)$(CC) $(BARE_FLAGS) -c $< -o $@
$(B)/platform/%.o: platform/%.S
	@mkdir -p $(@D)
	$(call say,AS,$<)
	$(Q)$(CC) $(CPU) -c $< -o $@
# Made on the host, for every target; DRIVE=folder or TAPE=file takes another drive. A board's RAM holds some
# 300 pairs: TAPE_FROM=n begins with another than the first.
SAMPLE_TAPE  = build/sample$(FROM)-$(TAPE_FRAMES).tape
DRIVE       ?=
DRIVE_NAME  := $(notdir $(patsubst %/,%,$(DRIVE)))
TAPE_FRAMES ?= 35
TAPE_FROM   ?= 0
FROM        := $(patsubst -0,,-$(TAPE_FROM))
TAPED        = $(TAPE_FROM):$(shell expr $(TAPE_FROM) + $(TAPE_FRAMES))
DRIVE_TAPE  := $(DRIVE:%=build/drives/$(DRIVE_NAME)$(FROM)-$(TAPE_FRAMES).tape)
TAPE        ?= $(or $(DRIVE_TAPE),$(SAMPLE_TAPE))
$(B)/platform/tape/tape_image.o: platform/tape/tape_image.S $(TAPE) $(B)/tape.name
	@mkdir -p $(@D)
	$(Q)$(CC) $(CPU) -DCAIRN_TAPE='"$(TAPE)"' -c $< -o $@
$(B)/tape.name: FORCE
	@mkdir -p $(@D)
	@echo '$(TAPE)' | cmp -s - $@ || echo '$(TAPE)' >$@
$(SAMPLE_TAPE): $(wildcard $(SAMPLE)/*.txt $(SAMPLE)/*.csv) | $(if $(BARE),host-cairn,$(CAIRN))
	@build/host/cairn map build --from-csv $(SAMPLE)/truth_rocks.csv -o build/sample.cmap
	@build/host/cairn tape --dataset $(SAMPLE) --map build/sample.cmap --frames $(TAPED) -o $@
# Over its own map where the folder has one, else over that of its true rocks.
$(DRIVE_TAPE): $(wildcard $(DRIVE)/*.txt $(DRIVE)/*.csv) | host-cairn
	@mkdir -p $(@D)
	@[ -f $(DRIVE)/map.cmap ] && cp $(DRIVE)/map.cmap $(@:.tape=.cmap) || \
	  build/host/cairn map build --from-csv $(DRIVE)/truth_rocks.csv -o $(@:.tape=.cmap)
	@build/host/cairn tape --dataset $(DRIVE) --map $(@:.tape=.cmap) --frames $(TAPED) -o $@
# SLICE=ops: of one cycle, where not the mission's.
SLICE ?=
$(B)/platform/tape/replay.o: BARE_CXX += $(SLICE:%=-DCAIRN_SLICE_OPS=%)
$(B)/platform/tape/replay.o: $(B)/slice.name
$(B)/slice.name: FORCE
	@mkdir -p $(@D)
	@echo '$(SLICE)' | cmp -s - $@ || echo '$(SLICE)' >$@
host-cairn:
	@+$(MAKE) TARGET=host MISSION=paper SAN= build/host/cairn
$(B)/ground_tools/%.o: ground_tools/%.cpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(GROUND) -isystem /usr/include/gdal -c $< -o $@
$(B)/%.room.cpp: FORCE
	$(call room,$(TOOL_ROOMS) $(FSW_SRC))
$(B)/ground_tools/%.room.o: $(B)/ground_tools/%.room.cpp
	$(call say,CXX,ground_tools/$*/*.cpp)
	$(Q)$(CXX) $(CPU) $(GROUND) -isystem /usr/include/gdal -c $< -o $@
$(B)/fsw/%.room.o: $(B)/fsw/%.room.cpp
	$(call say,CXX,fsw/$*/*.cpp)
	$(Q)$(CXX) $(CPU) $(FLIGHT) -c $< -o $@
# Pages are files of their own in the program.
PAGES     := $(wildcard $(addprefix ground_tools/*/*.,html css js))
EMBEDDERS := $(shell grep -l '^CAIRN_EMBED' ground_tools/*/*.cpp)
$(call rooms,$(B),$(EMBEDDERS)): $(PAGES)
$(call obj,$(PIXEL_LOOPS)): GROUND += $(if $(SAN),,-O3)
# With the sanitizers, what works little is not optimised: half of the time to build it.
IDLE_ROOMS := $(addprefix ground_tools/,campaign/ commands/ map/ plot/ profile/ report/)
$(call rooms,$(B),$(IDLE_ROOMS)) $(call obj,$(TOOL_MAIN)): private GROUND += $(if $(SAN),-O0)
# On the host, what most tests read is compiled once; the compiler takes the one of its flags. Tests of ground tools and
# of the whole are not optimised, which is half of the time to build them: what they test is. Some draw or count much.
QUICK = $(patsubst -O%,-O0,$(TESTING))
BUSY_TESTS := $(addprefix unit_tests/ground_tools/,cmap/test_cmap_file.cpp cmap/test_uplink.cpp \
                detect/test_detector.cpp detect/test_shadow_detector.cpp map/test_diff.cpp)
QUICK_TESTS := $(filter-out $(BUSY_TESTS),$(filter unit_tests/ground_tools/% unit_tests/integration/%,$(TEST_SRC)))
PRECOMPILED := $(if $(BARE),,$(addprefix $(B)/unit_tests/precompiled.hpp.gch/,TESTING QUICK))
$(B)/unit_tests/precompiled.hpp.gch/%: unit_tests/precompiled.hpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $($*) -x c++-header $< -o $@
$(call obj,$(QUICK_TESTS)): private TESTING := $(QUICK)
test_cxx = $(Q)$(CXX) $(CPU) $(if $(PRECOMPILED),-I$(B)/unit_tests -include precompiled.hpp) $(TESTING) $(1) \
             -isystem /usr/include/gdal -c $< -o $@
$(B)/unit_tests/opencv/%.o: unit_tests/opencv/%.cpp $(PRECOMPILED)
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(call test_cxx,$(OPENCV_INC))
$(B)/unit_tests/%.o: unit_tests/%.cpp $(PRECOMPILED) | $(BARE_HEADERS)
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(call test_cxx)

# QEMU's plugin: of the host whatever the target, and the same for every build.
PROFILER      := build/profiler.so
PROFILER_SRC  := $(sort $(wildcard ground_tools/profile/plugin/*.cpp)) ground_tools/profile/function_name.cpp
TIME_BUDGET   := mission_cfg/timing_budget.toml
FRAME         ?=
CLOCK_MHZ     ?=
$(PROFILER): $(PROFILER_SRC) $(wildcard ground_tools/profile/plugin/*.hpp) ground_tools/profile/function_name.hpp
	@mkdir -p $(@D)
	$(call say,CXX,$@)
	$(Q)g++ -std=c++17 -O2 $(WARN) -Iground_tools -fPIC -shared -fvisibility=hidden $(PROFILER_SRC) -o $@

archive = $(Q)rm -f $@ && $(AR) rcsD $@ $(filter %.o,$^)
# A test of a packet must not ask for a camera: what calls the HAL stays in files.
BY_FILE := $(if $(SAN),$(filter fsw/app/%,$(FSW_SRC)),$(FSW_SRC))
$(FSW_LIB): $(call obj,$(BY_FILE)) $(call rooms,$(B),$(filter-out $(BY_FILE),$(FSW_SRC)))
	$(archive)
$(PLATFORM_LIB): $(call obj,$(PLATFORM_SRC))
	$(archive)
$(TOOL_LIB): $(call rooms,$(B),$(TOOL_ROOMS)) $(call obj,$(filter $(PIXEL_LOOPS),$(TOOL_SRC)))
	$(archive)
$(SUPPORT_LIB): $(call obj,$(SUPPORT_SRC))
	$(archive)
$(TAPE_LIB): $(call obj,$(TAPE_SRC))
	$(archive)

LIBS_ALL = $(TOOL_LIB) $(SUPPORT_LIB) $(PLATFORM_LIB) $(FSW_LIB)
link = $(Q)$(LINKER) $(filter %.o,$^) -Wl,--start-group $(filter %.a,$^) $(RUNTIME) -Wl,--end-group
$(CAIRN): $(call obj,$(TOOL_MAIN)) $(TOOL_LIB) $(PLATFORM_LIB) $(FSW_LIB)
	$(link) $(TOOL_LIBS) -lfmt -o $@
# OpenCV oracles and integration tests see the ground tools; unit tests see flight code, support and fakes alone.
$(B)/tests/opencv/%: $(B)/unit_tests/opencv/%.o $(LIBS_ALL)
	@mkdir -p $(@D)
	$(link) -lcmocka $(OPENCV_LIBS) $(TOOL_LIBS) -lfmt -o $@
$(B)/tests/ground_tools/%: $(B)/unit_tests/ground_tools/%.o $(LIBS_ALL)
	@mkdir -p $(@D)
	$(link) -lcmocka $(TOOL_LIBS) -lfmt -o $@
$(B)/bench_map: $(B)/unit_tests/opencv/bench_map.o $(FSW_LIB) $(PLATFORM_LIB)
	$(link) -lopencv_imgproc -lopencv_core -lgdal -lfmt -o $@
$(B)/bench_fix: $(call obj,$(wildcard unit_tests/bench/*.cpp)) $(TOOL_LIB) $(PLATFORM_LIB) $(FSW_LIB)
	$(link) $(TOOL_LIBS) -lfmt -lpthread -o $@
$(B)/sift_vo: $(B)/unit_tests/opencv/sift_vo.o $(TOOL_LIB) $(PLATFORM_LIB) $(FSW_LIB)
	$(link) $(OPENCV_LIBS) $(TOOL_LIBS) -lfmt -o $@
# The model is tested without QEMU, and the plugin with it.
PROFILER_MODEL := $(filter-out %/plugin.cpp,$(wildcard ground_tools/profile/plugin/*.cpp))
$(B)/tests/ground_tools/profile/test_profile_model: $(call obj,$(PROFILER_MODEL))
$(B)/tests/ground_tools/profile/test_profile_plugin: $(PROFILER)
$(WITH_PROGRAM): $(CAIRN)
$(B)/shadow_weights $(B)/sun_weights $(B)/bench_detect: $(B)/%: \
  $(B)/unit_tests/ground_tools/detect/%.o $(TOOL_LIB) $(PLATFORM_LIB) $(FSW_LIB)
	$(link) $(TOOL_LIBS) -lfmt -o $@
$(B)/fault_table $(B)/stress_drive: $(B)/%: $(B)/unit_tests/integration/%.o $(TOOL_LIB) $(PLATFORM_LIB) $(FSW_LIB)
	$(link) $(TOOL_LIBS) -lfmt -o $@
$(B)/codec_table: $(B)/unit_tests/ground_tools/cmap/codec_table.o $(TOOL_LIB) $(PLATFORM_LIB) $(FSW_LIB)
	$(link) $(TOOL_LIBS) -lfmt -o $@
$(B)/tests/integration/%: $(B)/unit_tests/integration/%.o $(LIBS_ALL)
	@mkdir -p $(@D)
	$(link) -lcmocka $(TOOL_LIBS) -lfmt -o $@
$(B)/tests/replay/%: $(B)/unit_tests/replay/%.o $(B)/platform/tape/tape_image.o $(SUPPORT_LIB) $(TAPE_LIB) $(FSW_LIB) \
                     $(BARE_NEEDS)
	@mkdir -p $(@D)
	$(link) $(CMOCKA_LIB) -o $@
$(B)/tests/%: $(B)/unit_tests/%.o $(SUPPORT_LIB) $(FSW_LIB) $(BARE_NEEDS)
	@mkdir -p $(@D)
	$(link) $(CMOCKA_LIB) -o $@
$(B)/replay.elf: $(call obj,platform/tape/replay.cpp platform/tape/tape_image.S) $(TAPE_LIB) $(FSW_LIB) \
                 $(PLATFORM_LIB) $(BARE_NEEDS)
	$(link) -o $@

# The same way a map comes into an image.
MAP ?= build/decode.cmap
build/decode.cmap:
	@+$(MAKE) -s TARGET=host MISSION=paper SAN= build/host/codec_table
	@build/host/codec_table --map $@
$(B)/decode_map.o: platform/tape/tape_image.S $(MAP)
	@mkdir -p $(@D)
	$(Q)$(CC) $(CPU) -DCAIRN_TAPE='"$(MAP)"' -c $< -o $@
$(B)/decode.elf: $(B)/platform/tape/decode.o $(B)/decode_map.o $(FSW_LIB) $(PLATFORM_LIB) $(NEWLIB)/.done
	$(link) -o $@

# ---- the paper's evaluation ----------------------------------------------------------------------------------------
# Each file below is whole or absent, so that make knows what is left to do.
# METHOD=shadow has maps made by it, in a folder of their own, in place of the paper's detector.
METHOD       ?= otsu
PAPER_DATA   := build/paper
PAPER        := build/paper$(if $(filter-out otsu,$(METHOD)),-$(METHOD))
SEEDS        ?= 1
# Orthoimages: those of the paper's Table I, then coarser ones, as named by cairn sim.
PAPER_MAPS   := 5mm 6.67mm 10mm 20mm 50mm 100mm 250mm
PAPER_PIXELS := 0.005,0.00666666666667,0.01,0.02,0.05,0.1,0.25
PAPER_RUNS   := $(foreach map,rocks $(PAPER_MAPS),as_it_is/$(map) degraded/$(map))
PAPER_ALL    := $(foreach seed,$(SEEDS),$(PAPER_RUNS:%=$(PAPER)/$(seed)/%))
# Ends 2.5 m off after the 100 m, as the paper's VO does.
PAPER_DRIFT  := scale=1.02,yaw=0.038deg/m
PAPER_DRIVE   = $(CAIRN) run --dataset $(PAPER_DATA)/$(1)/data --map $$< --ortho $(PAPER_DATA)/$(1)/data/ortho_20mm.tif

$(PAPER_DATA)/%/data/.rendered:
	@mkdir -p $(@D)
	@$(CAIRN) sim mission_cfg/scenes/paper.toml --set seed=$* -o $(@D) --ortho $(PAPER_PIXELS)
	@touch $@
define paper_rules
$(PAPER)/$(1)/%.cmap: $(PAPER_DATA)/$(1)/data/.rendered
	@mkdir -p $$(@D)
	@$$(CAIRN) map build $$(<D)/ortho_$$*.tif --method $(METHOD) -o $$@
$(PAPER)/$(1)/rocks.cmap: $(PAPER_DATA)/$(1)/data/.rendered
	@mkdir -p $$(@D)
	@$$(CAIRN) map build --from-csv $$(<D)/truth_rocks.csv -o $$@
$(PAPER)/$(1)/as_it_is/%/summary.json: $(PAPER)/$(1)/%.cmap
	@mkdir -p $$(@D)
	@$(PAPER_DRIVE) -o $$(@D) >$$(@D)/log
	@printf 'drive %s over %s\n' '$(1)' '$$*'
$(PAPER)/$(1)/degraded/%/summary.json: $(PAPER)/$(1)/%.cmap
	@mkdir -p $$(@D)
	@$(PAPER_DRIVE) --degrade $(PAPER_DRIFT) -o $$(@D) >$$(@D)/log
	@printf 'drive %s over %s, VO made worse\n' '$(1)' '$$*'
endef
$(foreach seed,$(SEEDS),$(eval $(call paper_rules,$(seed))))

# ---- maps of coarse pixels: missions that keep landmarks, whatever MISSION is ---------------------------------------
K  ?=
MM ?= 50
HIRISE        := build/hirise$(K:%=-%)
HIRISE_CAIRN  := build/host-mast/cairn
HIRISE_SCENE  := mission_cfg/scenes/mast_hirise.toml
HIRISE_PIXELS := 0.25
HIRISE_MM     := 250
HIRISE_DRIFT  := scale=1.02,yaw=0.02deg/m
DRONE         := build/drone$(K:%=-%)
DRONE_CAIRN   := build/host-drone/cairn
DRONE_SCENE   := mission_cfg/scenes/drone.toml
DRONE_PIXELS  := 0.05,0.1
DRONE_MM      := $(MM)
DRONE_DRIFT   := $(PAPER_DRIFT)
# Drives of one of the two, over maps of its pixel.
drives         = $(foreach seed,$(SEEDS),$($(1))/$(seed)/as_it_is-$($(1)_MM) $($(1))/$(seed)/degraded-$($(1)_MM))
HIRISE_ALL    := $(call drives,HIRISE)
DRONE_ALL     := $(call drives,DRONE)
coarse_drive   = $($(2)_CAIRN) run --dataset $($(2))/$(1)/data --map $$< \
                   --ortho $($(2))/$(1)/data/ortho_$($(2)_MM)mm.tif -o $$(@D) >$$(@D)/log
# $(1): seed; $(2): HIRISE or DRONE.
define coarse_rules
$($(2))/$(1)/data/.rendered:
	@mkdir -p $$(@D)
	@$($(2)_CAIRN) sim $($(2)_SCENE) --set seed=$(1) $(K:%=--set rocks.k=%) -o $$(@D) --ortho $($(2)_PIXELS) \
	  --ortho-samples 4
	@touch $$@
$($(2))/$(1)/$($(2)_MM)mm.cmap: $($(2))/$(1)/data/.rendered
	@$($(2)_CAIRN) map build $$(<D)/ortho_$($(2)_MM)mm.tif -o $$@
$($(2))/$(1)/as_it_is-$($(2)_MM)/summary.json: $($(2))/$(1)/$($(2)_MM)mm.cmap
	@mkdir -p $$(@D)
	@$(coarse_drive)
$($(2))/$(1)/degraded-$($(2)_MM)/summary.json: $($(2))/$(1)/$($(2)_MM)mm.cmap
	@mkdir -p $$(@D)
	@$(coarse_drive) --degrade $($(2)_DRIFT)
endef
$(foreach rig,HIRISE DRONE,$(foreach seed,$(SEEDS),$(eval $(call coarse_rules,$(seed),$(rig)))))

# ---- fuzzing: flight code by clang, with libFuzzer and the sanitizers, whatever TARGET is --------------------------
FUZZ_CXX     := clang++
FUZZ_FLAGS   := -std=c++17 -O1 -g1 -ffp-contract=off -MMD -MP -Wall -Wextra -Werror -Ifsw -Imission_cfg \
                -I. $(EIGEN) -Iunit_tests -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all
FUZZ_ROOMS   := $(wildcard $(addprefix fsw/,orbital_map/*.cpp core/*.cpp geometry/*.cpp))
FUZZ_FILES   := $(addprefix fsw/app/,packet.cpp telecommand.cpp telemetry.cpp) \
                $(addprefix fsw/localizer/,ground_height.cpp attitude_fusion.cpp) platform/host/assert_handler.cpp
FUZZERS      := $(patsubst unit_tests/fuzz/%.cpp,build/fuzz/%,$(sort $(wildcard unit_tests/fuzz/fuzz_*.cpp)))
OF_GROUND    := $(addprefix build/fuzz/,fuzz_labels fuzz_tables)
READERS      := $(filter-out %/fuzz_app $(OF_GROUND),$(FUZZERS))
RUNS         ?= 10000000
FUZZ_SHORT   := 50000
build/fuzz/%.room.cpp: FORCE
	$(call room,$(wildcard $*/*.cpp))
# A file and a folder in a build of its own: $(call fuzz_rules,BUILD,FLAGS).
define fuzz_rules
build/fuzz/$(1)/%.o: %.cpp
	@mkdir -p $$(@D)
	$$(call say,FUZZ,$$<)
	$$(Q)$$(FUZZ_CXX) $$(FUZZ_FLAGS) $(2) -c $$< -o $$@
build/fuzz/$(1)/%.room.o: build/fuzz/%.room.cpp
	@mkdir -p $$(@D)
	$$(call say,FUZZ,$$*/*.cpp)
	$$(Q)$$(FUZZ_CXX) $$(FUZZ_FLAGS) $(2) -c $$< -o $$@
endef
$(eval $(call fuzz_rules,obj,-Imission_cfg/paper))
$(eval $(call fuzz_rules,ground,-Imission_cfg/paper -Iground_tools -isystem /usr/include/gdal))
# The whole module, small, so that millions of drives are thinkable. What works on pixels is fast, and does not lead the
# fuzzer: it would gather pictures instead of commands.
$(eval $(call fuzz_rules,small,-Iunit_tests/fuzz/app_mission $$(FUZZ_FAST)))
OF_PIXELS    := $(addprefix fsw/,features/ image/ labeling/ segmentation/ vo/)
$(call rooms,build/fuzz/small,$(OF_PIXELS)): private FUZZ_FAST := -O2 -fno-sanitize=fuzzer-no-link
build/fuzz/fuzz_app: $(addprefix build/fuzz/small/,unit_tests/fuzz/fuzz_app.o platform/host/assert_handler.o) \
                     $(call rooms,build/fuzz/small,$(wildcard fsw/*/*.cpp))
$(READERS): build/fuzz/%: build/fuzz/obj/unit_tests/fuzz/%.o $(call rooms,build/fuzz/obj,$(FUZZ_ROOMS)) \
                          $(FUZZ_FILES:%.cpp=build/fuzz/obj/%.o)
# The ground's readers of text, with what they are read through.
GROUND_FUZZ  := $(wildcard $(addprefix ground_tools/,base/*.cpp ortho/*.cpp dataset/*.cpp)) \
                $(wildcard fsw/core/*.cpp fsw/geometry/*.cpp fsw/image/*.cpp)
$(OF_GROUND): build/fuzz/%: build/fuzz/ground/unit_tests/fuzz/%.o build/fuzz/ground/platform/host/assert_handler.o \
                            $(call rooms,build/fuzz/ground,$(GROUND_FUZZ))
$(OF_GROUND): FUZZ_LIBS := -lgdal -lyaml-cpp -lfmt
$(FUZZERS):
	$(Q)$(FUZZ_CXX) -fsanitize=fuzzer,address,undefined $^ $(FUZZ_LIBS) -o $@
check-fuzz: $(FUZZERS)
	@rm -rf build/fuzz/short
	@unit_tests/fuzz/run.sh $$(($(FUZZ_SHORT) * $(words $(READERS) $(OF_GROUND)))) 1 build/fuzz/short \
	  $(READERS) $(OF_GROUND)
	@unit_tests/fuzz/run.sh $$(($(FUZZ_SHORT) / 5)) 1 build/fuzz/short build/fuzz/fuzz_app

# ---- tests and checks ----------------------------------------------------------------------------------------------
# All are built and run even where one fails; then the goal fails.
run-tests:
	@+built=0; $(MAKE) -k $(jobs) $(TESTS) $(B)/tests/failing/fails || built=1; \
	unit_tests/run.sh '$(call run_image,IMAGE)' $(B)/tests $(TESTS) && exit $$built

CXX_FILES    = $(shell git ls-files '*.cpp' '*.hpp' 2>/dev/null || find $(FOLDERS) -name '*.[ch]pp')
FOLDERS     := $(wildcard fsw hal platform ground_tools unit_tests mission_cfg)
# Python's own library alone (-S), as on a machine where nothing was added to it.
CHECK        = python3 -B -S ground_tools/checks
# What is proved of each target's library, and what of the text, once.
PROOFS      := symbols stack isa memory
OF_TEXT     := floors trace names layout prose icd pages
SELF_TESTS  := $(addprefix check-self-,$(PROOFS) flags $(if $(BARE),,$(OF_TEXT) integration schedule wcet))
CHECKS      := $(SELF_TESTS) $(if $(BARE),,check-self-units) \
               $(addprefix check-,$(PROOFS) $(if $(BARE),,$(OF_TEXT) schedule units format cppcheck tidy fuzz))
TOOLS        = --nm $(NM) --ar $(AR) --readelf $(READELF) --objdump $(OBJDUMP) --cxx '$(CXX) $(CPU) $(FLIGHT)'
# An image is proved with the library where there is one that is not older.
IMAGE        = $(if $(BARE),$(shell [ $(B)/replay.elf -nt $(FSW_LIB) ] && echo $(B)/replay.elf))
TIDY         = $(patsubst %.room.o,%.ok,$(call rooms,$(B)/tidy,$(FSW_SRC)))
DEFINES      = $(filter -D% -I%,$(INC))

# Violations planted on purpose, compiled for the target, must be seen.
$(SELF_TESTS): check-self-%:
	@$(CHECK)/$*.py $(if $(filter $*,$(PROOFS) flags),$(TOOLS)) $(SELF_$*) --self-test
SELF_isa     = --machine '$(ELF_MACHINE)'
SELF_flags   = $(SELF_isa)
SELF_memory  = --link '$(CXX) $(CPU)'
$(OF_TEXT:%=check-%): check-%:
	@$(CHECK)/$*.py $(if $(filter pages,$*),$(PAGES))
check-symbols: $(FSW_LIB)
	@$(CHECK)/symbols.py $(TOOLS) --needs '$(FLIGHT_NEEDS)' $(FSW_LIB)
check-stack: $(FSW_LIB) $(B)/figures.o
	@$(CHECK)/stack.py $(TOOLS) --figures $(B)/figures.o $(patsubst %.cpp,$(B)/%.ci,$(FSW_SRC))
check-isa: $(FSW_LIB)
	@$(CHECK)/isa.py $(TOOLS) --machine '$(ELF_MACHINE)' $(FSW_LIB) $(IMAGE)
check-memory: $(B)/libcairn.map $(B)/figures.o
	@$(CHECK)/memory.py $(TOOLS) --figures $(B)/figures.o $(IMAGE:%=--image %.map) $< $(FSW_SRC)
# The linker's account of the whole library; nothing runs.
$(B)/libcairn.map: $(FSW_LIB)
	$(Q)$(CXX) $(CPU) -nostdlib -r -Wl,--strip-debug,--whole-archive $< -Wl,-Map=$@ -o $(B)/libcairn.o
$(B)/figures.o: ground_tools/checks/figures.cpp
	@mkdir -p $(@D)
	$(Q)$(CXX) $(CPU) $(COMMON) -c $< -o $@
# The same table for all targets, each mission's own.
SCHEDULES    := $(MISSIONS:%=build/host/schedule/%.tsv)
build/host/schedule/%.tsv: ground_tools/checks/schedule.cpp mission_cfg/schedule.hpp mission_cfg/mission.hpp \
                           mission_cfg/mission_cfg.hpp mission_cfg/%/mission_values.hpp
	@mkdir -p $(@D)
	$(Q)g++ -std=c++17 $(WARN) -I. -Imission_cfg -Imission_cfg/$* -Ifsw $< -o $(@:.tsv=) && $(@:.tsv=) >$@
# And its longest units of work.
ROWS  := build/host/schedule/$(MISSION).tsv
UNITS := build/host/units/$(MISSION).tsv
$(UNITS): ground_tools/checks/units.cpp fsw/app/unit_bounds.hpp $(wildcard fsw/*/*.hpp mission_cfg/*.hpp) \
          mission_cfg/$(MISSION)/mission_values.hpp
	@mkdir -p $(@D)
	$(Q)g++ -std=c++17 $(WARN) $(INC) $< -o $(@:.tsv=) && $(@:.tsv=) >$@
check-schedule: $(SCHEDULES)
	@$(CHECK)/schedule.py mission_cfg/timing_budget.toml $(SCHEDULES)
# Flight code whose basic blocks are counted, for what a unit of work does against what it asks for.
COUNT        := -fsanitize-coverage=trace-pc
$(B)/counted/fsw/%.room.o: $(B)/fsw/%.room.cpp
	@mkdir -p $(@D)
	$(call say,COUNT,fsw/$*/*.cpp)
	$(Q)$(CXX) $(CPU) $(COMMON) -O2 -fno-exceptions -fno-rtti $(COUNT) -c $< -o $@
$(B)/unit_blocks: unit_tests/integration/unit_blocks.cpp $(call rooms,$(B)/counted,$(filter fsw/%,$(FSW_SRC))) \
                  $(TOOL_LIB) $(SUPPORT_LIB) $(PLATFORM_LIB)
	$(Q)$(CXX) $(CPU) $(TESTING) $(COUNT) $(filter-out %.d %.hpp,$^) $(TOOL_LIBS) -lcmocka -lfmt -o $@
check-self-units: $(B)/unit_blocks
	@$(B)/unit_blocks --self-test
check-units: $(B)/unit_blocks
	@$(B)/unit_blocks
check-format:
	@clang-format --dry-run -Werror $(CXX_FILES) && echo 'format: all files as clang-format has them'
# arrayIndexThenCheck takes a tie broken by index for a bound.
check-cppcheck:
	@cppcheck --quiet --std=c++17 --language=c++ --enable=warning,performance,portability --inline-suppr \
	  --suppress=arrayIndexThenCheck --error-exitcode=1 $(DEFINES) $(FSW_SRC) && echo 'cppcheck: no faults'
check-tidy: $(TIDY)
	@echo 'clang-tidy: no faults'
# A folder at a time, and again only where a file of it or a header has changed. What is included is analysed as well.
TIDY_HEADERS := $(wildcard fsw/*/*.hpp hal/*.hpp mission_cfg/*.hpp mission_cfg/*/*.hpp)
.SECONDEXPANSION:
$(B)/tidy/%.ok: $(B)/%.room.cpp .clang-tidy $(TIDY_HEADERS) $$(wildcard $$*/*.cpp)
	@mkdir -p $(@D)
	$(call say,TIDY,$*/*.cpp)
	$(Q)clang-tidy --quiet --extra-arg=-Xclang --extra-arg=-analyzer-opt-analyze-headers $< -- -std=c++17 $(INC) \
	  2>$@.log || { cat $@.log; exit 1; }
	@touch $@

-include $(shell find $(B) build/fuzz -name '*.d' 2>/dev/null)
# A goal is one that help lists.
.PHONY: $(shell sed -n 's/^\([a-z-]*\):.*## .*/\1/p' Makefile) $(CHECKS) run-tests host-cairn FORCE
.PHONY: $(TARGETS:%=same-bits-on-%)
.SECONDARY:
.DELETE_ON_ERROR:
