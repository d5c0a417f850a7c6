# Assay. `make validate` and `make check` are the two commands; `make help` lists the rest.
# Everything is built below $(BUILD); only `make golden` and the studies write beside the sources.
# This file builds the programs and runs the suite; tools/packaging/packaging.mk installs and packs them, tests/tests.mk
# and the files that it includes test, measure and lint them. Lines that begin with "#: " are `make help`.

BUILD  ?= build
# One name for one folder: what a script builds by its absolute path has the same dependencies.
override BUILD := $(patsubst $(CURDIR)/%,%,$(BUILD))
LIVE   ?=
ONLY   ?=
ALPHA  ?= 1e-3
V      ?=
MAKEFLAGS += --jobs=$(shell nproc)

# Debian packages: to build and validate, to render the references.
DEPS      := gcc g++ make pkg-config libxml2-dev libopenexr-dev libpng-dev libopenimageio-dev libjansson-dev libgsl-dev \
  nettle-dev zlib1g-dev libdeflate-dev bubblewrap unzip
DEPS_LIVE := blender povray python3-numpy

VERSION := 0.1
COMMIT  := $(shell git rev-parse --short=12 HEAD 2>/dev/null || echo unknown)
PKGS    := libxml-2.0 OpenEXR libpng jansson gsl nettle zlib libdeflate

# Expanded when the first recipe runs, so that pkg-config is asked after the packages are there, and once.
pkg_cflags = $(eval pkg_cflags := $$(shell pkg-config --cflags $$(PKGS) | sed 's/-I/-isystem /g'))$(pkg_cflags)
# --as-needed: pathtracer starts at once, without the libraries that only the harness uses.
LIBS       = -Wl,--as-needed $(shell pkg-config --libs $(PKGS)) -lm -pthread

OPT      := -O3 -g -fno-math-errno -fno-trapping-math
WARN      = -Wall -Wextra $(if $(WERROR),-Werror)
WARN_C    = $(WARN) -Wshadow -Wstrict-prototypes -Wswitch-enum -Wvla
# -ffp-contract=off: the same bits whether or not a processor can multiply and add in one step.
# defs: what single objects need; CFLAGS, CXXFLAGS and LDFLAGS are the user's.
cflags    = -std=c17 $(OPT) -ffp-contract=off $(WARN_C) -D_XOPEN_SOURCE=700 -pthread $(CFLAGS) $(defs) -I. $(pkg_cflags)
# OpenImageIO is in oiio.so alone (renderer/image/image_oiio.h).
cxxflags  = -std=c++17 -fPIC $(OPT) $(WARN) $(CXXFLAGS) -I. $(shell pkg-config --cflags OpenImageIO | sed 's/-I/-isystem /g')

