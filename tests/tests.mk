# What tests the programs, measures them and looks at them. Lines that begin with "#: " are a part of `make help`.

SECONDS_EACH ?= 60
DEPS_TEST := libcmocka-dev zip ccache clang libclang-rt-dev libxml2-utils libembree-dev patch cmake openimageio-tools chromium \
  $(DEPS_DEB) locales python3-numpy python3-jsonschema python3-pytest python3-venv python3-pip python3-setuptools python3-wheel \
  $(if $(shell command -v npm),,nodejs npm)
# Version 4 where it is there, as embree_mesh.h; asked when it has been installed.
LIB_EMBREE = -lembree$(if $(wildcard /usr/include/embree4/rtcore.h),4,3)
DEPS_LINT := clang-tidy cppcheck llvm
DEPS_SLURM := slurm-wlm munge
$(BUILD)/deps-test: | $(BUILD)/deps
	$(call install_missing,$(DEPS_TEST))
$(BUILD)/deps-lint: | $(BUILD)/deps-test
	$(call install_missing,$(DEPS_LINT))
$(BUILD)/deps-distros: | $(BUILD)/deps
	$(call install_missing,mmdebstrap)
$(BUILD)/deps-slurm: | $(BUILD)/deps
	$(call install_missing,$(DEPS_SLURM))

# Sources of the tests, and of programs that measure or make what is stored. Names are unique in the tree, so that
# all programs stand side by side, in BUILD/tests and BUILD/san/tests.
TESTS    := $(wildcard tests/*/test_*.c tests/*/*/test_*.c)
PROGRAMS := $(wildcard tests/*/make_*.c tests/*/*/make_*.c) tests/mutants/diagnose_rates.c tests/mutants/machine/image_change.c \
  tests/end_to_end/student_tracer.c tests/studies/bench/bench.c
BENCH   := $(wildcard tests/studies/bench/bench*.c) tests/studies/bench/embree_tracer.c
# What several tests share: a library, of which each takes what it wants.
SUPPORT := $(filter-out $(TESTS) $(PROGRAMS) $(BENCH) tests/support/asan_options.c, \
  $(wildcard tests/support/*.c tests/renderer/*/*.c tests/reference/*/*.c tests/tools/*/*.c tests/studies/*/*.c tests/mutants/bug_effect.c))
# Without sanitizers, which the same code meets in the others: simulations of thousands of claims, and closed forms and other
# programs against millions of rays and samples (test_widths has every material, light and option, test_bvh_wide all of the tracing).
RATES   := $(addprefix test_,alpha_spending calibration compare_rates converge diagnose noise_estimate permutation sign_flip statistics)
TRUTHS  := $(addprefix test_,embree independence integrator lights materials metamorphic povray_optics suite_scenes truth_lens \
  truth_mirrors_and_glass)
PLAIN   := $(RATES) $(TRUTHS)
program  = $(addprefix $(1)/tests/,$(basename $(notdir $(2))))
CHECKED  = $(filter-out $(addprefix %/,$(PLAIN)),$(call program,$(BUILD)/san,$(TESTS))) $(PLAIN:%=$(BUILD)/tests/%)

# -g1: file and line are all that a finding says, and -g doubles the time that the kernels take to compile.
SANITIZE := -O1 -g1 -fno-omit-frame-pointer -fno-sanitize-recover=all -fsanitize=address,undefined
# The same under sanitizers; all of it by clang, to see that it has no warning there too, and for the fuzzers; on demand
# under ThreadSanitizer, and with clang's counts of what ran.
$(BUILD)/san/%: OPT := $(SANITIZE)
# Where tests spend most of their time it pays to compile longer.
BUSY := renderer/bvh/bvh tools/compare/hint tools/diagnose/bug_fit tools/diagnose/signature tools/exact/permutation tools/grade/difference tools/images/flip
$(BUSY:%=$(BUILD)/san/%.c.o): OPT = $(SANITIZE:-O1=-O2)
$(BUILD)/san/%: WERROR := 1
$(BUILD)/tests/%: WERROR := 1
$(BUILD)/clang/%: CC := clang
$(BUILD)/clang/%: CXX := clang++
$(BUILD)/clang/%: OPT := $(SANITIZE),fuzzer-no-link
$(BUILD)/clang/%: WERROR := 1
$(BUILD)/tsan/%: OPT := -O1 -g -fno-omit-frame-pointer -fsanitize=thread
$(BUILD)/cov/%: CC := clang
$(BUILD)/cov/%: CXX := clang++
# Without -g, of which clang 14 dies in sixteen lanes.
$(BUILD)/cov/%: OPT := -O2 -fprofile-instr-generate -fcoverage-mapping
$(BUILD)/cov/%: WERROR := 1
# What no fuzzer runs is compiled in a fifth of the time; one that ran it after all would end (tests/fuzz/fuzz.c).
UNFUZZED := $(addprefix renderer/,bvh shading transport pathtracer) reference/truth \
  $(patsubst %/,%,$(sort $(dir $(wildcard reference/*/export_*.h)))) \
  $(addprefix tools/,stats compare sequential plots report validate converge commands)
