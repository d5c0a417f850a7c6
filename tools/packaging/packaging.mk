# Distribution: the shared library, the autograder's zip, Debian packages, installation.

PREFIX   ?= /usr/local
RUBRIC   ?= tools/rubrics/cs184-3-1.rubric
DEPS_DEB := dpkg-dev

# libassay.so (tools/library/assay.h): what comparing images needs, as position-independent code whose functions cannot
# be interposed.
LIBRARY_ABI     := 1
LIBRARY_SOURCES := $(wildcard $(addsuffix /*.c,$(addprefix renderer/,base math image) reference/base reference/suite \
  $(addprefix tools/,images stats compare exact input sequential results html plots report library)) \
  $(addprefix tools/base/,temp_dir.c text.c text_table.c) tools/validate/compare_job.c tools/validate/same_program.c)
$(call obj,$(BUILD),$(LIBRARY_SOURCES)): CFLAGS += -fPIC -fno-semantic-interposition
$(BUILD)/libassay.so.$(LIBRARY_ABI): $(call obj,$(BUILD),$(LIBRARY_SOURCES)) tools/library/assay.map | $(BUILD)/oiio.so
	$(call say,LINK,$@)
	$(Q)$(CXX) $(OPT) -shared -Wl,-soname,$(@F) -Wl,--version-script=tools/library/assay.map -Wl,-z,defs -Wl,--gc-sections \
	  -o $@ $(filter %.o,$^) $(LIBS) -ldl && ln -sf $(@F) $(BUILD)/libassay.so
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

share := $(DESTDIR)$(PREFIX)/share/assay
#: make install    into PREFIX=/usr/local (DESTDIR=: below it)
install: all library
	install -d $(DESTDIR)$(PREFIX)/bin $(share)/cycles $(share)/import_check $(DESTDIR)$(PREFIX)/share/man/man1
	install -m 644 renderer/pathtracer/pathtracer.1 $(DESTDIR)$(PREFIX)/share/man/man1
	tools/packaging/manual.sh $(BUILD) $(BUILD)/manual
	install -m 644 $(BUILD)/manual/man1/* $(DESTDIR)$(PREFIX)/share/man/man1
	install -d $(DESTDIR)$(PREFIX)/share/bash-completion/completions $(DESTDIR)$(PREFIX)/share/zsh/site-functions
	install -m 644 $(BUILD)/manual/bash-completion/* $(DESTDIR)$(PREFIX)/share/bash-completion/completions
	install -m 644 $(BUILD)/manual/zsh/* $(DESTDIR)$(PREFIX)/share/zsh/site-functions
	install -m 755 $(BUILD)/pathtracer $(BUILD)/assay $(DESTDIR)$(PREFIX)/bin
	install -D -m 755 $(BUILD)/oiio.so $(DESTDIR)$(PREFIX)/lib/assay/oiio.so
	install -D -m 644 tools/library/assay.h $(DESTDIR)$(PREFIX)/include/assay.h
	install -m 755 $(BUILD)/libassay.so.$(LIBRARY_ABI) $(DESTDIR)$(PREFIX)/lib
	ln -sf libassay.so.$(LIBRARY_ABI) $(DESTDIR)$(PREFIX)/lib/libassay.so
	install -d $(DESTDIR)$(PREFIX)/lib/pkgconfig
	sed 's,@PREFIX@,$(PREFIX),; s,@VERSION@,$(VERSION),' tools/library/assay.pc.in >$(DESTDIR)$(PREFIX)/lib/pkgconfig/assay.pc
	install -m 644 reference/cycles/*.py $(share)/cycles
	install -m 644 reference/import_check/*.py $(share)/import_check
	install -m 644 tools/docs/formats/*.schema.json $(share)
	cp -R reference/scenes reference/engines reference/starter golden tools/rubrics $(share)

.PHONY: library autograder deb install
