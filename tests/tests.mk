# The tests: `make check` and what it runs, also in other builds. The rest is in lint/lint.mk, mutants/mutants.mk,
# studies/studies.mk.

SECONDS_EACH ?= 60
DEPS_TEST := libcmocka-dev zip ccache clang libclang-rt-dev libxml2-utils libembree-dev patch cmake openimageio-tools chromium \
  $(DEPS_DEB) locales python3-numpy python3-jsonschema python3-pytest python3-venv python3-pip python3-setuptools python3-wheel \
  $(if $(shell command -v npm),,nodejs npm)
# Embree 4 if installed, else 3, as in embree_mesh.h; expanded late, when it has been installed.
LIB_EMBREE = -lembree$(if $(wildcard /usr/include/embree4/rtcore.h),4,3)
DEPS_LINT := clang-tidy cppcheck llvm
$(BUILD)/deps-test: | $(BUILD)/deps
	$(call install_missing,$(DEPS_TEST))
$(BUILD)/deps-lint: | $(BUILD)/deps-test
	$(call install_missing,$(DEPS_LINT))

# Sources of the tests, and of programs that measure or make what is stored. Names are unique in the tree, so that
# all programs stand side by side, in BUILD/tests and BUILD/san/tests.
TESTS    := $(wildcard tests/*/test_*.c tests/*/*/test_*.c)
PROGRAMS := $(wildcard tests/*/make_*.c tests/*/*/make_*.c) tests/mutants/diagnose_rates.c tests/mutants/machine/image_change.c \
  tests/end_to_end/student_tracer.c tests/studies/bench/bench.c
BENCH   := $(wildcard tests/studies/bench/bench*.c) tests/studies/bench/embree_tracer.c
# What several tests share, as a library from which each links what it needs.
SUPPORT := $(filter-out $(TESTS) $(PROGRAMS) $(BENCH) tests/support/asan_options.c, \
  $(wildcard tests/support/*.c tests/renderer/*/*.c tests/reference/*/*.c tests/tools/*/*.c tests/studies/*/*.c tests/mutants/bug_effect.c))
# Run without sanitizers: simulations of thousands of claims, and closed forms and other programs against millions of
# rays and samples. Other tests run the same code with them (test_widths every material, light and option, test_bvh_wide
# all of the tracing).
RATES   := $(addprefix test_,alpha_spending calibration compare_rates converge diagnose noise_estimate paired_rates permutation sign_flip statistics)
TRUTHS  := $(addprefix test_,embree independence integrator lights materials metamorphic povray_optics suite_scenes truth_lens \
  truth_mirrors_and_glass)
PLAIN   := $(RATES) $(TRUTHS)
program  = $(addprefix $(1)/tests/,$(basename $(notdir $(2))))
CHECKED  = $(filter-out $(addprefix %/,$(PLAIN)),$(call program,$(BUILD)/san,$(TESTS))) $(PLAIN:%=$(BUILD)/tests/%)

# -g1: a finding needs no more than file and line, and -g doubles the compile time of the kernels. Undefined behaviour
# is a SIGILL, which AddressSanitizer reports with its place: UBSan's words for it were five of the programs' seven
# megabytes of data, which were read for pointers when a program ended.
SANITIZE := -O1 -g1 -fno-omit-frame-pointer -fno-sanitize-recover=all -fsanitize-undefined-trap-on-error \
  -fsanitize=address,undefined
# private: otherwise objects that a build takes from another would get its flags.
# Builds: san with ASan and UBSan; clang for its warnings and for the fuzzers; on demand tsan with ThreadSanitizer and
# cov with clang's coverage counters.
$(BUILD)/san/%: private OPT := $(SANITIZE)
# A library that oiio.so loads may throw: AddressSanitizer has to find the C++ library at the start.
$(BUILD)/san/%: private LDFLAGS += -Wl,--no-as-needed -lstdc++
# Files in which tests spend most of their time are worth more optimisation.
BUSY := renderer/bvh/bvh tools/compare/hint tools/diagnose/bug_fit tools/diagnose/signature tools/exact/permutation tools/grade/difference tools/images/flip
$(BUSY:%=$(BUILD)/san/%.c.o): OPT = $(SANITIZE:-O1=-O2)
$(BUILD)/san/%: private WERROR := 1
$(BUILD)/tests/%: WERROR := 1
$(BUILD)/clang/%: private CC := clang
$(BUILD)/clang/%: private CXX := clang++
$(BUILD)/clang/%: private OPT := $(SANITIZE),fuzzer-no-link
$(BUILD)/clang/%: private WERROR := 1
$(BUILD)/tsan/%: private OPT := -O1 -g -fno-omit-frame-pointer -fsanitize=thread
$(BUILD)/cov/%: private CC := clang
$(BUILD)/cov/%: private CXX := clang++
$(BUILD)/cov/%: private OPT := -O2 -fprofile-instr-generate -fcoverage-mapping
$(BUILD)/cov/%: private WERROR := 1
# Code that no fuzzer runs is compiled without sanitizers, in a fifth of the time; a fuzzer that ran it would abort
# (tests/fuzz/fuzz.c).
UNFUZZED := $(addprefix renderer/,bvh shading transport pathtracer) reference/truth \
  $(patsubst %/,%,$(sort $(dir $(wildcard reference/*/export_*.h)))) \
  $(addprefix tools/,stats compare sequential plots report validate converge commands)
