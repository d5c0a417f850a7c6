# Distribution: the shared library, the autograder's zip, Debian packages, installation.

PREFIX   ?= /usr/local
RUBRIC   ?= tools/rubrics/cs184-3-1.rubric
DEPS_DEB := dpkg-dev

# libassay.so (tools/library/assay.h): what comparing images needs, as position-independent code whose functions cannot
# be interposed.
LIBRARY_ABI     := 1
LIBRARY_SOURCES := $(wildcard $(addsuffix /*.c,$(addprefix renderer/,base math image) reference/base reference/suite \
  $(addprefix tools/,images stats compare exact input sequential results html plots report library)) \
  $(addprefix reference/replicates/,independence.c replicates.c shared_noise.c) $(addprefix tools/base/,temp_dir.c text.c text_table.c) \
  tools/validate/compare_job.c tools/exact/same_program.c)
$(call obj,$(BUILD),$(LIBRARY_SOURCES)): defs += -fPIC -fno-semantic-interposition
$(BUILD)/libassay.so.$(LIBRARY_ABI): $(call obj,$(BUILD),$(LIBRARY_SOURCES)) tools/library/assay.map | $(BUILD)/oiio.so
	$(call say,LINK,$@)
	$(Q)$(CXX) $(OPT) -shared -Wl,-soname,$(@F) -Wl,--version-script=tools/library/assay.map -Wl,-z,defs -Wl,--gc-sections \
	  -o $@ $(filter %.o,$^) $(LDFLAGS) $(LIBS) -ldl && ln -sf $(@F) $(BUILD)/libassay.so
#: make library    build/libassay.so (tools/library/assay.h); from Python: pip install --no-build-isolation tools/python
library: $(BUILD)/libassay.so.$(LIBRARY_ABI)

#: make autograder BUILD/autograder.zip for Gradescope (RUBRIC=tools/rubrics/cs184-3-1.rubric)
autograder: all $(BUILD)/deps-test
	tools/autograder/pack.sh $(BUILD) $(RUBRIC) $(BUILD)/autograder.zip '$(COMMIT)' $(DEPS)

#: make deb        Debian packages into BUILD/deb
deb: all library $(BUILD)/deps-deb
	tools/packaging/deb.sh $(BUILD) $(VERSION) $(BUILD)/deb
$(BUILD)/deps-deb: | $(BUILD)/deps
	$(call install_missing,$(DEPS_DEB))

at    := "$(DESTDIR)$(PREFIX)"
share := $(at)/share/assay
#: make install    into PREFIX=/usr/local (DESTDIR=: below it)
install: all library
	install -d $(at)/bin $(share)/cycles $(share)/import_check $(at)/share/man/man1
	install -m 644 renderer/pathtracer/pathtracer.1 $(at)/share/man/man1
	tools/packaging/manual.sh $(BUILD) $(BUILD)/manual
	install -m 644 $(BUILD)/manual/man1/* $(at)/share/man/man1
	install -d $(at)/share/bash-completion/completions $(at)/share/zsh/site-functions
	install -m 644 $(BUILD)/manual/bash-completion/* $(at)/share/bash-completion/completions
	install -m 644 $(BUILD)/manual/zsh/* $(at)/share/zsh/site-functions
	install -m 755 $(BUILD)/pathtracer $(BUILD)/assay $(at)/bin
	install -D -m 755 $(BUILD)/oiio.so $(at)/lib/assay/oiio.so
	install -D -m 644 tools/library/assay.h $(at)/include/assay.h
	install -m 755 $(BUILD)/libassay.so.$(LIBRARY_ABI) $(at)/lib
	ln -sf libassay.so.$(LIBRARY_ABI) $(at)/lib/libassay.so
	install -d $(at)/lib/pkgconfig
	sed 's,@PREFIX@,$(PREFIX),; s,@VERSION@,$(VERSION),' tools/library/assay.pc.in >$(at)/lib/pkgconfig/assay.pc
	chmod 644 $(at)/lib/pkgconfig/assay.pc
	install -m 644 reference/cycles/*.py $(share)/cycles
	install -m 644 reference/import_check/*.py $(share)/import_check
	install -m 644 tools/docs/formats/*.schema.json $(share)
	cp -R reference/scenes reference/engines reference/starter golden tools/rubrics $(share)
	chmod -R u=rwX,go=rX $(share)
# Otherwise the loader does not find the library at once, even where it looks, as in /usr/local/lib.
	test -n "$(DESTDIR)" || test "$$(id -u)" != 0 || PATH="$$PATH:/sbin" ldconfig || true

.PHONY: library autograder deb install
