#!/bin/bash
# tests/end_to_end/library.sh BUILD: libassay as others use it: installed, found by pkg-config, from C and C++, with no
# other symbols than its header's; the Python package from the sources and by pip. Prints "ok NAME", "not ok NAME: why"
# or "skip NAME".
set -u
build=$(realpath "${1:?usage: tests/end_to_end/library.sh BUILD}")
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0 what=library
. tests/end_to_end/expect.sh

make -s install BUILD="$build" PREFIX="$tmp/usr" >"$tmp/install.log" 2>&1
tell "it installs" "$([ -e "$tmp/usr/lib/libassay.so.1" ] || tail -n 3 "$tmp/install.log")"
tell "its symbols are those of its header" "$(diff \
    <(nm -D --defined-only "$tmp/usr/lib/libassay.so.1" | sed -n 's/.* T \([^@]*\).*/\1/p' | sort) \
    <(grep -oE '\bassay_[a-z_]+\(' tools/library/assay.h | tr -d '(' | sort -u))"
tell "it prints nothing and ends nobody" "$(for object in "$build"/tools/library/*.o; do
    nm "$object" | grep -wE 'U (printf|puts|putchar|exit|abort|stdout|stderr)'
done)"

# A program that knows the installed header alone; the difference it prints is 3 %.
cat >"$tmp/client.c" <<'END'
#include <assay.h>
#include <stdio.h>
int main(void)
{
    static double n[64], a[64], b[64], m2[64];
    struct assay_side mine = {0}, truth;
    struct assay_options options;
    struct assay_comparison *c;
    char error[ASSAY_ERROR_SIZE];
    for (int i = 0; i < 64; i++) {
        n[i] = 1;
        a[i] = 1.03;
        b[i] = 1;
    }
    mine.width = mine.height = 8;
    mine.channels = 1;
    mine.n = n;
    mine.mean = a;
    mine.m2 = m2;
    mine.unit = "exact";
    truth = mine;
    truth.mean = b;
    assay_options_init(&options, sizeof options);
    options.margin = 0.01;
    if (assay_abi() != ASSAY_ABI || !assay_compare(&mine, &truth, &options, &c, error))
        return 3;
    printf("%s %.3f\n", assay_verdict_name(assay_result_of(c)->verdict), assay_result_of(c)->image.difference);
    assay_free(c);
    return 0;
}
END
cp "$tmp/client.c" "$tmp/client.cc"
flags=$(PKG_CONFIG_PATH=$tmp/usr/lib/pkgconfig pkg-config --cflags --libs assay)
for compiler in "cc -std=c99 -pedantic client.c" "c++ -std=c++11 -pedantic client.cc"; do
    # shellcheck disable=SC2086
    (cd "$tmp" && $compiler -Wall -Wextra -Werror -o client $flags -Wl,--no-as-needed $flags) >"$tmp/cc.log" 2>&1
    expect "a client by ${compiler%% *}" 0 "^DIFFERENT 0.030" env LD_LIBRARY_PATH="$tmp/usr/lib" "$tmp/client"
done

python=/usr/bin/python3
if ! $python -c 'import numpy, pytest' 2>/dev/null; then
    echo "skip library: Python (no python3-numpy or python3-pytest)"
    exit $((failures > 0))
fi
pytest() { # NAME PYTHON
    PYTHONDONTWRITEBYTECODE=1 ASSAY="$build/assay" "$2" -m pytest -q -p no:cacheprovider -rA tests/tools/python >"$tmp/pytest.out" 2>&1
    sed -n "s,^PASSED [^:]*::\([^ ]*\).*,ok $what: $1: \1,p" "$tmp/pytest.out"
    tell "$1: pytest" "$(grep -qE '^[0-9]+ passed in' "$tmp/pytest.out" || tail -n 40 "$tmp/pytest.out")"
}
PYTHONPATH=$PWD/tools/python ASSAY_LIBRARY=$build/libassay.so.1 pytest "Python from the sources" $python
tell "Python: without the library it says what to set" "$(PYTHONPATH=$PWD/tools/python ASSAY_LIBRARY=/nowhere.so $python -B -c 'import assay' 2>&1 |
    grep -q 'ImportError: cannot load libassay (set ASSAY_LIBRARY=PATH): /nowhere.so' || echo "another message")"

# By pip, into a virtual environment; it must leave nothing beside the sources.
if $python -c 'import venv, ensurepip, setuptools, wheel' 2>/dev/null && $python -m venv --system-site-packages "$tmp/venv" >"$tmp/pip.log" 2>&1; then
    git status --porcelain --ignored -- tools >"$tmp/before"
    "$tmp/venv/bin/pip" install --no-build-isolation --no-index tools/python >>"$tmp/pip.log" 2>&1
    expect "pip installs it, library and all" 0 "^$tmp/venv/.* EQUIVALENT" env -C "$tmp" venv/bin/python -c "
import assay, numpy
r = [numpy.random.default_rng(s).gamma(4, .25, (8, 32, 32, 3)) for s in (1, 2)]
print(assay.__file__, assay.compare(*r, margin=.05).verdict)"
    tell "pip leaves nothing beside the sources" "$(diff "$tmp/before" <(git status --porcelain --ignored -- tools))"
else
    echo "skip library: pip (no python3-venv, python3-pip, python3-setuptools or python3-wheel)"
fi
exit $((failures > 0))