# Kernels, compiled once for each instruction set (renderer/base/isa.h), e.g. as renderer/bvh/traverse_avx2.c.o.
# ONE_LANE: also for one lane; SIXTEEN: with sixteen lanes under AVX-512, while the others have eight in any set.
ISAS     := sse42 avx2 avx512
BY_ISA   := $(addprefix renderer/,bvh/traverse bvh/small_scene_trace bvh/sah_split transport/integrator_simd)
ONE_LANE := renderer/transport/integrator_simd
SIXTEEN  := $(addprefix renderer/,bvh/traverse bvh/small_scene_trace transport/integrator_simd)
isas_of   = $(ISAS) $(if $(filter $(ONE_LANE),$(1)),scalar)
KERNELS  := $(foreach k,$(BY_ISA),$(patsubst %,$(k)_%.c,$(call isas_of,$(k))))
MAINS    := renderer/pathtracer/pathtracer.c tools/commands/assay.c
SOURCES  := $(filter-out $(MAINS) $(BY_ISA:=.c),$(wildcard renderer/*/*.c reference/*/*.c tools/*/*.c))
HEADERS  := $(wildcard renderer/*/*.h reference/*/*.h tools/*/*.h)
obj       = $(patsubst %,$(1)/%.o,$(2))

Q  := $(if $(V),,@)
say = $(if $(V),,@printf '  %-5s %s\n' $(1) $(2))

#: make            build pathtracer and assay
all: $(BUILD)/pathtracer $(BUILD)/assay $(BUILD)/oiio.so

#: make validate   judge the suite against the stored references; LIVE=1: render them now;
#:                 ONLY="SCENE ...": some scenes; ALPHA=1e-3: chance of any wrong verdict
validate: all $(if $(LIVE),$(BUILD)/deps-live)
	$(BUILD)/assay validate --out $(BUILD)/report --alpha $(ALPHA) \
	  $(if $(LIVE),--live) $(addprefix --only ,$(ONLY))

#: make golden     render what is missing or out of date in golden/, approve what is new or
#:                 EQUIVALENT, list what differs (ONLY="SCENE ...": of some scenes)
golden: all $(BUILD)/deps-live
	$(BUILD)/assay golden render --golden golden --out $(BUILD)/golden-candidate --work $(BUILD)/work \
	  $(addprefix --only ,$(ONLY))
	$(BUILD)/assay golden render --noise --golden golden --out $(BUILD)/golden-candidate --work $(BUILD)/work \
	  $(addprefix --only ,$(ONLY))
	$(BUILD)/assay golden approve --all --new --golden golden --from $(BUILD)/golden-candidate $(ONLY)

#: make results    tools/RESULTS.md from the last validation (and assay converge -o BUILD/converge)
results: all
	tools/results.sh $(BUILD) >$(BUILD)/RESULTS.md && cp $(BUILD)/RESULTS.md tools/RESULTS.md

#: make report     make the page of the last validation again
report: all
	$(BUILD)/assay report $(BUILD)/report/results.json

#: make deps       install the Debian packages that building needs
deps: $(BUILD)/deps
deps-live: $(BUILD)/deps-live

format:
	clang-format -i $(wildcard renderer/*/*.[ch] reference/*/*.[ch] tools/*/*.[ch] tests/*/*.[ch] tests/*/*/*.[ch])

clean:
	rm -rf $(BUILD)

help:
	@sed -n 's/^#: //p' Makefile tools/packaging/packaging.mk $(wildcard tests/tests.mk tests/*/*.mk)

define compile_c
	$(call say,CC,$@)
	$(Q)mkdir -p $(@D) && $(CC) $(cflags) -MMD -MP -c -o $@ $<
endef
define compile_cxx
	$(call say,CXX,$@)
	$(Q)mkdir -p $(@D) && $(CXX) $(cxxflags) -MMD -MP -c -o $@ $<
endef
define link
	$(call say,LINK,$@)
	$(Q)mkdir -p $(@D) && $(CXX) $(OPT) -o $@ $(filter %.o,$^) $(filter %.a,$^) $(LDFLAGS) $(LIBS) $(TEST_LIBS)
endef
define archive
	$(call say,AR,$@)
	$(Q)rm -f $@ && ar rcs $@ $^
endef

isa_sse42  := -msse4.2
isa_avx2   := -mavx2 -mfma -mbmi -mbmi2 -mpopcnt -mlzcnt
isa_avx512 := $(isa_avx2) -mavx512f -mavx512vl -mavx512bw -mavx512dq
# -Wno-psabi: no vector of 32 or 64 bytes is passed between files. -g1: clang 14 crashes on -g with sixteen lanes.
isa_lanes   = $(if $(and $(filter avx512,$(1)),$(filter $(SIXTEEN),$(2))),16,8)
isa_flags   = -DISA=$(1) $(if $(isa_$(1)),-DLANES=$(isa_lanes)) $(isa_$(1)) -Wno-psabi -g1
define kernel_object
$(1)/$(2)_$(3).c.o: defs += $(call isa_flags,$(3),$(2))
$(1)/$(2)_$(3).c.o: $(2).c | $(4)
	$$(compile_c)
endef

# A whole build below DIRECTORY, with the compiler and flags that are set for it: $(call
# tree,DIRECTORY,PACKAGES,KERNELS), KERNELS: the kernels' objects, if others than its own.
define tree
$(1)/%.c.o: %.c | $(2)
	$$(compile_c)
$(1)/%.cc.o: %.cc | $(2)
	$$(compile_cxx)
$(foreach k,$(BY_ISA),$(foreach i,$(call isas_of,$(k)),$(eval $(call kernel_object,$(1),$(k),$(i),$(2)))))
$(1)/libassay.a: $(call obj,$(1),$(SOURCES)) $(or $(3),$(call obj,$(1),$(KERNELS)))
	$$(archive)
$(1)/pathtracer: $(1)/renderer/pathtracer/pathtracer.c.o $(1)/libassay.a
	$$(link)
$(1)/assay: $(1)/tools/commands/assay.c.o $(1)/libassay.a
	$$(link)
$(1)/oiio.so: $(1)/renderer/image/oiio.cc.o
	$$(call say,LINK,$$@)
	$$(Q)$$(CXX) $$(OPT) $$(LDFLAGS) -shared -o $$@ $$< $$(shell pkg-config --libs OpenImageIO)
# What the compiler's dependency files cannot know: the page's parts are read by the assembler, and
# only version.c knows the commit.
$(1)/tools/html/page_assets.c.o: $(wildcard tools/html/page*.css tools/html/page*.js)
$(1)/renderer/base/version.c.o: $(BUILD)/commit
$(1)/renderer/base/version.c.o: defs += -DASSAY_VERSION='"$(VERSION)"' -DASSAY_COMMIT='"$(COMMIT)"'
endef
$(eval $(call tree,$(BUILD),$(BUILD)/deps))

$(BUILD)/commit: FORCE
	$(Q)mkdir -p $(@D) && echo $(VERSION) $(COMMIT) | cmp -s - $@ || echo $(VERSION) $(COMMIT) > $@
FORCE:

# Asks dpkg what is missing and apt for just that, as root or through sudo. Without dpkg the packages are taken to be
# installed, under whatever names. Waits up to ten minutes for other installations: apt's own DPkg::Lock::Timeout does
# not cover the lock of its lists.
define install_missing
	$(Q)mkdir -p $(@D); \
	if command -v dpkg-query >/dev/null; then \
	  missing=; \
	  for p in $(1); do \
	    dpkg-query -W -f '$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || missing="$$missing $$p"; \
	  done; \
	  if [ -n "$$missing" ]; then \
	    echo "installing:$$missing"; \
	    [ "$$(id -u)" = 0 ] && sudo= || sudo=sudo; \
	    tries=200; \
	    for step in update "install -y --no-install-recommends $$missing"; do \
	      until $$sudo env DEBIAN_FRONTEND=noninteractive apt-get -qq $$step >$@.log 2>&1; do \
	        tries=$$((tries - 1)); \
	        grep -q 'Could not get lock' $@.log && [ $$tries -gt 0 ] \
	          || { tail -n 5 $@.log; echo "cannot install:$$missing" >&2; exit 1; }; \
	        [ $$tries -lt 199 ] || echo "waiting: $$(grep -m 1 'Could not get lock' $@.log)"; \
	        sleep 3; \
	      done; \
	    done; \
	  fi; \
	fi; touch $@
endef
$(BUILD)/deps:
	$(call install_missing,$(DEPS))
$(BUILD)/deps-live: | $(BUILD)/deps
	$(call install_missing,$(DEPS_LIVE))

include tools/packaging/packaging.mk
# Missing in the autograder's zip (tools/autograder/pack.sh), which has no tests.
-include tests/tests.mk

.PHONY: all validate golden results report deps deps-live format clean help FORCE
.SECONDARY:
.DELETE_ON_ERROR:
# The print-* targets do without dependency files, which take a second to read.
ifneq ($(filter-out print-%,$(or $(MAKECMDGOALS),all)),)
-include $(shell find $(BUILD) -name '*.d' 2>/dev/null)
endif