$(foreach d,$(UNFUZZED),$(eval $(BUILD)/clang/$(d)/%: OPT := -O0 -finstrument-functions))
$(foreach b,san tsan cov,$(eval $(call tree,$(BUILD)/$(b),$(BUILD)/deps-test)))
# Of the kernels clang looks at the syntax alone, in a twentieth of the time; the fuzzers are linked with those of the programs.
$(eval $(call tree,$(BUILD)/clang,$(BUILD)/deps-test,$(BUILD)))

define test_program
$(call program,$(1),$(2)): $(1)/$(2).o
endef
define test_tree
$(1)/libtests.a: $(call obj,$(1),$(SUPPORT))
	$$(archive)
$(foreach t,$(TESTS) $(PROGRAMS),$(eval $(call test_program,$(1),$(t))))
$(call program,$(1),$(TESTS) $(PROGRAMS)): $(1)/tests/support/asan_options.c.o $(1)/libtests.a $(1)/libassay.a | $(1)/oiio.so
	$$(link)
$(1)/tests/%: TEST_LIBS := -lcmocka
# Whole programs with a malloc() of their own, which can fail.
$(1)/no_memory/pathtracer: $(1)/renderer/pathtracer/pathtracer.c.o
$(1)/no_memory/assay: $(1)/tools/commands/assay.c.o
$(1)/no_memory/pathtracer $(1)/no_memory/assay: $(1)/tests/end_to_end/no_memory.c.o $(1)/tests/support/asan_options.c.o $(1)/libassay.a | $(1)/oiio.so
	$$(link)
$(1)/no_memory/%: TEST_LIBS := -Wl,--wrap=main,--wrap=dlopen,--wrap=wait4
$(1)/tests/test_embree $(1)/tests/bench: TEST_LIBS = -lcmocka $$(LIB_EMBREE)
endef
$(foreach b,$(BUILD) $(BUILD)/san $(BUILD)/tsan $(BUILD)/cov,$(eval $(call test_tree,$(b))))
$(BUILD)/san/pathtracer $(BUILD)/san/assay: $(BUILD)/san/tests/support/asan_options.c.o
$(call obj,$(BUILD),$(TESTS) $(PROGRAMS) $(BENCH) $(SUPPORT) tests/support/asan_options.c tests/end_to_end/no_memory.c): | $(BUILD)/deps-test
$(BUILD)/tests/bench: $(call obj,$(BUILD),$(BENCH))
# The peer gets all that this machine has; ours chooses when it starts.
$(BUILD)/tests/studies/bench/embree_tracer.c.o: CFLAGS += -march=native -ffast-math -ffp-contract=fast
# playwright-core, by which the page is tested in Debian's chromium; without it the tests say that they are skipped.
$(BUILD)/browser/package-lock.json: tests/browser/package-lock.json tests/browser/package.json | $(BUILD)/deps-test
	$(call say,NPM,$@)
	$(Q)mkdir -p $(@D) && cp tests/browser/package.json $(@D) && cp $< $(@D)/lock.json && cd $(@D) && \
	  mv lock.json package-lock.json && { npm ci --silent --ignore-scripts --no-audit --no-fund || \
	    echo "npm finds no registry: pages will not be looked at in a browser" >&2; }

