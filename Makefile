# Assay. `make validate` and `make check` are the two commands; `make help` lists the rest.
# Everything is built below $(BUILD); only `make golden` writes beside the sources.

BUILD  ?= build
CC     ?= gcc
CXX    ?= g++
PREFIX ?= /usr/local
LIVE   ?=
ONLY   ?=
ALPHA  ?= 1e-3
SECONDS_EACH ?= 60
V      ?=
MAKEFLAGS += --jobs=$(shell nproc)

# Debian packages: to build and validate, to check, to render the references.
DEPS      := gcc g++ make pkg-config libxml2-dev libopenexr-dev libpng-dev libopenimageio-dev libjansson-dev libgsl-dev \
  nettle-dev zlib1g-dev libdeflate-dev libmicrohttpd-dev bubblewrap
DEPS_TEST := libcmocka-dev zip unzip clang libxml2-utils libembree-dev patch openimageio-tools chromium \
  $(if $(shell command -v npm),,nodejs npm)
DEPS_LINT := clang-tidy cppcheck llvm
DEPS_LIVE := blender povray python3-numpy
DEPS_SLURM := slurm-wlm munge

VERSION := 0.1
COMMIT  := $(shell git rev-parse --short=12 HEAD 2>/dev/null || echo unknown)
PKGS    := libxml-2.0 OpenEXR libpng jansson gsl nettle zlib libdeflate libmicrohttpd

# Expanded when a recipe runs, so that pkg-config is asked after the packages are there.
pkg_cflags = $(shell pkg-config --cflags $(PKGS) | sed 's/-I/-isystem /g')
# --as-needed: pathtracer starts at once, without the libraries that only the harness uses.
LIBS       = -Wl,--as-needed $(shell pkg-config --libs $(PKGS)) -lm -pthread

# -g1: file and line are all that a finding says, and -g doubles the time that the kernels take to compile.
SANITIZE := -O1 -g1 -fno-omit-frame-pointer -fno-sanitize-recover=all -fsanitize=address,undefined
OPT      := -O3 -g -fno-math-errno -fno-trapping-math
WARN      = -Wall -Wextra $(if $(WERROR),-Werror)
WARN_C    = $(WARN) -Wshadow -Wstrict-prototypes -Wswitch-enum -Wvla
# -ffp-contract=off: the same bits whether or not a processor can multiply and add in one step.
cflags    = -std=c17 $(OPT) -ffp-contract=off $(WARN_C) -D_XOPEN_SOURCE=700 -pthread $(CFLAGS) $(pkg_cflags)
# OpenImageIO is in oiio.so alone (reference/image_oiio.h).
cxxflags  = -std=c++17 -fPIC $(OPT) $(WARN) $(CXXFLAGS) $(shell pkg-config --cflags OpenImageIO | sed 's/-I/-isystem /g')

