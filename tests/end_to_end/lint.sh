#!/bin/bash
# tests/end_to_end/lint.sh BUILD: `make lint` as one of the tests. Prints "ok NAME" or "not ok NAME: why".
build=${1:?usage: tests/end_to_end/lint.sh BUILD}
if make --no-print-directory -k -j1 BUILD="$build" lint >"$build/lint.log" 2>&1; then
    echo "ok lint: $(tail -n 1 "$build/lint.log")"
    grep '^skip ' "$build/lint.log"
    exit 0
else
    echo "not ok lint: $(grep -E '(error|warning): |planted|\*\*\*' "$build/lint.log" | grep -v '^make.*warning: ' | head -n 20)"
    exit 1
fi