END_TO_END := $(BUILD)/tests/image_change $(BUILD)/tests/test_camera $(BUILD)/tests/student_tracer $(BUILD)/tests/bench $(BUILD)/browser/package-lock.json $(BUILD)/libassay.a library
check: $(BUILD)/deps-test $(BUILD)/deps-lint all programs-san programs-clang programs-fuzz programs-no-memory $(CHECKED) $(END_TO_END)
	tests/run.sh $(BUILD) $(CHECKED)

programs-no-memory: $(BUILD)/san/no_memory/pathtracer $(BUILD)/san/no_memory/assay $(BUILD)/no_memory/pathtracer
programs-san: $(BUILD)/san/pathtracer $(BUILD)/san/assay $(BUILD)/san/oiio.so
# What the fuzzers are linked from, and all the rest as far as clang's warnings look.
programs-clang: $(BUILD)/clang/libassay.a $(patsubst %,$(BUILD)/clang/%.ok,$(KERNELS) $(MAINS) $(filter-out tests/fuzz/% tests/lint/%,$(wildcard tests/*/*.c tests/*/*/*.c)))
define clang_ok
	$(call say,CC,$@)
	$(Q)mkdir -p $(@D) && $(CC) $(cflags) -MMD -MP -MF $@.d -MT $@ -fsyntax-only $< && touch $@
endef
$(BUILD)/clang/%.c.ok: %.c | $(BUILD)/deps-test
	$(clang_ok)
define kernel_ok
$(BUILD)/clang/$(1)_$(2).c.ok: CFLAGS += $(call isa_flags,$(2),$(1))
$(BUILD)/clang/$(1)_$(2).c.ok: $(1).c | $(BUILD)/deps-test
	$$(clang_ok)
endef
$(foreach k,$(BY_ISA),$(foreach i,$(call isas_of,$(k)),$(eval $(call kernel_ok,$(k),$(i)))))

# Readers of files under libFuzzer: one program for each tests/fuzz/fuzz_NAME.c.
FUZZ := $(patsubst tests/fuzz/fuzz_%.c,%,$(wildcard tests/fuzz/fuzz_*.c))
$(BUILD)/clang/fuzz_%: TEST_LIBS := -fsanitize=fuzzer
$(patsubst %,$(BUILD)/clang/fuzz_%,$(FUZZ)): $(BUILD)/clang/fuzz_%: $(BUILD)/clang/tests/fuzz/fuzz_%.c.o \
  $(call obj,$(BUILD)/clang,tests/fuzz/fuzz.c tests/support/asan_options.c) $(BUILD)/clang/libassay.a | $(BUILD)/clang/oiio.so
	$(link)
programs-fuzz: $(patsubst %,$(BUILD)/clang/fuzz_%,$(FUZZ))
#: make fuzz       readers of files under libFuzzer (SECONDS_EACH=60; ONLY="collada engine": some of them)
fuzz: $(patsubst %,$(BUILD)/clang/fuzz_%,$(or $(ONLY),$(FUZZ)))
	tests/fuzz/run.sh $(BUILD) $(SECONDS_EACH) $(or $(ONLY),$(FUZZ))

# clang-tidy (.clang-tidy) over the programs, cppcheck over all C (.cppcheck-suppressions): no finding.
#: make lint       clang-tidy and cppcheck, the order of the folders: no finding (minutes; a part of make check)
LINT := $(MAINS) $(SOURCES)
lint: order $(BUILD)/deps-lint $(patsubst %,$(BUILD)/lint/%.ok,$(LINT) $(KERNELS)) $(BUILD)/lint/cppcheck.ok
	@echo '$(words $(LINT) $(KERNELS)) files, no finding'
order: all
	tests/lint/order.sh $(BUILD)
# A file is looked at again when its object is made again. One file for each process: with several, clang-tidy 14 takes
# every va_list but the first file's for one that was never started. Of a kernel the paths are followed for one instruction set,
# as only its intrinsics differ in the others. Paths are followed twice, through the functions that are called, and in each
# function by itself; what follows none is asked the first time. Of 125 faults planted in the functions with most paths this finds 65, clang's default (225000 nodes, through calls) 60
# in two and a half times the time.
PATHS := max-nodes=50000 ipa=none,max-nodes=5000
define clang_tidy
	$(call say,TIDY,$<)
	$(Q)mkdir -p $(@D); checks=$(2); for paths in $(if $(2),max-nodes=1,$(PATHS)); do \
	  clang-tidy --quiet $$checks $< -- -std=c17 -I. -D_XOPEN_SOURCE=700 $(pkg_cflags) $(1) -Xclang -analyzer-config -Xclang $$paths >$@.log 2>&1 || \
	    { cat $@.log; exit 1; }; checks=--checks=-bugprone-*,-performance-*,-cert-*,-misc-*; done; touch $@
endef
$(patsubst %,$(BUILD)/lint/%.ok,$(LINT)): $(BUILD)/lint/%.ok: % .clang-tidy $(BUILD)/%.o | $(BUILD)/deps-lint
	$(call clang_tidy,-DASSAY_VERSION='""' -DASSAY_COMMIT='""')
define kernel_lint
$(BUILD)/lint/$(1)_$(2).c.ok: $(1).c .clang-tidy $(BUILD)/$(1)_$(2).c.o | $(BUILD)/deps-lint
	$$(call clang_tidy,$(call isa_flags,$(2),$(1)),$(if $(filter sse42 avx512,$(2)),--checks=-clang-analyzer-*))
endef
$(foreach k,$(BY_ISA),$(foreach i,$(call isas_of,$(k)),$(eval $(call kernel_lint,$(k),$(i)))))
# Both are asked about planted faults first: who does not see them sees nothing (cppcheck is silent about a file that it cannot read).
cppcheck = cppcheck --enable=warning,performance,portability --std=c11 --quiet --inline-suppr --error-exitcode=1 \
  --suppressions-list=.cppcheck-suppressions -I. -D_XOPEN_SOURCE=700 -DISA=avx2 -DLANES=8 --include=tests/lint/jansson.h
$(BUILD)/lint/planted.ok: tests/lint/planted.c tests/lint/jansson.h .clang-tidy .cppcheck-suppressions | $(BUILD)/deps-lint
	$(Q)mkdir -p $(@D); ! $(cppcheck) $< 2>/dev/null || { echo 'cppcheck does not see a planted fault' >&2; exit 1; }
	$(Q)for paths in $(PATHS); do ! clang-tidy --quiet $< -- -std=c17 $(pkg_cflags) -Xclang -analyzer-config -Xclang $$paths >/dev/null 2>&1 || \
	  { echo 'clang-tidy does not see a planted fault' >&2; exit 1; }; done
	$(Q)touch $@
$(BUILD)/lint/cppcheck.ok: $(BUILD)/lint/planted.ok $(LINT) $(HEADERS) $(wildcard tests/*/*.[ch] tests/*/*/*.[ch])
	$(call say,CHECK,cppcheck)
	$(Q)case "$$(cppcheck --version)" in \
	  'Cppcheck 2.10'*) $(cppcheck) -i tests/lint renderer reference tools tests ;; \
	  *) echo "skip lint: cppcheck (what version 2.10 finds is read; this is $$(cppcheck --version))" ;; \
	esac && touch $@

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