$(foreach d,$(UNFUZZED),$(eval $(BUILD)/clang/$(d)/%: OPT := -O0 -finstrument-functions))
# A rubric's options are read as our renderer reads them.
$(BUILD)/clang/renderer/pathtracer/options.c.o: OPT := $(SANITIZE),fuzzer-no-link
$(foreach b,tsan cov,$(eval $(call tree,$(BUILD)/$(b),$(BUILD)/deps-test)))
# Sanitizers see one lane, and eight or sixteen of the widest instructions here. SSE4.2 shares all but the operations on vectors with
# AVX2, and has the bits of one lane (test_widths).
UNSANITIZED := $(filter %_sse42.c $(if $(shell grep -s avx512vl /proc/cpuinfo),,%_avx512.c),$(KERNELS))
$(call obj,$(BUILD),$(UNSANITIZED)): private WERROR := 1
$(eval $(call tree,$(BUILD)/san,$(BUILD)/deps-test,$(call obj,$(BUILD),$(UNSANITIZED)) $(call obj,$(BUILD)/san,$(filter-out $(UNSANITIZED),$(KERNELS)))))
# Clang only checks the syntax of the kernels, in a twentieth of the time; the fuzzers are linked with gcc's kernels.
$(eval $(call tree,$(BUILD)/clang,$(BUILD)/deps-test,$(call obj,$(BUILD),$(KERNELS))))

# Linking a hundred programs took two CPU minutes; where binutils has gold, it takes a third of that.
TEST_LINKER := $(if $(shell command -v ld.gold),-fuse-ld=gold)
define test_program
$(call program,$(1),$(2)): $(1)/$(2).o
endef
define test_tree
$(1)/libtests.a: $(call obj,$(1),$(SUPPORT))
	$$(archive)
$(foreach t,$(TESTS) $(PROGRAMS),$(eval $(call test_program,$(1),$(t))))
$(call program,$(1),$(TESTS) $(PROGRAMS)): $(1)/tests/support/asan_options.c.o $(1)/libtests.a $(1)/libassay.a | $(1)/oiio.so
	$$(link)
$(1)/tests/%: TEST_LIBS := $(TEST_LINKER) -lcmocka
# The programs with a malloc() of their own that can be made to fail.
$(1)/no_memory/pathtracer: $(1)/renderer/pathtracer/pathtracer.c.o
$(1)/no_memory/assay: $(1)/tools/commands/assay.c.o
$(1)/no_memory/pathtracer $(1)/no_memory/assay: $(1)/tests/end_to_end/no_memory.c.o $(1)/tests/support/asan_options.c.o $(1)/libassay.a | $(1)/oiio.so
	$$(link)
$(1)/no_memory/%: TEST_LIBS := $(TEST_LINKER) -Wl,--wrap=main,--wrap=dlopen,--wrap=wait4
$(1)/tests/test_embree $(1)/tests/bench: TEST_LIBS = $(TEST_LINKER) -lcmocka $$(LIB_EMBREE)
endef
$(foreach b,$(BUILD) $(BUILD)/san $(BUILD)/tsan $(BUILD)/cov,$(eval $(call test_tree,$(b))))
$(BUILD)/san/pathtracer $(BUILD)/san/assay: $(BUILD)/san/tests/support/asan_options.c.o
$(call obj,$(BUILD),$(TESTS) $(PROGRAMS) $(BENCH) $(SUPPORT) tests/support/asan_options.c tests/end_to_end/no_memory.c): | $(BUILD)/deps-test
$(BUILD)/tests/bench: $(call obj,$(BUILD),$(BENCH))
# The peer is compiled for this machine's instructions; our renderer chooses its own at start.
$(BUILD)/tests/studies/bench/embree_tracer.c.o: defs += -march=native -ffast-math -ffp-contract=fast
# playwright-core, with which pages are tested in Debian's chromium; without it those tests are skipped, and say so.
$(BUILD)/browser/package-lock.json: tests/browser/package-lock.json tests/browser/package.json | $(BUILD)/deps-test
	$(call say,NPM,$@)
	$(Q)mkdir -p $(@D) && cp tests/browser/package.json $(@D) && cp $< $(@D)/lock.json && cd $(@D) && \
	  mv lock.json package-lock.json && { npm ci --silent --ignore-scripts --no-audit --no-fund || \
	    echo "npm finds no registry: pages will not be looked at in a browser" >&2; }

