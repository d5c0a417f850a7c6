# Assay. `make validate` and `make check` are the two commands; `make help` lists the rest.
# Everything is built under $(BUILD); nothing is written beside the sources except by `make golden`.

BUILD   ?= build
CC      ?= gcc
CXX     ?= g++
PREFIX  ?= /usr/local
SAN     ?=
WERROR  ?=
V       ?=

PKGS := libxml-2.0 OpenImageIO jansson gsl nettle
VERSION := 0.1
COMMIT := $(shell git rev-parse --short=12 HEAD 2>/dev/null || echo unknown)

WARN := -Wall -Wextra -Wshadow -Wstrict-prototypes -Wswitch-enum -Wvla $(if $(WERROR),-Werror)
OPT  := $(if $(SAN),-O1 -g -fno-omit-frame-pointer -fsanitize=$(SAN) -fno-sanitize-recover=all,-O3 -g -fno-math-errno -fno-trapping-math)
CFLAGS_ALL   = -std=c17 $(OPT) -ffp-contract=off $(WARN) -D_XOPEN_SOURCE=700 -pthread $(CFLAGS) $(shell pkg-config --cflags $(PKGS) 2>/dev/null | sed 's/-I/-isystem /g')
CXXFLAGS_ALL = -std=c++17 $(OPT) -Wall -Wextra $(if $(WERROR),-Werror) $(CXXFLAGS) $(shell pkg-config --cflags OpenImageIO 2>/dev/null | sed 's/-I/-isystem /g')
LIBS = $(shell pkg-config --libs $(PKGS) 2>/dev/null) -lm -pthread

Q := $(if $(V),,@)
say = $(if $(V),,@printf '  %-5s %s\n' $(1) $(2))

RENDERER  := $(filter-out renderer/main.c,$(wildcard renderer/*.c)) $(wildcard renderer/*.cc)
HARNESS   := $(wildcard reference/*.c) $(filter-out tools/main.c,$(wildcard tools/*.c))
TESTS     := $(wildcard tests/test_*.c)
obj        = $(patsubst %,$(BUILD)/%.o,$(1))

all: $(BUILD)/pathtracer $(BUILD)/assay

$(BUILD)/pathtracer: $(call obj,renderer/main.c $(RENDERER))
	$(call say,LINK,$@)
	$(Q)$(CXX) $(OPT) -o $@ $^ $(LIBS)

$(BUILD)/assay: $(call obj,tools/main.c $(HARNESS) $(RENDERER))
	$(call say,LINK,$@)
	$(Q)$(CXX) $(OPT) -o $@ $^ $(LIBS)

$(BUILD)/tests/%: $(BUILD)/tests/%.c.o $(BUILD)/libassay.a
	$(call say,LINK,$@)
	$(Q)$(CXX) $(OPT) -o $@ $< $(BUILD)/libassay.a $(LIBS) -lcmocka $(TEST_LIBS)

$(BUILD)/libassay.a: $(call obj,$(HARNESS) $(RENDERER))
	$(call say,AR,$@)
	$(Q)rm -f $@ && ar rcs $@ $^

$(BUILD)/%.c.o: %.c
	$(call say,CC,$<)
	$(Q)mkdir -p $(@D) && $(CC) $(CFLAGS_ALL) -MMD -MP -c -o $@ $<

# Only version.c knows the commit, and is built again when that changes.
$(BUILD)/renderer/version.c.o: CFLAGS += -DASSAY_VERSION='"$(VERSION)"' -DASSAY_COMMIT='"$(COMMIT)"'
$(BUILD)/renderer/version.c.o: $(BUILD)/commit
$(BUILD)/commit: FORCE
	$(Q)mkdir -p $(@D) && echo $(VERSION) $(COMMIT) | cmp -s - $@ || echo $(VERSION) $(COMMIT) > $@
FORCE:

$(BUILD)/%.cc.o: %.cc
	$(call say,CXX,$<)
	$(Q)mkdir -p $(@D) && $(CXX) $(CXXFLAGS_ALL) -MMD -MP -c -o $@ $<

clean:
	rm -rf $(BUILD)

.PHONY: all clean FORCE
.SECONDARY:
-include $(shell find $(BUILD) -name '*.d' 2>/dev/null)