#: make slurm      jobs on a Slurm cluster of four nodes on this machine, one killed (as root; a minute)
slurm: $(BUILD)/pathtracer $(BUILD)/assay $(BUILD)/deps-slurm
	tests/studies/scale/slurm.sh $(BUILD)
#: make distros    all of it in new minimal roots of Debian 12 and 13 (as root, with mmdebstrap: an hour and a half; SUITES=trixie STEPS="build live")
distros: $(BUILD)/deps-distros
	SUITES="$(SUITES)" tests/studies/distros/distros.sh $(BUILD)/distros $(STEPS)
#: make scale-live live references and validations in jobs, with Blender and POV-Ray (minutes)
scale-live: $(BUILD)/pathtracer $(BUILD)/assay $(BUILD)/deps-live
	tests/studies/scale/scale_live.sh $(BUILD)
#: make large      an image of 16384 x 16384 in jobs, within 2 GiB (30 GB of disk; SIDE=16384)
large: $(BUILD)/pathtracer $(BUILD)/assay $(BUILD)/deps-test
	tests/studies/scale/large.sh $(BUILD) $(or $(SIDE),16384)
#: make scale      simulate a class, a suite and a large image on up to 1000 nodes (tools/docs/background/scale.md)
scale: $(BUILD)/tests/make_scale
	$<

