#!/bin/bash
# tests/coverage.sh BUILD PROGRAM...: runs the test programs, built with clang's counters into BUILD/cov, and the end-to-end runs with
# the programs built so, and prints which share of the lines of each file of renderer/ and tools/ they reach. Ends with the
# two sums; fails below 90 %. What a test program says goes to BUILD/cov/log: whether they pass is `make check`'s business.
# SKIP_END_TO_END=1: the test programs alone.
set -u
build=$(realpath "${1:?usage: tests/coverage.sh BUILD PROGRAM...}")
shift
cov=$build/cov
export LLVM_PROFILE_FILE=$cov/profile/%4m.profraw
rm -rf "$cov/profile" "$cov/log"
mkdir -p "$cov/profile" "$cov/log"
printf '%s\n' "$@" | xargs -P "$(nproc)" -I{} sh -c '"{}" >"$0/$(basename "{}")" 2>&1' "$cov/log"
if [ -z "${SKIP_END_TO_END:-}" ]; then
    # The end-to-end runs want two builds, what the benchmark and the browser need, and build mutants.
    ln -sfn . "$cov/san"
    ln -sfn "$build/browser" "$cov/browser"
    ln -sf "$build/tests/bench" "$cov/tests/bench"
    tests/end_to_end.sh "$cov" >"$cov/log/end_to_end" 2>&1
    grep '^not ok' "$cov/log/end_to_end"
fi
llvm-profdata merge -sparse -o "$cov/profile/all" "$cov"/profile/*.profraw || exit 1
objects=()
for program in "$cov/assay" "$@"; do
    objects+=(-object "$program")
done
llvm-cov report "$cov/pathtracer" "${objects[@]}" -instr-profile="$cov/profile/all" \
    -ignore-filename-regex='(^/usr|tests/|reference/)' -show-region-summary=0 -show-branch-summary=0 2>"$cov/log/llvm-cov" >"$cov/report"
# Columns: file, functions, missed, %, lines, missed, %.
awk -v here="$PWD/" '
    /\.(c|h|cc) / {
        sub(here, "", $1)
        part = $1 ~ /tools\// || $1 ~ /^(verb_|report|grade)/ ? "tools" : "renderer"
        lines[part] += $5; missed[part] += $6
        printf "%6.1f %%  %5d lines  %s\n", 100 * ($5 - $6) / ($5 > 0 ? $5 : 1), $5, $1
    }
    END {
        low = 0
        for (p in lines) {
            share = 100 * (lines[p] - missed[p]) / lines[p]
            printf "%s: %.1f %% of %d lines\n", p, share, lines[p]
            low = low || share < 90
        }
        exit low || lines["tools"] == 0 || lines["renderer"] == 0
    }' "$cov/report"