END_TO_END := $(BUILD)/tests/image_change $(BUILD)/tests/test_camera $(BUILD)/tests/student_tracer $(BUILD)/tests/bench $(BUILD)/browser/package-lock.json $(BUILD)/libassay.a library
#: make check      unit tests under ASan and UBSan, measured error rates, end-to-end tests, lint, fuzzers
check: $(BUILD)/deps-test $(BUILD)/deps-lint all programs-san programs-clang programs-fuzz programs-no-memory $(CHECKED) $(END_TO_END)
	tests/run.sh $(BUILD) $(CHECKED)

programs-no-memory: $(BUILD)/san/no_memory/pathtracer $(BUILD)/san/no_memory/assay $(BUILD)/no_memory/pathtracer
programs-san: $(BUILD)/san/pathtracer $(BUILD)/san/assay $(BUILD)/san/oiio.so
# The library that the fuzzers are linked with, and all other sources for clang's warnings alone.
programs-clang: $(BUILD)/clang/libassay.a $(patsubst %,$(BUILD)/clang/%.ok,$(KERNELS) $(MAINS) $(filter-out tests/fuzz/% tests/lint/%,$(wildcard tests/*/*.c tests/*/*/*.c)))
define clang_ok
	$(call say,CC,$@)
	$(Q)mkdir -p $(@D) && $(CC) $(cflags) -MMD -MP -MF $@.d -MT $@ -fsyntax-only $< && touch $@
endef
$(BUILD)/clang/%.c.ok: %.c | $(BUILD)/deps-test
	$(clang_ok)
define kernel_ok
$(BUILD)/clang/$(1)_$(2).c.ok: defs += $(call isa_flags,$(2),$(1))
$(BUILD)/clang/$(1)_$(2).c.ok: $(1).c | $(BUILD)/deps-test
	$$(clang_ok)
endef
$(foreach k,$(BY_ISA),$(foreach i,$(call isas_of,$(k)),$(eval $(call kernel_ok,$(k),$(i)))))

# Readers of files under libFuzzer, one program for each tests/fuzz/fuzz_NAME.c.
FUZZ := $(patsubst tests/fuzz/fuzz_%.c,%,$(wildcard tests/fuzz/fuzz_*.c))
$(BUILD)/clang/fuzz_%: TEST_LIBS := $(TEST_LINKER) -fsanitize=fuzzer
$(patsubst %,$(BUILD)/clang/fuzz_%,$(FUZZ)): $(BUILD)/clang/fuzz_%: $(BUILD)/clang/tests/fuzz/fuzz_%.c.o \
  $(call obj,$(BUILD)/clang,tests/fuzz/fuzz.c tests/support/asan_options.c) $(BUILD)/clang/libassay.a | $(BUILD)/clang/oiio.so
	$(link)
programs-fuzz: $(patsubst %,$(BUILD)/clang/fuzz_%,$(FUZZ))
#: make fuzz       readers of files under libFuzzer (SECONDS_EACH=60; ONLY="collada engine": some of them)
fuzz: $(patsubst %,$(BUILD)/clang/fuzz_%,$(or $(ONLY),$(FUZZ)))
	tests/fuzz/run.sh $(BUILD) $(SECONDS_EACH) $(or $(ONLY),$(FUZZ))

#: make threads    the same bits on 1 to 16 threads, on every scene; make tsan: no race
threads: $(BUILD)/pathtracer
	tests/end_to_end/threads.sh $(BUILD)/pathtracer
THREADED := $(addprefix test_,bvh_wide integrator widths render)
tsan: $(BUILD)/tsan/pathtracer $(BUILD)/tsan/assay $(BUILD)/tsan/oiio.so $(THREADED:%=$(BUILD)/tsan/tests/%)
	tests/end_to_end/tsan.sh $(BUILD)/tsan $(THREADED)

#: make faults     kill -9 at 200 moments each of five kinds of run; every allocation fails in turn (an hour)
faults: $(BUILD)/pathtracer $(BUILD)/assay programs-no-memory
	tests/end_to_end/faults.sh $(BUILD) 200 $(or $(ONLY),kill_renders kill_golden kill_grading kill_report kill_validation disk clock memory)

#: make coverage   lines of renderer/, reference/ and tools/ that the tests reach (12 minutes)
coverage: all $(BUILD)/no_memory/pathtracer $(BUILD)/cov/no_memory/pathtracer $(BUILD)/cov/no_memory/assay $(BUILD)/cov/pathtracer $(BUILD)/cov/assay $(BUILD)/cov/oiio.so $(call program,$(BUILD)/cov,$(TESTS)) \
  $(BUILD)/cov/tests/student_tracer $(END_TO_END)
	tests/end_to_end/coverage.sh $(BUILD) $(call program,$(BUILD)/cov,$(TESTS))

include tests/lint/lint.mk tests/mutants/mutants.mk tests/studies/studies.mk

.PHONY: check threads tsan faults coverage fuzz programs-san programs-clang programs-fuzz programs-no-memory