#: make pairs      scenes 5x and 6x: each level switched off, other ways to the same images, and the page of both
pairs: all
	nice python3 reference/pairs/knockout.py $(BUILD) -o reference/pairs/knockout.json
	nice python3 reference/pairs/runs.py $(BUILD) -o reference/pairs/runs.json
	python3 reference/pairs/pairs_page.py

#: make mutants    build each known bug into a renderer and see the suite find it (many minutes; ONLY="NAME ...")
mutants: all $(BUILD)/libassay.a
	tests/mutants/mutants.sh $(if $(ONLY),,--table tests/mutants/README.md) $(BUILD) $(ONLY)
#: make machine-mutants  the next mutants of a sample drawn by machine (SAMPLE=1; SECONDS_EACH=60: for so long)
MUTANT_TESTS = $(foreach b,$(BUILD) $(BUILD)/san,$(call program,$(b),$(wildcard tests/renderer/*/test_*.c tests/reference/*/test_*.c))) $(BUILD)/tests/image_change
machine-mutants: all $(BUILD)/libassay.a $(BUILD)/deps-test
	$(MAKE) -k WERROR= $(MUTANT_TESTS)
	tests/mutants/machine/run.py --build $(BUILD) prepare
	tests/mutants/machine/run.py --build $(BUILD) go $(or $(SAMPLE),1) --seconds $(SECONDS_EACH)
	tests/mutants/machine/run.py page
#: make catalogue  bring what assay diagnose knows of these bugs up to date (golden/diagnose)
catalogue: all $(BUILD)/libassay.a $(BUILD)/tests/make_catalogue
	tests/mutants/mutants.sh --build-only $(BUILD)
	$(BUILD)/tests/make_catalogue $(BUILD) tests/mutants golden/diagnose
#: make diagnose-rates  measure how often it is right (an hour)
diagnose-rates: catalogue $(BUILD)/tests/diagnose_rates
	$(BUILD)/tests/diagnose_rates $(BUILD) >$(BUILD)/diagnose_rates.md
	cp $(BUILD)/diagnose_rates.md golden/diagnose/README.md
#: make collada-cts  every file of Khronos' COLLADA conformance suite (COLLADA_CTS=DIR: a copy of it) through build/pathtracer
collada-cts: all
	tests/studies/collada_cts/collada_cts.py $(BUILD)/pathtracer $(COLLADA_CTS)
#: make blender-scenes  scenes made in Blender, through its COLLADA exporter, against Cycles (needs Blender; a minute)
blender-scenes: all
	tests/studies/blender/blender.sh $(BUILD)
#: make calibrate  measure error rates and power, write tests/studies/calibration/ (SHARE=0.01: a part of it)
calibrate: $(BUILD)/tests/make_calibration
	$< --threads $(shell nproc) $(if $(SHARE),--share $(SHARE) $(BUILD)/calibration,tests/studies/calibration)
#: make anchors    what our tests and the rules of other renderers find on the same images
#:                 (tests/studies/anchors; 20 CPU minutes)
anchors: $(BUILD)/tests/make_anchors $(BUILD)/oiio.so
	$< tests/studies/anchors
