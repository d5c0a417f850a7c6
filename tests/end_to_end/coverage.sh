#!/bin/bash
# tests/end_to_end/coverage.sh BUILD PROGRAM...: runs the test programs, built with clang's counters into BUILD/cov, the
# end-to-end runs with programs built so, and one validation with live engines. Prints the share of lines that they
# reach, for each file of renderer/, reference/ and tools/, then for these three; fails if it is below 90 % for one of
# the three. BUILD/cov/missed lists the lines not reached. Outputs of the tests go to BUILD/cov/log; whether they pass
# is left to `make check`.
# SKIP_END_TO_END=1: the test programs alone.
set -u
build=$(realpath "${1:?usage: tests/end_to_end/coverage.sh BUILD PROGRAM...}")
shift
cov=$build/cov
export LLVM_PROFILE_FILE=$cov/profile/%4m.profraw
rm -rf "$cov/profile" "$cov/log"
mkdir -p "$cov/profile" "$cov/log"
{
    # The longest first.
    [ -z "${SKIP_END_TO_END:-}" ] && sed "/^#/d; /^lint\|^docs\|^fuzz/d; s#BUILD#$cov#; s#PLAIN#$build#" tests/scripts.txt
    long='/test_(approve|calibration|compare_rates|converge|cycles.*|statistics|suite_scenes)$'
    printf '%s\n' "$@" | grep -E "$long"
    printf '%s\n' "$@" | grep -vE "$long"
} | sed 's#^/.*/\(.*\)#\1 &#' >"$cov/jobs"
# The end-to-end runs expect two builds, the benchmark, what the browser needs, and the version.
ln -sfn . "$cov/san"
ln -sfn "$build/browser" "$cov/browser"
ln -sf "$build/tests/bench" "$cov/tests/bench"
ln -sf "$build/commit" "$cov/commit"
export PLAIN_BUILD=$build
# A name and a command each.
xargs -P "$(nproc)" -L 1 sh -c 'name=$1; shift; "$@" >"$0/log/$name" 2>&1' "$cov" <"$cov/jobs"
# What .ci/run adds: the other engines, live on one scene.
if [ -z "${SKIP_END_TO_END:-}" ] && command -v blender >/dev/null && command -v povray >/dev/null; then
    "$cov/assay" validate -q --live --only 13_square_patch -o "$cov/live" >"$cov/log/live" 2>&1
fi
grep -h '^not ok' "$cov"/log/*
llvm-profdata merge -sparse -o "$cov/profile/all" "$cov"/profile/*.profraw || exit 1
objects=()
for program in "$cov/assay" "$cov/oiio.so" "$@"; do
    objects+=(-object "$program")
done
llvm-cov export -format=lcov "$cov/pathtracer" "${objects[@]}" -instr-profile="$cov/profile/all" \
    -ignore-filename-regex='(^/usr|tests/)' 2>"$cov/log/llvm-cov" >"$cov/lcov"
# lcov's format: SF:file, then DA:line,count for each of its lines.
awk -F '[:,]' -v here="$PWD/" -v missed_lines="$cov/missed" '
    $1 == "SF" { file = substr($0, 4); sub(here, "", file); part = file; sub(/\/.*/, "", part); order[++files] = file }
    $1 == "DA" {
        lines[file]++; lines[part]++
        if ($3 == 0) { missed[file]++; missed[part]++; which[file] = which[file] " " $2 }
    }
    function tell(name) { return sprintf("%6.1f %% of %5d lines  %s", 100 * (lines[name] - missed[name]) / lines[name], lines[name], name) }
    END {
        for (i = 1; i <= files; i++) {
            print tell(order[i])
            if (missed[order[i]] > 0) print order[i] ":" which[order[i]] >missed_lines
        }
        split("renderer reference tools", name, " ")
        for (i = 1; i <= 3; i++) {
            print tell(name[i])
            low = low || lines[name[i]] == 0 || missed[name[i]] > 0.1 * lines[name[i]]
        }
        exit low
    }' "$cov/lcov"