# Compiled once for each instruction set (renderer/isa.h), renderer/wide_kernel_avx2.c.o say.
ISAS     := sse42 avx2 avx512
BY_ISA   := renderer/wide_kernel renderer/wide_split renderer/lanes_kernel
KERNELS  := $(foreach k,$(BY_ISA),$(ISAS:%=$(k)_%.c))
RENDERER := $(filter-out renderer/main.c $(BY_ISA:=.c),$(wildcard renderer/*.c)) $(KERNELS)
HARNESS  := $(wildcard reference/*.c) $(filter-out tools/main.c,$(wildcard tools/*.c))
TESTS    := $(patsubst %.c,%,$(wildcard tests/test_*.c))
# Simulations of thousands of claims: without sanitizers, which the same code meets in the others.
RATES    := $(patsubst %,tests/test_%,calibration compare_rates converge permutation sequence spatial statistics)
CHECKED   = $(patsubst %,$(BUILD)/san/%,$(filter-out $(RATES),$(TESTS))) $(patsubst %,$(BUILD)/%,$(RATES))
BENCH    := $(wildcard tests/bench*.c) tests/embree_tracer.c
SUPPORT  := $(filter-out $(TESTS:=.c) $(BENCH) tests/make_%.c tests/diagnose_rates.c tests/grade_table.c tests/student_tracer.c tests/alloc_fail.c,$(wildcard tests/*.c))
obj       = $(patsubst %,$(1)/%.o,$(2))

Q  := $(if $(V),,@)
say = $(if $(V),,@printf '  %-5s %s\n' $(1) $(2))

all: $(BUILD)/pathtracer $(BUILD)/assay $(BUILD)/oiio.so

validate: all $(if $(LIVE),$(BUILD)/deps-live)
	$(BUILD)/assay validate --out $(BUILD)/report --alpha $(ALPHA) \
	  $(if $(LIVE),--live) $(addprefix --only ,$(ONLY))

check: $(BUILD)/deps-test $(BUILD)/deps-lint all programs-san programs-clang programs-fuzz $(CHECKED) $(BUILD)/tests/student_tracer \
  $(BUILD)/libassay.a $(BUILD)/tests/bench $(BUILD)/browser/package-lock.json
	tests/run.sh $(BUILD) $(CHECKED)

# clang-tidy (.clang-tidy) over the programs, cppcheck over all C (.cppcheck-suppressions): no finding.
LINT := $(filter-out $(KERNELS),$(RENDERER)) renderer/main.c tools/main.c $(filter %.c,$(HARNESS))
lint: $(BUILD)/deps-lint $(patsubst %,$(BUILD)/lint/%.ok,$(LINT) $(KERNELS)) $(BUILD)/lint/cppcheck.ok
	@echo '$(words $(LINT) $(KERNELS)) files, no finding'

# The same bits on 1 to 16 threads, on every scene; and no race, as ThreadSanitizer sees it.
threads: $(BUILD)/pathtracer
	tests/threads.sh $(BUILD)/pathtracer
THREADED := test_bvh_wide test_integrator test_lanes test_render
tsan: $(BUILD)/tsan/pathtracer $(BUILD)/tsan/assay $(BUILD)/tsan/oiio.so $(THREADED:%=$(BUILD)/tsan/tests/%)
	tests/tsan.sh $(BUILD)/tsan $(THREADED)

# kill -9 at 200 moments each of a render, a golden update, a grading batch, a report and a validation; every allocation
# failed in turn (an hour; ONLY="kill_golden ...": parts of it).
faults: $(BUILD)/pathtracer $(BUILD)/assay
	tests/faults.sh $(BUILD) 200 1 $(ONLY)

# A render, a grading batch and a validation on a Slurm cluster of four nodes on this machine, one killed in the middle. As root.
slurm: $(BUILD)/pathtracer $(BUILD)/assay $(BUILD)/deps-slurm
	tests/slurm.sh $(BUILD)

# Live references and validations in jobs, with Blender and POV-Ray themselves (minutes).
scale-live: $(BUILD)/pathtracer $(BUILD)/assay $(BUILD)/deps-live
	tests/scale_live.sh $(BUILD)

# A picture of 16384 x 16384 in 64 jobs, each program within 2 GiB (SIDE=16384; 30 GB of disk).
large: $(BUILD)/pathtracer $(BUILD)/assay $(BUILD)/deps-test
	tests/large.sh $(BUILD) $(or $(SIDE),16384)

# What a thousand nodes would do, simulated (tools/SCALE.md).
scale: $(BUILD)/tests/make_scale
	$(BUILD)/tests/make_scale

# Lines of renderer/, reference/ and tools/ that the tests and the end-to-end runs reach.
coverage: all $(BUILD)/cov/pathtracer $(BUILD)/cov/assay $(BUILD)/cov/oiio.so $(patsubst %,$(BUILD)/cov/%,$(TESTS)) \
  $(BUILD)/cov/tests/student_tracer $(BUILD)/tests/bench $(BUILD)/browser/package-lock.json $(BUILD)/libassay.a
	tests/coverage.sh $(BUILD) $(patsubst %,$(BUILD)/cov/%,$(TESTS))

# Each bug of tests/mutants must be found by the suite (ONLY="NAME ...": some of them).
mutants: all $(BUILD)/libassay.a
	tests/mutants.sh $(if $(ONLY),,--table tests/mutants/README.md) $(BUILD) $(ONLY)

# Brings golden/diagnose/, by which `assay diagnose` names bugs, up to date with tests/mutants.
catalogue: all $(BUILD)/libassay.a $(BUILD)/tests/make_catalogue
	tests/mutants.sh --build-only $(BUILD)
	$(BUILD)/tests/make_catalogue $(BUILD) tests/mutants golden/diagnose

# How often bugs are named rightly, and that the correct renderer is not accused (an hour).
diagnose-rates: catalogue $(BUILD)/tests/diagnose_rates
	$(BUILD)/tests/diagnose_rates $(BUILD) >$(BUILD)/diagnose_rates.md
	cp $(BUILD)/diagnose_rates.md golden/diagnose/README.md

# Error rates and power of the tester, published: tests/calibration ; SHARE=0.01: a hundredth of it, into BUILD/calibration.
calibrate: $(BUILD)/tests/make_calibration
	$(BUILD)/tests/make_calibration --threads $(shell nproc) \
	  $(if $(SHARE),--share $(SHARE) $(BUILD)/calibration,tests/calibration)

bench bench-rays: $(BUILD)/deps-test $(BUILD)/tests/bench $(BUILD)/pathtracer
	$(BUILD)/tests/bench --build $(BUILD) --out $(BUILD)/$@ $(patsubst bench-%,%,$(filter-out bench,$@))

# Fifty submissions, known bugs most of them, graded by the rubric of the course: tests/grading.
grade-show: all $(BUILD)/deps-test $(BUILD)/libassay.a $(BUILD)/tests/grade_table
	tests/grade_show.sh $(BUILD)

# What known bugs do to the pictures of a rubric, by which they are named.
rubric-bugs: all $(BUILD)/deps-test $(BUILD)/libassay.a $(BUILD)/tests/make_rubric_bugs
	tests/mutants.sh --build-only $(BUILD)
	$(BUILD)/tests/make_rubric_bugs $(BUILD) tests/mutants $(RUBRIC)

bvh-table: $(BUILD)/pathtracer
	tests/bvh_table.sh $(BUILD)

# What our gate and the rules of other renderers' tests find on the same pictures: tests/anchors.
anchors: $(BUILD)/tests/make_anchors $(BUILD)/oiio.so
	$(BUILD)/tests/make_anchors tests/anchors $(BUILD)/anchors

golden: all $(BUILD)/deps-live
	$(BUILD)/assay golden render --golden golden --out $(BUILD)/golden-candidate --work $(BUILD)/work \
	  $(addprefix --only ,$(ONLY))
	$(BUILD)/assay golden approve --all --new --golden golden --from $(BUILD)/golden-candidate $(ONLY)

report: all
	$(BUILD)/assay report $(BUILD)/report/results.json

# A zip to upload to Gradescope, which grades by RUBRIC.
RUBRIC ?= tools/rubrics/cs184.rubric
autograder: all $(BUILD)/deps-test
	tools/autograder/pack.sh $(BUILD) $(RUBRIC) $(BUILD)/autograder.zip '$(COMMIT)' $(DEPS)

# For tests/mutants.sh.
print-compile:
	@echo $(CC) $(filter-out -g,$(cflags))
print-libs:
	@echo $(LIBS)
print-kernels:
	@$(foreach k,$(BY_ISA),$(foreach i,$(ISAS),echo $(k)_$(i).c $(k).c $(call isa_flags,$(i));))

deps: $(BUILD)/deps
deps-live: $(BUILD)/deps-live

install: all
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/share/assay $(DESTDIR)$(PREFIX)/share/man/man1
	install -m 644 renderer/pathtracer.1 $(DESTDIR)$(PREFIX)/share/man/man1
	install -m 755 $(BUILD)/pathtracer $(BUILD)/assay $(DESTDIR)$(PREFIX)/bin
	install -D -m 755 $(BUILD)/oiio.so $(DESTDIR)$(PREFIX)/lib/assay/oiio.so
	install -m 644 reference/cycles*.py reference/importer.py $(DESTDIR)$(PREFIX)/share/assay
	cp -R reference/scenes reference/engines golden tools/rubrics $(DESTDIR)$(PREFIX)/share/assay

format:
	clang-format -i $(wildcard renderer/*.[ch] reference/*.[ch] tools/*.[ch] tests/*.[ch])

clean:
	rm -rf $(BUILD)

help:
	@echo 'make            build pathtracer and assay'
	@echo 'make validate   judge the suite against the stored references; LIVE=1: render them now;'
	@echo '                ONLY="SCENE ...": some scenes; ALPHA=1e-3: chance of any wrong verdict'
	@echo 'make check      unit tests under ASan and UBSan, measured error rates, end-to-end tests, lint, fuzzers'
	@echo 'make lint       clang-tidy and cppcheck, no finding (minutes; a part of make check)'
	@echo 'make threads    the same bits on 1 to 16 threads, on every scene; make tsan: no race'
	@echo 'make faults     kill -9 at 200 moments each of five kinds of run; every allocation fails in turn (an hour)'
	@echo 'make slurm      jobs on a Slurm cluster of four nodes on this machine, one killed (as root; a minute)'
	@echo 'make scale-live live references and validations in jobs, with Blender and POV-Ray (minutes)'
	@echo 'make large      a picture of 16384 x 16384 in jobs, within 2 GiB (30 GB of disk; SIDE=16384)'
	@echo 'make scale      simulate a class, a suite and a large picture on up to 1000 nodes (tools/SCALE.md)'
	@echo 'make coverage   lines of renderer/, reference/ and tools/ that the tests reach (12 minutes)'
	@echo 'make mutants    build each known bug into a renderer and see the suite find it (many minutes)'
	@echo 'make anchors    what our gate and the rules of other renderers find on the same pictures'
	@echo '                (tests/anchors; 20 CPU minutes, 900 MB)'
	@echo 'make catalogue   bring what assay diagnose knows of these bugs up to date'
	@echo 'make diagnose-rates  measure how often it is right (an hour)'
	@echo 'make calibrate   measure error rates and power, write tests/calibration/ (SHARE=0.01: a part of it)'
	@echo 'make fuzz       readers of files under libFuzzer (SECONDS_EACH=60; ONLY="collada engine": some of them)'
	@echo 'make grade-show  grade a class of fifty, write tests/grading/'
	@echo 'make rubric-bugs what known bugs do to the pictures of a rubric (RUBRIC=tools/rubrics/cs184.rubric)'
	@echo 'make bvh-table   time the hierarchies and brute force on meshes in ASSAY_CS184 (minutes)'
	@echo 'make bench       speed against Embree, Cycles and POV-Ray (BUILD/bench); bench-rays: a part of it'
	@echo 'make golden     render what is missing or out of date in golden/, approve what is new or'
	@echo '                EQUIVALENT, list what differs (ONLY="SCENE ...": of some scenes)'
	@echo 'make report     make the page of the last validation again'
	@echo 'make autograder  BUILD/autograder.zip for Gradescope (RUBRIC=tools/rubrics/cs184.rubric)'
	@echo 'make deps       install the Debian packages that building needs'
	@echo 'make install    into PREFIX=$(PREFIX)'

# Three builds of everything: the programs, the same under sanitizers, and all of it by clang, to see that
# it has no warning there too, and for the fuzzers.
$(BUILD)/san/%: OPT := $(SANITIZE)
$(BUILD)/san/%: WERROR := 1
$(BUILD)/clang/%: CC := clang
$(BUILD)/clang/%: CXX := clang++
$(BUILD)/clang/%: OPT := $(SANITIZE),fuzzer-no-link
$(BUILD)/clang/%: WERROR := 1
# Two more on demand: under ThreadSanitizer, and with clang's counts of what ran.
$(BUILD)/tsan/%: OPT := -O1 -g -fno-omit-frame-pointer -fsanitize=thread
$(BUILD)/cov/%: CC := clang
$(BUILD)/cov/%: CXX := clang++
$(BUILD)/cov/%: OPT := -O2 -g -fprofile-instr-generate -fcoverage-mapping
$(BUILD)/cov/%: WERROR := 1

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
	$(Q)mkdir -p $(@D) && $(CXX) $(OPT) -o $@ $(filter %.o,$^) $(filter %.a,$^) $(LIBS) $(TEST_LIBS)
endef
define archive
	$(call say,AR,$@)
	$(Q)rm -f $@ && ar rcs $@ $^
endef

$(BUILD)/%.c.o: %.c | $(BUILD)/deps
	$(compile_c)
$(BUILD)/san/%.c.o: %.c | $(BUILD)/deps
	$(compile_c)
$(BUILD)/clang/%.c.o: %.c | $(BUILD)/deps-test
	$(compile_c)
$(BUILD)/%.cc.o: %.cc | $(BUILD)/deps
	$(compile_cxx)
$(BUILD)/san/%.cc.o: %.cc | $(BUILD)/deps
	$(compile_cxx)
$(BUILD)/clang/%.cc.o: %.cc | $(BUILD)/deps-test
	$(compile_cxx)

$(BUILD)/tsan/%.c.o: %.c | $(BUILD)/deps-test
	$(compile_c)
$(BUILD)/tsan/%.cc.o: %.cc | $(BUILD)/deps-test
	$(compile_cxx)
$(BUILD)/cov/%.c.o: %.c | $(BUILD)/deps-lint
	$(compile_c)
$(BUILD)/cov/%.cc.o: %.cc | $(BUILD)/deps-lint
	$(compile_cxx)

isa_sse42  := -msse4.2
isa_avx2   := -mavx2 -mfma -mbmi -mbmi2 -mpopcnt -mlzcnt
isa_avx512 := $(isa_avx2) -mavx512f -mavx512vl -mavx512bw -mavx512dq
# -Wno-psabi: no vector of 32 bytes leaves the file.
isa_flags   = -DISA=$(1) $(isa_$(1)) -Wno-psabi
define kernel_object
$(1)/$(2)_$(3).c.o: CFLAGS += $(call isa_flags,$(3))
$(1)/$(2)_$(3).c.o: $(2).c | $(BUILD)/deps
	$$(compile_c)
endef
TREES := $(BUILD) $(BUILD)/san $(BUILD)/clang $(BUILD)/tsan $(BUILD)/cov
# No fuzzer traces a ray; the tests do, in san/.
$(patsubst %,$(BUILD)/clang/%.o,$(filter-out renderer/wide_split%,$(KERNELS))): OPT := -O1
$(foreach b,$(TREES),$(foreach k,$(BY_ISA),$(foreach i,$(ISAS), \
  $(eval $(call kernel_object,$(b),$(k),$(i))))))

$(TREES:%=%/oiio.so): %/oiio.so: %/reference/oiio.cc.o
	$(call say,LINK,$@)
	$(Q)$(CXX) $(OPT) -shared -o $@ $< $(shell pkg-config --libs OpenImageIO)
$(BUILD)/san/pathtracer $(BUILD)/san/assay: $(BUILD)/san/tests/asan_options.c.o
$(BUILD)/pathtracer: $(call obj,$(BUILD),renderer/main.c $(RENDERER))
	$(link)
$(BUILD)/assay: $(call obj,$(BUILD),tools/main.c $(HARNESS) $(RENDERER))
	$(link)
$(BUILD)/san/pathtracer: $(call obj,$(BUILD)/san,renderer/main.c $(RENDERER))
	$(link)
$(BUILD)/san/assay: $(call obj,$(BUILD)/san,tools/main.c $(HARNESS) $(RENDERER))
	$(link)
$(BUILD)/san/tests/%: $(BUILD)/san/tests/%.c.o $(call obj,$(BUILD)/san,$(SUPPORT)) $(BUILD)/san/libassay.a | $(BUILD)/san/oiio.so
	$(link)
$(BUILD)/tests/%: $(BUILD)/tests/%.c.o $(call obj,$(BUILD),$(SUPPORT)) $(BUILD)/libassay.a | $(BUILD)/oiio.so
	$(link)
$(BUILD)/san/tests/% $(BUILD)/tests/%: TEST_LIBS := -lcmocka
# With a malloc() of their own, which can fail.
$(foreach b,$(BUILD) $(BUILD)/san $(BUILD)/cov,$(eval $(patsubst %,$(b)/%,$(filter tests/test_memory%,$(TESTS))): $(b)/tests/alloc_fail.c.o))
$(BUILD)/san/tests/test_embree $(BUILD)/tests/test_embree $(BUILD)/tests/bench: TEST_LIBS := -lcmocka -lembree3
$(BUILD)/san/tests/%.c.o: | $(BUILD)/deps-test
$(BUILD)/libassay.a: $(call obj,$(BUILD),$(HARNESS) $(RENDERER))
	$(archive)
$(BUILD)/san/libassay.a: $(call obj,$(BUILD)/san,$(HARNESS) $(RENDERER))
	$(archive)
$(BUILD)/tests/bench: $(call obj,$(BUILD),$(BENCH) tests/mesh.c tests/calibrate_plot.c) $(BUILD)/libassay.a
	$(link)
$(call obj,$(BUILD),$(BENCH)): | $(BUILD)/deps-test
# The peer gets all that this machine has; ours chooses when it starts.
$(BUILD)/tests/embree_tracer.c.o: CFLAGS += -march=native -ffast-math -ffp-contract=fast
$(BUILD)/tests/make_mesh: $(call obj,$(BUILD),tests/make_mesh.c tests/mesh.c) $(BUILD)/libassay.a
	$(link)
$(BUILD)/tests/make_suite_files: $(call obj,$(BUILD),tests/make_suite_files.c tests/suite_files.c) $(BUILD)/libassay.a
	$(link)
$(BUILD)/tests/make_catalogue $(BUILD)/tests/make_rubric_bugs $(BUILD)/tests/diagnose_rates $(BUILD)/tests/grade_table: \
  $(BUILD)/tests/%: $(BUILD)/tests/%.c.o $(BUILD)/libassay.a
	$(link)
$(BUILD)/tests/make_scale: $(call obj,$(BUILD),tests/make_scale.c) $(BUILD)/libassay.a
	$(link)
$(BUILD)/tests/make_sky: $(call obj,$(BUILD),tests/make_sky.c) $(BUILD)/libassay.a
	$(link)
$(BUILD)/tests/make_anchors: $(call obj,$(BUILD),tests/make_anchors.c tests/anchors.c tests/anchors_page.c \
  tests/anchors_plot.c tests/anchor_images.c tests/anchor_rules.c) $(BUILD)/libassay.a
	$(link)
$(BUILD)/tests/make_calibration: $(call obj,$(BUILD),tests/make_calibration.c $(SUPPORT)) $(BUILD)/libassay.a
	$(link)
$(BUILD)/tsan/pathtracer: $(call obj,$(BUILD)/tsan,renderer/main.c $(RENDERER))
	$(link)
$(BUILD)/tsan/libassay.a: $(call obj,$(BUILD)/tsan,$(HARNESS) $(RENDERER))
	$(archive)
$(BUILD)/cov/libassay.a: $(call obj,$(BUILD)/cov,$(HARNESS) $(RENDERER))
	$(archive)
$(BUILD)/tsan/assay $(BUILD)/cov/assay: $(BUILD)/%/assay: $(BUILD)/%/tools/main.c.o $(BUILD)/%/libassay.a
	$(link)
$(BUILD)/cov/pathtracer: $(call obj,$(BUILD)/cov,renderer/main.c) $(BUILD)/cov/libassay.a
	$(link)
$(BUILD)/tsan/tests/% $(BUILD)/cov/tests/%: TEST_LIBS := -lcmocka
$(BUILD)/cov/tests/test_embree: TEST_LIBS := -lcmocka -lembree3
$(BUILD)/tsan/tests/%: $(BUILD)/tsan/tests/%.c.o $(call obj,$(BUILD)/tsan,$(SUPPORT)) $(BUILD)/tsan/libassay.a | $(BUILD)/tsan/oiio.so
	$(link)
$(BUILD)/cov/tests/%: $(BUILD)/cov/tests/%.c.o $(call obj,$(BUILD)/cov,$(SUPPORT)) $(BUILD)/cov/libassay.a | $(BUILD)/cov/oiio.so
	$(link)
$(BUILD)/cov/tests/student_tracer: $(BUILD)/cov/tests/student_tracer.c.o
	$(link)
# playwright-core, by which the page is tested in Debian's chromium.
$(BUILD)/browser/package-lock.json: tests/browser/package-lock.json tests/browser/package.json | $(BUILD)/deps-test
	$(call say,NPM,$@)
	$(Q)mkdir -p $(@D) && cp tests/browser/package.json $(@D) && cp $< $(@D)/lock.json && cd $(@D) && \
	  mv lock.json package-lock.json && npm ci --silent --ignore-scripts --no-audit --no-fund
$(BUILD)/tests/student_tracer: $(BUILD)/tests/student_tracer.c.o
	$(link)
# Readers of files under libFuzzer: one program for each tests/fuzz/fuzz_NAME.c.
FUZZ := $(patsubst tests/fuzz/fuzz_%.c,%,$(wildcard tests/fuzz/fuzz_*.c))
$(BUILD)/clang/libassay.a: $(call obj,$(BUILD)/clang,$(HARNESS) $(RENDERER))
	$(archive)
$(patsubst %,$(BUILD)/clang/fuzz_%,$(FUZZ)): TEST_LIBS := -fsanitize=fuzzer
$(patsubst %,$(BUILD)/clang/fuzz_%,$(FUZZ)): $(BUILD)/clang/fuzz_%: \
  $(BUILD)/clang/tests/fuzz/fuzz_%.c.o $(call obj,$(BUILD)/clang,tests/fuzz/fuzz.c tests/asan_options.c) $(BUILD)/clang/libassay.a | $(BUILD)/clang/oiio.so
	$(link)
programs-fuzz: $(patsubst %,$(BUILD)/clang/fuzz_%,$(FUZZ))
fuzz: $(patsubst %,$(BUILD)/clang/fuzz_%,$(or $(ONLY),$(FUZZ)))
	tests/fuzz/run.sh $(BUILD) $(SECONDS_EACH) $(or $(ONLY),$(FUZZ))

# A file is looked at again when it or any header changes. One file for each process: with several, clang-tidy 14 takes
# every va_list but the first file's for one that was never started.
define clang_tidy
	$(call say,TIDY,$<)
	$(Q)mkdir -p $(@D); clang-tidy --quiet $< -- -std=c17 -D_XOPEN_SOURCE=700 $(pkg_cflags) $(1) >$@.log 2>&1 || { cat $@.log; exit 1; }; touch $@
endef
$(patsubst %,$(BUILD)/lint/%.ok,$(LINT)): $(BUILD)/lint/%.ok: % .clang-tidy $(wildcard renderer/*.h reference/*.h tools/*.h) | $(BUILD)/deps-lint
	$(call clang_tidy,-DASSAY_VERSION='""' -DASSAY_COMMIT='""')
define kernel_lint
$(BUILD)/lint/$(1)_$(2).c.ok: $(1).c .clang-tidy $(wildcard renderer/*.h) | $(BUILD)/deps-lint
	$$(call clang_tidy,$(call isa_flags,$(2)))
endef
$(foreach k,$(BY_ISA),$(foreach i,$(ISAS),$(eval $(call kernel_lint,$(k),$(i)))))
# Both are asked about planted faults first: who does not see them sees nothing (cppcheck is silent about a file that it cannot read).
cppcheck = cppcheck --enable=warning,performance,portability --std=c11 --quiet --inline-suppr --error-exitcode=1 \
  --suppressions-list=.cppcheck-suppressions -D_XOPEN_SOURCE=700 -DISA=avx2 --include=tests/lint/jansson.h
$(BUILD)/lint/planted.ok: tests/lint/planted.c tests/lint/jansson.h .clang-tidy .cppcheck-suppressions | $(BUILD)/deps-lint
	$(Q)mkdir -p $(@D); ! $(cppcheck) $< 2>/dev/null || { echo 'cppcheck does not see a planted fault' >&2; exit 1; }
	$(Q)! clang-tidy --quiet $< -- -std=c17 $(pkg_cflags) >/dev/null 2>&1 || { echo 'clang-tidy does not see a planted fault' >&2; exit 1; }
	$(Q)touch $@
$(BUILD)/lint/cppcheck.ok: $(BUILD)/lint/planted.ok $(wildcard renderer/*.[ch] reference/*.[ch] tools/*.[ch] tests/*.[ch])
	$(call say,CHECK,cppcheck)
	$(Q)$(cppcheck) -i tests/lint renderer reference tools tests && touch $@

programs-san: $(BUILD)/san/pathtracer $(BUILD)/san/assay $(BUILD)/san/oiio.so
# What the fuzzers are linked from, and all the rest as far as clang's warnings look.
programs-clang: $(BUILD)/clang/libassay.a $(patsubst %,$(BUILD)/clang/%.ok,renderer/main.c tools/main.c $(SUPPORT) tests/alloc_fail.c $(TESTS:=.c) \
  $(wildcard tests/make_*.c tests/diagnose_rates.c tests/grade_table.c) $(BENCH))
$(BUILD)/clang/%.c.ok: %.c | $(BUILD)/deps-test
	$(call say,CC,$@)
	$(Q)mkdir -p $(@D) && $(CC) $(cflags) -MMD -MP -MF $@.d -MT $@ -fsyntax-only $< && touch $@

# What the compiler's dependency files cannot know: the page's parts are read by the assembler, and
# only version.c knows the commit.
$(foreach b,$(TREES),$(b)/tools/report_page.c.o): tools/page.css $(wildcard tools/page*.js)
$(foreach b,$(TREES),$(b)/renderer/version.c.o): $(BUILD)/commit
$(foreach b,$(TREES),$(b)/renderer/version.c.o): \
  CFLAGS += -DASSAY_VERSION='"$(VERSION)"' -DASSAY_COMMIT='"$(COMMIT)"'
$(BUILD)/commit: FORCE
	$(Q)mkdir -p $(@D) && echo $(VERSION) $(COMMIT) | cmp -s - $@ || echo $(VERSION) $(COMMIT) > $@
FORCE:

# Asks dpkg what is missing and apt for just that, as root or through sudo. Where there is no dpkg the
# packages are taken to be there, under whatever names.
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
	    $$sudo apt-get update -qq && \
	    $$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $$missing >$@.log 2>&1 \
	      || { tail -n 5 $@.log; echo "cannot install:$$missing" >&2; exit 1; }; \
	  fi; \
	fi; touch $@
endef
$(BUILD)/deps:
	$(call install_missing,$(DEPS))
$(BUILD)/deps-test: | $(BUILD)/deps
	$(call install_missing,$(DEPS_TEST))
$(BUILD)/deps-lint: | $(BUILD)/deps-test
	$(call install_missing,$(DEPS_LINT))
$(BUILD)/deps-live: | $(BUILD)/deps
	$(call install_missing,$(DEPS_LIVE))

$(BUILD)/deps-slurm: | $(BUILD)/deps
	$(call install_missing,$(DEPS_SLURM))

.PHONY: all validate check lint threads tsan faults slurm scale-live large scale coverage fuzz mutants print-compile print-libs print-kernels bench bench-rays bvh-table anchors golden report autograder deps deps-live install format clean help catalogue diagnose-rates grade-show rubric-bugs calibrate FORCE \
  programs-san programs-clang programs-fuzz
.SECONDARY:
.DELETE_ON_ERROR:
-include $(shell find $(BUILD) -name '*.d' 2>/dev/null)
