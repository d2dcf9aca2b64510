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
TARGETS := $(patsubst platform/%/toolchain.mk,%,$(wildcard platform/*/toolchain.mk))
ifeq ($(filter $(TARGET),$(TARGETS)),)
  $(error TARGET=$(TARGET) is not one of: $(TARGETS))
endif

B := build/$(TARGET)$(if $(filter-out paper,$(MISSION)),-$(MISSION))$(if $(SAN),-san)
include platform/$(TARGET)/toolchain.mk
.DEFAULT_GOAL := $(if $(BARE),all,help)

# V=1 shows each command.
Q := $(if $(V),,@)
say = @printf '  %-8s %s\n' '$(1)' '$(2)'

# ---- flags ---------------------------------------------------------------------------------------------------------
WARN    := -Wall -Wextra -Wshadow -Wvla -Walloca -Wcast-align -Wdouble-promotion -Wnon-virtual-dtor -Werror
EIGEN_HOME := /usr/include/eigen3
EIGEN_TERMS := $(wildcard /usr/share/doc/libeigen3-dev/copyright)
EIGEN   := -DEIGEN_DONT_VECTORIZE -DEIGEN_NO_MALLOC -DEIGEN_NO_IO -DEIGEN_MAX_ALIGN_BYTES=0 -isystem $(EIGEN_HOME)
INC     := -Ifsw -Imission_cfg -Imission_cfg/$(MISSION) -I. $(EIGEN)
comma   := ,
SANFLAG := $(if $(SAN),-fsanitize=address$(comma)undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
COMMON  := -std=c++17 -ffp-contract=off -fno-math-errno -MMD -MP $(WARN) $(INC) $(SANFLAG) $(BARE_DEFS)
# Flight code: no exceptions, RTTI, guarded statics or stack protector; one section a function, so that unused code goes.
FLIGHT  := $(COMMON) -g $(if $(SAN),-O1,$(OPT)) -fno-exceptions -fno-rtti -fno-threadsafe-statics -fno-stack-protector \
           -ffunction-sections -fdata-sections -fstack-usage -fcallgraph-info=su $(if $(SAN),,-fno-asynchronous-unwind-tables)
# Lines only: whole debug information of templates is a quarter of the time to build.
GROUND  := $(COMMON) -g1 $(if $(SAN),-O1,-O2) -Iground_tools
TESTING := $(COMMON) -g1 $(if $(SAN),-O1,-O2) -Iground_tools -Iunit_tests -DCAIRN_SOURCE_DIR=\"$(CURDIR)\" \
           $(if $(BARE),-fno-exceptions -fno-rtti -fno-threadsafe-statics -ffunction-sections -fdata-sections)

# ---- sources -------------------------------------------------------------------------------------------------------
FSW_SRC      := $(sort $(wildcard fsw/*/*.cpp platform/$(TARGET)/flight/*.cpp))
PLATFORM_SRC := $(sort $(wildcard $(foreach room,$(TARGET) $(if $(BARE),bare),$(addprefix platform/$(room)/*.,cpp c S))))
TAPE_SRC     := platform/tape/tape_hal.cpp platform/tape/player.cpp
TOOL_MAIN    := ground_tools/commands/cairn.cpp
TOOL_SRC     := $(sort $(filter-out $(TOOL_MAIN) ground_tools/checks/%,$(wildcard ground_tools/*/*.cpp)))
SUPPORT_SRC  := $(filter-out $(if $(BARE),%/image_file.cpp),$(sort $(wildcard unit_tests/support/*.cpp)))
TEST_SRC     := $(sort $(wildcard unit_tests/*/test_*.cpp unit_tests/ground_tools/*/test_*.cpp))
# Those of ground tools and those that read files are the host's alone.
HOST_TESTS   := $(foreach room,ground_tools integration opencv,unit_tests/$(room)/%)
# Missions whose data set only this test needs, and only in their own sizes.
DATA_MISSIONS := euroc kitti lunar
DATA_TEST    := unit_tests/integration/test_mission_data.cpp
NOT_FOR_DATA := ortho/heights% cmap/delta_% cmap/uplink% cmap/upload_%
DATA_TOOLS   := $(foreach room,base dataset ortho detect cmap,$(wildcard ground_tools/$(room)/*.cpp))
DATA_TOOLS   := $(filter-out $(NOT_FOR_DATA:%=ground_tools/%),$(DATA_TOOLS))

obj = $(addprefix $(B)/,$(addsuffix .o,$(basename $(1))))
FSW_LIB      := $(B)/libcairn.a
PLATFORM_LIB := $(B)/libplatform.a
TOOL_LIB     := $(B)/libground.a
SUPPORT_LIB  := $(B)/libsupport.a
TAPE_LIB     := $(B)/libtape.a
CAIRN        := $(B)/cairn
TESTS        := $(patsubst unit_tests/%.cpp,$(B)/tests/%,$(if $(BARE),$(filter-out $(HOST_TESTS),$(TEST_SRC)),$(TEST_SRC)))

SAMPLE       := unit_tests/integration/sample
DATASET      ?= $(SAMPLE)
DEMO         := build/demo
DEMO_SCENE   := mission_cfg/scenes/demo.toml
CAMPAIGN     := build/campaign$(if $(filter-out paper,$(MISSION)),-$(MISSION))
N            ?= 30

# What integrators get: the files of the board beside the library, and what cairn.pc says. Inline functions of the headers
# must be compiled alike on both sides, so that the flags with a say in layout or in a result go along.
SDK          := $(abspath $(or $(PREFIX),$(B)/sdk))
SDK_BOARD    := $(wildcard $(addprefix platform/,$(addprefix $(TARGET)/*.,c S s ld) bare/board.h bare/runtime.c))
SDK_FLAGS    := -std=% -ffp-contract=% -fno-math-errno -fno-exceptions -fno-rtti -fno-threadsafe-statics -DEIGEN%
CAIRN_PC      = -e 's|@TARGET@|$(TARGET)|; s|@MISSION@|$(MISSION)|; s|@CXX@|$(CXX)|; s|@CPU@|$(CPU)|' \
                -e 's|@BOARD@|$(if $(BARE),$${prefix}/platform/$(TARGET))|; s|@FLAGS@|$(filter $(SDK_FLAGS),$(FLIGHT))|' \
                -e 's|@RUN@|$(if $(BARE),$(patsubst $(or $(BARE_BOARD),-),$${board}/boot.elf,$(call run_image,IMAGE)))|'

TOOL_LIBS    := -lgdal -lembree3 -lmpi
OPENCV_LIBS  := -lopencv_features2d -lopencv_calib3d -lopencv_imgproc -lopencv_core
OPENCV_INC   := -isystem /usr/include/opencv4

# ---- packages of Debian 12 -----------------------------------------------------------------------------------------
DEPS_BUILD := g++ make libeigen3-dev libcli11-dev libfmt-dev libgdal-dev nlohmann-json3-dev libtomlplusplus-dev libembree-dev \
              libopenmpi-dev openmpi-bin
DEPS_TEST  := libcmocka-dev libopencv-core-dev libopencv-imgproc-dev libopencv-features2d-dev libopencv-calib3d-dev qemu-user
DEPS_CHECK := clang-format clang-tidy cppcheck python3 clang libclang-rt-dev
ROOT_DO     = $(if $(filter-out 0,$(shell id -u)),sudo) env DEBIAN_FRONTEND=noninteractive apt-get
# Asks dpkg for each package; installs those that are absent, with fresh lists only where the old ones do not do.
define install
@command -v dpkg-query >/dev/null || { echo 'deps: no dpkg here; install these by hand: $(1)'; exit 0; }; \
missing=; for p in $(1); do \
  dpkg-query -W -f '$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || missing="$$missing $$p"; done; \
if [ -n "$$missing" ]; then \
  echo "deps: installing$$missing"; log=$$(mktemp); \
  { $(ROOT_DO) install -y -q --no-install-recommends $$missing || { $(ROOT_DO) update -q && \
    $(ROOT_DO) install -y -q --no-install-recommends $$missing; }; } >$$log 2>&1 || \
    { tail -n 5 $$log; rm -f $$log; echo "deps: apt-get failed; install by hand:$$missing"; exit 1; }; \
  rm -f $$log; \
fi
endef

##@ Goals
help: ## list every goal
	@awk 'BEGIN {FS = ":.*## "} /^##@/ {printf "\n%s\n", substr($$0, 5)} /^[a-z][a-z_-]*:.*## / {printf "  make %-10s %s\n", $$1, $$2}' $(firstword $(MAKEFILE_LIST))
	@printf '\nSettings\n  TARGET=%s   MISSION=%s\n  SAN=1 (sanitizers)\n' '$(TARGETS)' '$(MISSIONS)'

demo: ## render a fresh stretch of terrain, map it, drive over it, and tell how it went
	@$(MAKE) --no-print-directory deps-build
	@printf 'Building the flight module and the ground tool\n'
	@$(MAKE) --no-print-directory -j$(JOBS) $(CAIRN)
	@mkdir -p $(DEMO)
	@printf '\nRendering the site and the drive of %s\n' '$(DEMO_SCENE)'
	@$(CAIRN) sim $(DEMO_SCENE) -o $(DEMO)/data --ortho 0.005
	@printf '\nPreparing the orbital map from %s\n' '$(DEMO)/data/ortho_5mm.tif'
	@$(CAIRN) map build $(DEMO)/data/ortho_5mm.tif -o $(DEMO)/site.cmap --csv $(DEMO)/orbital.csv
	@printf '\nDriving, VO as it is\n'
	@$(CAIRN) run --dataset $(DEMO)/data --map $(DEMO)/site.cmap --ortho $(DEMO)/data/ortho_5mm.tif -o $(DEMO)/as_it_is
	@printf '\nThe same with VO made worse on purpose (2 %% and 0.1 degrees a metre)\n'
	@$(CAIRN) run --dataset $(DEMO)/data --map $(DEMO)/site.cmap --ortho $(DEMO)/data/ortho_5mm.tif -o $(DEMO)/degraded \
	  --degrade scale=1.02,yaw=0.1deg/m
	@printf '\n'
	@$(CAIRN) report $(DEMO)/as_it_is $(DEMO)/degraded -o $(DEMO)/report.html
	@printf 'Open it with a browser; it needs no network.\n'

paper: ## the paper's evaluation at its scale: 100 m, 7 map resolutions (SEEDS='1 2 ...'); goes on where it was stopped
	@$(MAKE) --no-print-directory deps-build
	@$(MAKE) --no-print-directory -j$(JOBS) $(CAIRN)
	@printf 'Rendering sites and drives: %s\n' '$(SEEDS:%=$(PAPER)/%)'
	@$(MAKE) --no-print-directory $(SEEDS:%=$(PAPER)/%/data/.rendered)
	@printf 'Preparing maps, driving over them\n'
	@$(MAKE) --no-print-directory -j$(JOBS) $(foreach seed,$(SEEDS),$(PAPER_RUNS:%=$(PAPER)/$(seed)/%/summary.json))
	@$(CAIRN) table $(foreach seed,$(SEEDS),$(PAPER_RUNS:%=$(PAPER)/$(seed)/%)) -o $(PAPER)/table.csv
	@$(CAIRN) report $(PAPER_RUNS:%=$(PAPER)/$(firstword $(SEEDS))/%) -o $(PAPER)/report.html

campaign: ## drives over N random terrains (N=30): errors and fixes with confidence intervals; goes on where it was stopped
	@$(MAKE) --no-print-directory deps-build
	@$(MAKE) --no-print-directory -j$(JOBS) $(CAIRN)
	@$(CAIRN) campaign --trials $(N) -o $(CAMPAIGN)

realism: ## OpenCV's SIFT odometry and grey levels on simulated pairs, beside REFERENCE=folder where given
	@$(MAKE) --no-print-directory deps-test
	@$(MAKE) --no-print-directory -j$(JOBS) $(CAIRN) $(B)/sift_vo
	@$(CAIRN) sim mission_cfg/scenes/realism.toml -o build/realism
	@$(B)/sift_vo build/realism $(REFERENCE)

bench: ## time and operations of a frame on this machine (DATASET=folder, default the sample)
	@$(MAKE) --no-print-directory deps-build
	@$(MAKE) --no-print-directory -j$(JOBS) $(CAIRN)
	@$(CAIRN) bench --dataset $(DATASET)

# ROSCO's rocks of a HiRISE picture (Apache 2.0), where they are at hand.
ROSCO ?=
bench-codec: ## bits of a .cmap beside their limits, zstd and xz (ROSCO=file of its rocks)
	$(call install,$(DEPS_BUILD) zstd xz-utils)
	@$(MAKE) --no-print-directory -s -j$(JOBS) $(B)/codec_table
	@$(B)/codec_table $(ROSCO)

bench-map: ## speed and memory of `cairn map build` on images of up to 60000 x 60000, OpenCV beside it (1.2 GB of disk)
	@$(MAKE) --no-print-directory deps-test
	@$(MAKE) --no-print-directory -j$(JOBS) $(CAIRN) $(B)/bench_map
	@$(B)/bench_map $(CAIRN) build/bench-map

bench-decode: ## instructions a boulder that reading a map takes on the emulated processor (TARGET=ppc750|leon3; MAP=file)
	@$(if $(BARE),:,echo 'make bench-decode: give TARGET=$(subst $() ,|,$(filter-out host,$(TARGETS)))'; exit 1)
	@$(MAKE) --no-print-directory deps-test
	@$(MAKE) --no-print-directory -s -j$(JOBS) $(B)/decode.elf $(PROFILER) $(BARE_BOARD)
	$(Q)$(call run_image,$(B)/decode.elf) -plugin $(PROFILER),elf=$(B)/decode.elf,timing=platform/$(TARGET)/timing.toml,out=$(B)/decode.tsv >$(B)/decode.log || { cat $(B)/decode.log; exit 1; }
	@awk -F'\t' 'NR == FNR {split($$0, w, " "); if (w[1] == "boulders") {n = w[2]; m = w[4]}; next} \
	  $$1 == "function" && $$3 ~ /OrbitalMap6window/ {printf "window: %.1f instructions, %.1f cycles a boulder (%d boulders)\n", $$5 / m, $$6 / m, m} \
	  $$1 == "function" && $$3 ~ /MapValidation4step/ {printf "validation: %.1f instructions, %.1f cycles a boulder\n", $$5 / n, $$6 / n}' \
	  $(B)/decode.log $(B)/decode.tsv

profile: ## model cycles of each job on the emulated processor against its budget (TARGET=ppc750|leon3; FRAME=n in detail)
	@$(if $(BARE),:,echo 'make profile: give TARGET=$(subst $() ,|,$(filter-out host,$(TARGETS)))'; exit 1)
	@$(MAKE) --no-print-directory deps-test
	@$(MAKE) --no-print-directory -j$(JOBS) host-cairn $(PROFILER) $(B)/replay.elf $(BARE_BOARD)
	@mkdir -p $(B)/profile
	@printf 'Running the sample on the emulated processor, a few minutes\n'
	$(Q)$(call run_image,$(B)/replay.elf) -plugin $(PROFILER),elf=$(B)/replay.elf,timing=platform/$(TARGET)/timing.toml,budget=$(TIME_BUDGET),out=$(B)/profile/run.tsv$(if $(FRAME),$(comma)frame=$(FRAME)) >$(B)/profile/log || { cat $(B)/profile/log; exit 1; }
	@build/host/cairn profile $(B)/profile/run.tsv --budget $(TIME_BUDGET) --target $(TARGET) -o $(B)/profile $(if $(CLOCK_MHZ),--clock $(CLOCK_MHZ))

fuzz: ## fuzz map reader, chunks and deltas with sanitizers (RUNS=10000000 executions in all); what it finds is in build/fuzz
	@$(MAKE) --no-print-directory deps-check
	@$(MAKE) --no-print-directory -j$(JOBS) $(FUZZERS)
	@$(foreach f,$(FUZZERS),$(call run_fuzzer,$(f),$$(($(RUNS) / $(words $(FUZZERS)))),20,build/fuzz/found)) echo 'fuzz: no findings'

size: ## code, constants and static memory of the flight library, by module and part, against their budgets
	@$(MAKE) --no-print-directory deps-check
	@$(MAKE) --no-print-directory -j$(JOBS) check-memory

all: $(FSW_LIB) $(if $(BARE),$(TESTS),$(CAIRN)) ## build the flight library, and the ground tool (host) or tests and SDK (other targets)
	@$(if $(BARE),$(MAKE) --no-print-directory sdk,:)

lib: $(FSW_LIB) ## build the flight library alone

sdk: ## for integrators: library, headers, cairn.pc, board files, example; in build/<target>/sdk or PREFIX=folder
	$(call install,g++ make libeigen3-dev pkg-config $(DEPS_TARGET))
	@$(MAKE) --no-print-directory -s -j$(JOBS) $(FSW_LIB) $(BARE_BOARD)
	@[ ! -e $(SDK) ] || [ -f $(SDK)/lib/pkgconfig/cairn.pc ] || { echo 'sdk: $(SDK) is there and is no SDK; choose another PREFIX'; exit 1; }
	@rm -rf $(SDK).part && mkdir -p $(addprefix $(SDK).part/,lib/pkgconfig include/cairn/hal include/eigen3 platform/bare)
	@cp $(FSW_LIB) $(SDK).part/lib && sed $(CAIRN_PC) platform/cairn.pc.in >$(SDK).part/lib/pkgconfig/cairn.pc
	@cd fsw && cp --parents */*.hpp $(SDK).part/include/cairn
	@cp hal/*.hpp $(SDK).part/include/cairn/hal && cp mission_cfg/*.hpp mission_cfg/$(MISSION)/*.hpp $(SDK).part/include/cairn
	@cp -R $(EIGEN_HOME)/Eigen $(SDK).part/include/eigen3
	@cp LICENSE NOTICE $(SDK).part
	@$(if $(EIGEN_TERMS),cp $(EIGEN_TERMS) $(SDK).part/include/eigen3/COPYRIGHT)
	@$(if $(BARE),cp --parents $(SDK_BOARD) $(SDK).part && cp -R platform/example $(SDK).part/example,rm -r $(SDK).part/platform)
	@$(if $(BARE_BOARD),cp $(BARE_BOARD) $(SDK).part/platform/$(TARGET)/boot.elf)
	@rm -rf $(SDK) && mv $(SDK).part $(SDK) && echo 'sdk: $(SDK)'

# As a stranger would: the example, copied away, knows the SDK alone. What doc/guide/integration.md promises of it must hold.
GUIDE    := doc/guide/integration.md
MY_ROVER := $(B)/my_rover
try-sdk: ## the integration guide's example on emulated boards, and the guide's figures (TARGET=..., default all of them)
ifdef BARE
	@$(MAKE) --no-print-directory deps-test
	@$(MAKE) --no-print-directory sdk
	@rm -rf $(MY_ROVER) && cp -R $(SDK)/example $(MY_ROVER) && printf 'The integration example on an emulated %s\n' '$(TARGET)'
	@$(MAKE) --no-print-directory -s -C $(MY_ROVER) SDK=$(SDK)
	@timeout 600 $(MAKE) --no-print-directory -s -C $(MY_ROVER) SDK=$(SDK) run >$(MY_ROVER)/run.log || { cat $(MY_ROVER)/run.log; exit 1; }
	@cat $(MY_ROVER)/run.log
	@$(CHECK)/integration.py $(TOOLS) --target $(TARGET) --needs '$(FLIGHT_NEEDS)' --size $(SIZE) $(GUIDE) $(FSW_LIB) $(MY_ROVER)
else
	@faults=0; for t in $(filter-out host,$(TARGETS)); do $(MAKE) --no-print-directory TARGET=$$t try-sdk || faults=1; done; exit $$faults
endif
.PHONY: replay FORCE

clean: ## remove build/
	rm -rf build

test: ## build and run all tests, plain and then with the sanitizers; on other targets than host, under emulation
	@$(MAKE) --no-print-directory deps-test
	@faults=0; run() { printf 'Tests, %s\n' "$$1"; shift; $(MAKE) --no-print-directory run-tests "$$@" || faults=1; }; \
	run '$(if $(BARE),on an emulated $(TARGET),plain)' SAN=; \
	$(if $(BARE),, \
	for m in $(filter-out $(MISSION),$(DATA_MISSIONS)); do \
	  run "data of mission $$m" SAN= MISSION=$$m TEST_SRC=$(DATA_TEST) TOOL_SRC='$(DATA_TOOLS)'; done; \
	run 'with the address and undefined-behaviour sanitizers' SAN=1;) \
	$(if $(BARE),$(MAKE) --no-print-directory try-sdk || faults=1;) \
	exit $$faults

same-bits: ## the sample drive on all targets: the same telemetry to the bit (a part of `make test` of each)
	@faults=0; for t in $(TARGETS); do \
	  $(MAKE) --no-print-directory TARGET=$$t deps-test; \
	  printf 'The sample drive on %s\n' "$$t"; \
	  $(MAKE) --no-print-directory TARGET=$$t run-tests TEST_SRC='unit_tests/replay/test_replay.cpp unit_tests/core/test_square_root.cpp' || faults=1; \
	done; exit $$faults

replay: ## play a tape on the target (TAPE=file, default the sample): sums of the telemetry
	@$(MAKE) --no-print-directory deps-test
	@$(MAKE) --no-print-directory -s -j$(JOBS) $(B)/replay.elf
	@$(call run_image,$(B)/replay.elf)

check: ## proofs of the flight library (symbols, stack, instructions, memory); floors, traceability, names, layout, formatting, static analysis
	@$(MAKE) --no-print-directory deps-check
	@$(MAKE) --no-print-directory -k -j$(JOBS) $(CHECKS)

fmt: ## format all C++ (clang-format)
	clang-format -i $(CXX_FILES)

deps-build: ## install what building asks for and is missing (apt)
	$(call install,$(DEPS_BUILD))
deps-test: ## the same for the tests
	$(call install,$(DEPS_BUILD) $(if $(BARE),$(DEPS_TARGET) xz-utils,$(DEPS_TEST)))
deps-check: ## the same for the checks
	$(call install,$(DEPS_BUILD) $(DEPS_CHECK) $(DEPS_TARGET))

# ---- rules ---------------------------------------------------------------------------------------------------------
$(B)/fsw/%.o: fsw/%.cpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(FLIGHT) -c $< -o $@
$(B)/platform/$(TARGET)/flight/%.o: platform/$(TARGET)/flight/%.cpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(FLIGHT) -c $< -o $@
$(B)/platform/%.o: platform/%.cpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(GROUND) $(if $(BARE),-fno-exceptions -fno-rtti -fno-threadsafe-statics -fdata-sections) -c $< -o $@
$(B)/platform/%.o: platform/%.c
	@mkdir -p $(@D)
	$(call say,CC,$<)
	$(Q)$(CC) $(BARE_FLAGS) -c $< -o $@
$(B)/platform/%.o: platform/%.S
	@mkdir -p $(@D)
	$(call say,AS,$<)
	$(Q)$(CC) $(CPU) -c $< -o $@
# Made on the host, for every target; TAPE=file takes another drive.
SAMPLE_TAPE := build/sample.tape
TAPE        ?= $(SAMPLE_TAPE)
$(B)/platform/tape/tape_image.o: platform/tape/tape_image.S $(TAPE) $(B)/tape.name
	@mkdir -p $(@D)
	$(Q)$(CC) $(CPU) -DCAIRN_TAPE='"$(TAPE)"' -c $< -o $@
$(B)/tape.name: FORCE
	@mkdir -p $(@D)
	@echo '$(TAPE)' | cmp -s - $@ || echo '$(TAPE)' >$@
$(SAMPLE_TAPE): $(wildcard $(SAMPLE)/*.txt $(SAMPLE)/*.csv) | $(if $(BARE),host-cairn,$(CAIRN))
	@build/host/cairn map build --from-csv $(SAMPLE)/truth_rocks.csv -o build/sample.cmap
	@build/host/cairn tape --dataset $(SAMPLE) --map build/sample.cmap --frames 0:$(TAPE_FRAMES) -o $@
TAPE_FRAMES := 35
host-cairn:
	@$(MAKE) --no-print-directory TARGET=host MISSION=paper SAN= build/host/cairn
$(B)/ground_tools/%.o: ground_tools/%.cpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(GROUND) -isystem /usr/include/gdal -c $< -o $@
# Loops over pixels, for vectors: -O2 of GCC 12 makes none of them.
$(addprefix $(B)/ground_tools/,detect/row_kernels.o ortho/raster_source.o ortho/grey_range.o): GROUND += $(if $(SAN),,-O3)
$(B)/unit_tests/opencv/%.o: unit_tests/opencv/%.cpp
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(TESTING) $(OPENCV_INC) -isystem /usr/include/gdal -c $< -o $@
$(B)/unit_tests/%.o: unit_tests/%.cpp | $(BARE_HEADERS)
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CPU) $(TESTING) -isystem /usr/include/gdal -c $< -o $@

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
$(FSW_LIB): $(call obj,$(FSW_SRC))
	$(archive)
$(PLATFORM_LIB): $(call obj,$(PLATFORM_SRC))
	$(archive)
$(TOOL_LIB): $(call obj,$(TOOL_SRC))
	$(archive)
$(SUPPORT_LIB): $(call obj,$(SUPPORT_SRC))
	$(archive)
$(TAPE_LIB): $(call obj,$(TAPE_SRC))
	$(archive)

LIBS_ALL = $(TOOL_LIB) $(SUPPORT_LIB) $(PLATFORM_LIB) $(FSW_LIB)
link = $(Q)$(LINKER) $(filter %.o,$^) -Wl,--start-group $(filter %.a,$^) $(RUNTIME) -Wl,--end-group
$(CAIRN): $(call obj,$(TOOL_MAIN)) $(TOOL_LIB) $(PLATFORM_LIB) $(FSW_LIB)
	$(link) $(TOOL_LIBS) -lfmt -o $@
# The OpenCV oracles and the integration tests see the ground tools; unit tests see flight code, support and fakes alone.
$(B)/tests/opencv/%: $(B)/unit_tests/opencv/%.o $(LIBS_ALL)
	@mkdir -p $(@D)
	$(link) -lcmocka $(OPENCV_LIBS) $(TOOL_LIBS) -lfmt -o $@
$(B)/tests/ground_tools/%: $(B)/unit_tests/ground_tools/%.o $(LIBS_ALL)
	@mkdir -p $(@D)
	$(link) -lcmocka $(TOOL_LIBS) -lfmt -o $@
$(B)/bench_map: $(B)/unit_tests/opencv/bench_map.o $(FSW_LIB) $(PLATFORM_LIB)
	$(link) -lopencv_imgproc -lopencv_core -lgdal -lfmt -o $@
$(B)/sift_vo: $(B)/unit_tests/opencv/sift_vo.o $(TOOL_LIB) $(PLATFORM_LIB) $(FSW_LIB)
	$(link) $(OPENCV_LIBS) $(TOOL_LIBS) -lfmt -o $@
# The model is tested without QEMU, and the plugin with it.
$(B)/tests/ground_tools/profile/test_profile_model: $(filter-out %/plugin.o,$(call obj,$(wildcard ground_tools/profile/plugin/*.cpp)))
$(B)/tests/ground_tools/profile/test_profile_plugin: $(PROFILER)
# These run the program.
$(filter $(B)/tests/ground_tools/commands/%,$(TESTS)): $(CAIRN)
$(addprefix $(B)/tests/ground_tools/,forecast/test_map_forecast profile/test_profile report/test_report): $(CAIRN)
$(B)/codec_table: $(B)/unit_tests/ground_tools/cmap/codec_table.o $(TOOL_LIB) $(PLATFORM_LIB) $(FSW_LIB)
	$(link) $(TOOL_LIBS) -lfmt -o $@
$(B)/tests/integration/%: $(B)/unit_tests/integration/%.o $(LIBS_ALL)
	@mkdir -p $(@D)
	$(link) -lcmocka $(TOOL_LIBS) -lfmt -o $@
$(B)/tests/replay/%: $(B)/unit_tests/replay/%.o $(B)/platform/tape/tape_image.o $(SUPPORT_LIB) $(TAPE_LIB) $(FSW_LIB) $(BARE_NEEDS)
	@mkdir -p $(@D)
	$(link) $(CMOCKA_LIB) -o $@
$(B)/tests/%: $(B)/unit_tests/%.o $(SUPPORT_LIB) $(FSW_LIB) $(BARE_NEEDS)
	@mkdir -p $(@D)
	$(link) $(CMOCKA_LIB) -o $@
$(B)/replay.elf: $(call obj,platform/tape/replay.cpp platform/tape/tape_image.S) $(TAPE_LIB) $(FSW_LIB) $(PLATFORM_LIB) $(BARE_NEEDS)
	$(link) -o $@

# The same way a map comes into an image.
MAP ?= build/decode.cmap
build/decode.cmap:
	@$(MAKE) --no-print-directory -s TARGET=host MISSION=paper SAN= build/host/codec_table
	@build/host/codec_table --map $@
$(B)/decode_map.o: platform/tape/tape_image.S $(MAP)
	@mkdir -p $(@D)
	$(Q)$(CC) $(CPU) -DCAIRN_TAPE='"$(MAP)"' -c $< -o $@
$(B)/decode.elf: $(B)/platform/tape/decode.o $(B)/decode_map.o $(FSW_LIB) $(PLATFORM_LIB) $(NEWLIB)/.done
	$(link) -o $@

# ---- the paper's evaluation ----------------------------------------------------------------------------------------
# Each file below is whole or absent, so that make knows what is left to do.
PAPER        := build/paper
SEEDS        ?= 1
# Orthoimages: those of the paper's Table I, then coarser ones, as named by cairn sim.
PAPER_MAPS   := 5mm 6.67mm 10mm 20mm 50mm 100mm 250mm
PAPER_PIXELS := 0.005,0.00666666666667,0.01,0.02,0.05,0.1,0.25
PAPER_RUNS   := $(foreach map,rocks $(PAPER_MAPS),as_it_is/$(map) degraded/$(map))
# Ends 2.5 m off after the 100 m, as the paper's VO does.
PAPER_DRIFT  := scale=1.02,yaw=0.038deg/m

$(PAPER)/%/data/.rendered:
	@mkdir -p $(@D)
	@$(CAIRN) sim mission_cfg/scenes/paper.toml --set seed=$* -o $(@D) --ortho $(PAPER_PIXELS)
	@touch $@
define paper_rules
$(PAPER)/$(1)/%.cmap: $(PAPER)/$(1)/data/.rendered
	@$$(CAIRN) map build $$(<D)/ortho_$$*.tif --method otsu -o $$@
$(PAPER)/$(1)/rocks.cmap: $(PAPER)/$(1)/data/.rendered
	@$$(CAIRN) map build --from-csv $$(<D)/truth_rocks.csv -o $$@
$(PAPER)/$(1)/as_it_is/%/summary.json: $(PAPER)/$(1)/%.cmap
	@mkdir -p $$(@D)
	@$$(CAIRN) run --dataset $$(<D)/data --map $$< --ortho $$(<D)/data/ortho_20mm.tif -o $$(@D) >$$(@D)/log
	@printf 'drive %s over %s\n' '$(1)' '$$*'
$(PAPER)/$(1)/degraded/%/summary.json: $(PAPER)/$(1)/%.cmap
	@mkdir -p $$(@D)
	@$$(CAIRN) run --dataset $$(<D)/data --map $$< --ortho $$(<D)/data/ortho_20mm.tif --degrade $(PAPER_DRIFT) -o $$(@D) >$$(@D)/log
	@printf 'drive %s over %s, VO made worse\n' '$(1)' '$$*'
endef
$(foreach seed,$(SEEDS),$(eval $(call paper_rules,$(seed))))

# ---- fuzzing: flight code by clang, with libFuzzer and the sanitizers, whatever TARGET is ---------------------------
FUZZ_CXX     := clang++
FUZZ_FLAGS   := -std=c++17 -O1 -g1 -ffp-contract=off -MMD -MP -Wall -Wextra -Werror -Ifsw -Imission_cfg -Imission_cfg/paper -I. \
                $(EIGEN) -Iunit_tests -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all
FUZZ_SRC     := $(sort $(wildcard fsw/orbital_map/*.cpp fsw/core/*.cpp)) $(addprefix fsw/app/,packet.cpp telecommand.cpp telemetry.cpp) \
                platform/host/assert_handler.cpp
FUZZERS      := $(patsubst unit_tests/fuzz/%.cpp,build/fuzz/%,$(sort $(wildcard unit_tests/fuzz/fuzz_*.cpp)))
RUNS         ?= 10000000
FUZZ_SHORT   := 50000
build/fuzz/obj/%.o: %.cpp
	@mkdir -p $(@D)
	$(call say,FUZZ,$<)
	$(Q)$(FUZZ_CXX) $(FUZZ_FLAGS) -c $< -o $@
$(FUZZERS): build/fuzz/%: build/fuzz/obj/unit_tests/fuzz/%.o $(patsubst %.cpp,build/fuzz/obj/%.o,$(FUZZ_SRC))
	$(Q)$(FUZZ_CXX) -fsanitize=fuzzer,address,undefined $^ -o $@
# Target, executions, parts that they are done in, folder for what is found. From the corpus of the repository on.
define run_fuzzer
mkdir -p $(4)/$(notdir $(1)); \
for part in $$(seq $(3)); do \
  nice env ASAN_OPTIONS=quarantine_size_mb=8:malloc_context_size=2 $(1) -runs=$$(($(2) / $(3))) -seed=$$part -max_len=1024 -timeout=30 -rss_limit_mb=1024 -artifact_prefix=$(4)/$(notdir $(1))- \
    $(4)/$(notdir $(1)) unit_tests/fuzz/corpus/$(notdir $(1)) >$(4)/$(notdir $(1)).log 2>&1 || \
  { tail -n 40 $(4)/$(notdir $(1)).log; echo 'fuzz: $(notdir $(1)) found a fault; the input is in $(4)'; exit 1; }; \
  printf '%s: %s executions\n' '$(notdir $(1))' $$(($(2) / $(3) * part)); \
done;
endef
check-fuzz: $(FUZZERS)
	@rm -rf build/fuzz/short; $(foreach f,$(FUZZERS),$(call run_fuzzer,$(f),$(FUZZ_SHORT),1,build/fuzz/short)) echo 'fuzz: no findings'

# ---- tests and checks ----------------------------------------------------------------------------------------------
JOBS ?= $(shell nproc)
# All are built and run even where one fails; then the goal fails. A test that passes shows its sums and what it skipped.
run-tests:
	@built=0; $(MAKE) --no-print-directory -k -j$(JOBS) $(TESTS) || built=1; failed=; \
	for t in $(TESTS); do \
	  name=$${t#$(B)/tests/}; \
	  if timeout 900 $(call run_image,$$t) >$$t.log 2>&1; then \
	    printf '%s\n' "$$name"; grep -aE '^(skipped: |\[==========\] .* run\.|\[  (PASSED|SKIPPED) )' $$t.log; \
	  else cat $$t.log; failed="$$failed $$name"; fi; \
	done; \
	t=$(B)/tests/failing/fails; $(MAKE) --no-print-directory $$t || built=1; \
	if timeout 900 $(call run_image,$$t) >$$t.log 2>&1 || ! grep -qaE '2 test\(s\) run' $$t.log; then failed="$$failed failing/fails"; \
	else echo 'a test that fails: seen to fail'; fi; \
	[ -z "$$failed" ] || printf '  FAILED:%s\n' "$$failed"; [ $$built = 0 ] && [ -z "$$failed" ]

CXX_FILES    = $(shell git ls-files '*.cpp' '*.hpp' 2>/dev/null || find $(FOLDERS) -name '*.[ch]pp')
FOLDERS     := $(wildcard fsw hal platform ground_tools unit_tests mission_cfg)
CHECK        = python3 -B ground_tools/checks
# What is proved of each target's library, and what of the text, once.
PROOFS      := symbols stack isa memory
OF_TEXT     := floors trace names layout prose
SELF_TESTS  := $(addprefix check-self-,$(PROOFS) $(if $(BARE),,$(OF_TEXT) integration))
CHECKS      := $(SELF_TESTS) $(addprefix check-,$(PROOFS)) $(if $(BARE),,$(addprefix check-,$(OF_TEXT) format cppcheck tidy fuzz))
TOOLS        = --nm $(NM) --ar $(AR) --readelf $(READELF) --objdump $(OBJDUMP) --cxx '$(CXX) $(CPU) $(FLIGHT)'
# An image is proved with the library where there is one that is not older.
IMAGE        = $(if $(BARE),$(shell [ $(B)/replay.elf -nt $(FSW_LIB) ] && echo $(B)/replay.elf))
TIDY         = $(patsubst %.cpp,$(B)/tidy/%.ok,$(FSW_SRC))
DEFINES      = $(filter -D% -I%,$(INC))

# Violations planted on purpose, compiled for the target, must be seen.
$(SELF_TESTS): check-self-%:
	@$(CHECK)/$*.py $(if $(filter $*,$(PROOFS)),$(TOOLS)) $(SELF_$*) --self-test
SELF_isa     = --machine '$(ELF_MACHINE)'
SELF_memory  = --link '$(CXX) $(CPU)'
check-floors:
	@$(CHECK)/floors.py
check-symbols: $(FSW_LIB)
	@$(CHECK)/symbols.py $(TOOLS) --needs '$(FLIGHT_NEEDS)' $(FSW_LIB)
check-stack: $(FSW_LIB) $(B)/figures.o
	@$(CHECK)/stack.py $(TOOLS) --figures $(B)/figures.o $(patsubst %.cpp,$(B)/%.ci,$(FSW_SRC))
check-isa: $(FSW_LIB)
	@$(CHECK)/isa.py $(TOOLS) --machine '$(ELF_MACHINE)' $(FSW_LIB) $(IMAGE)
check-memory: $(B)/libcairn.map $(B)/figures.o
	@$(CHECK)/memory.py $(TOOLS) --figures $(B)/figures.o $(addprefix --image ,$(addsuffix .map,$(IMAGE))) $< $(FSW_SRC)
# The linker's account of the whole library; nothing runs.
$(B)/libcairn.map: $(FSW_LIB)
	$(Q)$(CXX) $(CPU) -nostdlib -r -Wl,--strip-debug,--whole-archive $< -Wl,-Map=$@ -o $(B)/libcairn.o
$(B)/figures.o: ground_tools/checks/figures.cpp
	@mkdir -p $(@D)
	$(Q)$(CXX) $(CPU) $(COMMON) -c $< -o $@
check-trace:
	@$(CHECK)/trace.py
check-names:
	@$(CHECK)/names.py
check-layout:
	@$(CHECK)/layout.py
check-format:
	@clang-format --dry-run -Werror $(CXX_FILES) && echo 'format: all files as clang-format has them'
# arrayIndexThenCheck takes a tie broken by index for a bound.
check-cppcheck:
	@cppcheck --quiet --std=c++17 --language=c++ --enable=warning,performance,portability --inline-suppr --suppress=arrayIndexThenCheck --error-exitcode=1 \
	  $(DEFINES) $(FSW_SRC) && echo 'cppcheck: no faults'
check-tidy: $(TIDY)
	@echo 'clang-tidy: no faults'
# One file at a time, and again only where it or a header has changed.
$(B)/tidy/%.ok: %.cpp .clang-tidy $(wildcard fsw/*/*.hpp hal/*.hpp mission_cfg/*.hpp mission_cfg/*/*.hpp)
	@mkdir -p $(@D)
	$(call say,TIDY,$<)
	$(Q)clang-tidy --quiet $< -- -std=c++17 $(INC) 2>$@.log || { cat $@.log; exit 1; }
	@touch $@

-include $(shell find $(B) build/fuzz -name '*.d' 2>/dev/null)
.PHONY: host-cairn help all lib clean demo paper campaign realism bench bench-codec bench-map profile size test same-bits run-tests check $(CHECKS) fmt deps-build deps-test deps-check sdk try-sdk fuzz bench-decode
.SECONDARY:
.DELETE_ON_ERROR:
