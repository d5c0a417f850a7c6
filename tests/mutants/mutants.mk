# Renderers with a known bug each, and what is measured on them.

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
#: make rubric-bugs what known bugs do to the images of the rubrics that ship, or of RUBRICS="[--variant N] FILES"
rubric-bugs: RUBRICS ?= tools/rubrics/cs184-3-1.rubric tools/rubrics/cs184-3-1-before-2024.rubric --plain tools/rubrics/cs184-3-2.rubric
rubric-bugs: all $(BUILD)/deps-test $(BUILD)/libassay.a $(BUILD)/tests/make_rubric_bugs
	tests/mutants/mutants.sh --build-only $(BUILD)
	tests/mutants/mutants.sh --build-only --patches tests/studies/grading/bugs $(BUILD)
	$(BUILD)/tests/make_rubric_bugs $(BUILD) tests/mutants $(RUBRICS)

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

.PHONY: mutants machine-mutants catalogue diagnose-rates rubric-bugs print-compile print-sanitize print-sanitized print-libs print-kernels
