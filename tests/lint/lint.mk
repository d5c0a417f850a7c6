# `make lint`: clang-tidy, cppcheck and the order of the folders.

# clang-tidy (.clang-tidy) over the programs, cppcheck over all C (.cppcheck-suppressions): no finding.
#: make lint       clang-tidy and cppcheck, the order of the folders: no finding (minutes; a part of make check)
LINT := $(MAINS) $(SOURCES)
lint: order $(BUILD)/deps-lint $(patsubst %,$(BUILD)/lint/%.ok,$(LINT) $(KERNELS)) $(BUILD)/lint/cppcheck.ok
	@echo '$(words $(LINT) $(KERNELS)) files, no finding'
order: all
	tests/lint/order.sh $(BUILD)
# A file is looked at again when its object is made again. One file for each process: with several, clang-tidy 14 takes
# every va_list but the first file's for one that was never started. Of a kernel the paths are followed for one instruction set,
# as only its intrinsics differ in the others. Paths are followed twice, through calls of short functions, and in each function by
# itself; what follows none is asked the first time. Planted at the end of 60 functions, half of them among the 100 with most branches,
# an access of freed memory behind a call is found in 48, as with five times the nodes and all functions followed, in 0.4 of the time;
# a null pointer in 50.
PATHS := max-inlinable-size=20,max-nodes=10000 ipa=none,max-nodes=5000
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

.PHONY: lint order