#: make bench      speed against Embree, Cycles and POV-Ray (BUILD/bench); bench-rays: a part of it
bench bench-rays: $(BUILD)/deps-test $(BUILD)/tests/bench $(BUILD)/pathtracer
	$(BUILD)/tests/bench --build $(BUILD) --out $(BUILD)/$@ $(patsubst bench-%,%,$(filter-out bench,$@))
#: make bvh-table  time the hierarchies and brute force on meshes in ASSAY_CS184 (minutes)
bvh-table: $(BUILD)/pathtracer
	tests/studies/bench/bvh_table.sh $(BUILD)
#: make rubric-bugs what known bugs do to the images of the rubrics that ship, or of RUBRICS="[--variant N] FILES"
rubric-bugs: RUBRICS ?= $(wildcard tools/rubrics/cs184-3-1*.rubric) --plain tools/rubrics/cs184-3-2.rubric
rubric-bugs: all $(BUILD)/deps-test $(BUILD)/libassay.a $(BUILD)/tests/make_rubric_bugs
	tests/mutants/mutants.sh --build-only $(BUILD)
	tests/mutants/mutants.sh --build-only --patches tests/studies/grading/bugs $(BUILD)
	$(BUILD)/tests/make_rubric_bugs $(BUILD) tests/mutants $(RUBRICS)

#: make writeup    the figures and tables of the course's write-up in one page (BUILD/writeup; 12 CPU minutes, and goes on
#:                 where it was ended; SHRINK=4: smaller images; VERDICTS=1: two scenes against Blender and POV-Ray, 8 more)
writeup: $(BUILD)/assay $(BUILD)/pathtracer
	VERDICTS=$(VERDICTS) tests/studies/writeup/writeup.sh $(BUILD) $(SHRINK)
#: make images     the two images that README shows (tools/docs/images)
images: $(BUILD)/assay $(BUILD)/pathtracer $(BUILD)/browser/package-lock.json
	$(BUILD)/assay validate -q --out $(BUILD)/images --only 12_point_plane --only 41_cornell --only 42_cornell_glass --only 46_sky --only 95_one_bounce_less
	$(BUILD)/pathtracer -q -r 360x360 -s 1024 -f $(BUILD)/images/render.png reference/scenes/42_cornell_glass.dae
	$(BUILD)/pathtracer -q -s 64 -r 240x180 --seed 1 -f $(BUILD)/images/1.exr reference/scenes/41_cornell.dae
	$(BUILD)/pathtracer -q -s 64 -r 240x180 --seed 2 -m 2 -f $(BUILD)/images/2.exr reference/scenes/41_cornell.dae
	$(BUILD)/assay compare -q --margin 0.01 --report $(BUILD)/images/compared.html $(BUILD)/images/1.exr $(BUILD)/images/2.exr || test $$? = 1
	node tests/browser/page_images.mjs $(BUILD)/browser $(BUILD)/images/index.html $(BUILD)/images/compared.html $(BUILD)/images/render.png tools/docs/images

# For tests/mutants.
print-compile:
	@echo $(CC) $(filter-out -g,$(cflags))
print-sanitize:
	@echo $(SANITIZE)
print-sanitized:
	@echo $(notdir $(filter $(BUILD)/san/%,$(CHECKED)))
print-libs:
	@echo $(LIBS)
print-kernels:
	@$(foreach k,$(BY_ISA),$(foreach i,$(call isas_of,$(k)),echo $(k)_$(i).c $(k).c $(call isa_flags,$(i),$(k));))

.PHONY: check lint order collada-cts blender-scenes threads tsan faults pairs slurm distros scale-live large scale coverage fuzz mutants machine-mutants catalogue diagnose-rates calibrate anchors \
  bench bench-rays bvh-table rubric-bugs writeup images print-compile print-sanitize print-sanitized print-libs print-kernels programs-san programs-clang programs-fuzz programs-no-memory
