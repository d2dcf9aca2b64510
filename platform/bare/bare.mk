# What bare targets share: newlib and CMocka, built once from Debian's source packages into the target's build
# folder, and how an image is linked and run. The target's toolchain.mk says the rest.
CC      := $(TRIPLE)gcc
CXX     := $(TRIPLE)g++
AR      := $(TRIPLE)ar
NM      := $(TRIPLE)nm
READELF := $(TRIPLE)readelf
OBJDUMP := $(TRIPLE)objdump
SIZE    := $(TRIPLE)size
OPT     := -O2
BARE    := 1
# What runs once, once a command or a packet, or hands work on, is kept small.
SELDOM  := $(addprefix app/,command_content command_order flight_app packet root telecommand telemetry) \
           localizer/localizer $(addprefix orbital_map/,height_decoder map_delta map_reader map_transfer)
$(SELDOM:%=$(B)/fsw/%.o): FLIGHT += -Os
# What works on pixels takes most of the time.
BUSY    := features/% image/% segmentation/%
$(BUSY:%=$(B)/fsw/%.o): FLIGHT += -O3

# These cost minutes and do not depend on the mission, so that all builds of a target share them.
NEWLIB     := build/newlib-$(TARGET)
NEWLIB_LIB := $(NEWLIB)/$(NEWLIB_TARGET)/lib
CMOCKA     := build/cmocka-$(TARGET)/cmocka.o
LINKER      = $(CC) $(CPU) -nostdlib -static -no-pie -Wl,-T,platform/$(TARGET)/link.ld \
              -Wl,--gc-sections,--build-id=none,--no-warn-rwx-segments,-z,noexecstack,-Map=$@.map
# The platform once more before libgcc: what it has instead of libgcc's own comes first.
RUNTIME     = $(NEWLIB_LIB)/libc.a $(NEWLIB_LIB)/libm.a $(PLATFORM_LIB) -lgcc
# What a test needs beside the libraries of the project.
BARE_NEEDS  = $(PLATFORM_LIB) $(CMOCKA) $(NEWLIB)/.done $(BARE_BOARD)
BARE_HEADERS := build/cmocka-src/.done
BARE_DEFS   = -DCAIRN_NO_FILES
BARE_FLAGS  = $(CPU) -g -O2 -ffreestanding -fno-tree-loop-distribute-patterns -ffunction-sections -fdata-sections \
              -MMD -MP -Wall -Wextra -Werror

NEWLIB_CC = $(CC) $(NEWLIB_CPU) $(LONG_DOUBLE) -ffreestanding -U__linux__ -U__gnu_linux__ -U__unix__ -Ulinux -Uunix \
            -fno-pic -fno-stack-protector
$(NEWLIB)/.done:
	@printf '  NEWLIB   %s (a minute or two)\n' '$(TARGET)'
	@rm -rf $(@D) && mkdir -p $(@D)/src $(@D)/obj
	@tar -C $(@D)/src --strip-components=1 -xf $$(ls /usr/src/newlib/newlib-*.tar.*)
	$(Q)cd $(@D)/obj && { ../src/configure --target=$(NEWLIB_TARGET) --prefix=$(abspath $(@D)) \
	  --disable-multilib --disable-nls --disable-newlib-supplied-syscalls \
	  --enable-newlib-io-c99-formats --enable-newlib-io-long-long \
	  CC_FOR_TARGET='$(NEWLIB_CC)' AS_FOR_TARGET=$(TRIPLE)as AR_FOR_TARGET=$(AR) \
	  RANLIB_FOR_TARGET=$(TRIPLE)ranlib NM_FOR_TARGET=$(NM) \
	  CFLAGS_FOR_TARGET='-O2 -ffunction-sections -fdata-sections -ffp-contract=off $(NEWLIB_DEFS)' && \
	  MAKEFLAGS= $(MAKE) -j$(JOBS) all-target-newlib && \
	  MAKEFLAGS= $(MAKE) install-target-newlib; } >../build.log 2>&1 || { tail -n 20 ../build.log; exit 1; }
	@rm -rf $(@D)/src $(@D)/obj && touch $@

# The source package through a private list, from the mirror that the machine uses; its own lists stay as they are.
APT_PRIVATE = apt-get -qq -o Dir::Etc::sourcelist=$$PWD/apt/list -o Dir::Etc::sourceparts=- \
              -o Dir::State::lists=$$PWD/apt/lists -o APT::Sandbox::User=root
build/cmocka-src/.done:
	@printf '  SOURCE   cmocka\n'
	@rm -rf $(@D) && mkdir -p $(@D)/apt/lists/partial
	@apt-get indextargets --format \
	  'deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $$(REPO_URI) $$(RELEASE) main' \
	  'Created-By: Packages' 'Component: main' 'Origin: Debian' | \
	  grep -E ' bookworm main$$' | head -n 1 >$(@D)/apt/list
	$(Q)cd $(@D) && { $(APT_PRIVATE) update && $(APT_PRIVATE) source --download-only cmocka; } \
	  >apt/log 2>&1 || { cat apt/log; exit 1; }
	@cd $(@D) && mkdir src && \
	  tar -C src --strip-components=1 -xf $$(ls cmocka_*.orig.tar.* | grep -v asc) && touch .done

CMOCKA_DEFS := -include stdint.h -D_UINTPTR_T -include signal.h -include malloc.h \
               -DHAVE_INTTYPES_H -DHAVE_STRINGS_H -DHAVE_MALLOC_H \
               -U__linux__ -U__unix__ -U__gnu_linux__ $(LONG_DOUBLE)
$(CMOCKA): build/cmocka-src/.done $(NEWLIB)/.done
	@mkdir -p $(@D)
	$(call say,CC,cmocka.c)
	$(Q)$(CC) $(CPU) -O2 -g $(CMOCKA_DEFS) -isystem $(NEWLIB)/$(NEWLIB_TARGET)/include \
	  -Ibuild/cmocka-src/src/include \
	  -c build/cmocka-src/src/src/cmocka.c -o $@
BARE_DEFS  += -isystem build/cmocka-src/src/include
