#!/bin/bash
# tests/run.sh BUILD PROGRAM...: runs the test programs and the scripts of tests/scripts.txt, and ends with the line
# "N passed, N failed[, N skipped]". A program that dies, or that runs no test, counts as failed.
set -u
build=${1:?usage: tests/run.sh BUILD PROGRAM...}
shift
programs=("$@")
passed=0 failed=0 skipped=0
log=$build/check
rm -rf "$log"
mkdir -p "$log"
# Debian's python3, for which the tests' packages are, whatever another one is first.
export PATH=/usr/bin:$PATH
# Blender's own scripts take half a second to compile at each start, where nothing may be written beside them.
export PYTHONPYCACHEPREFIX=$(realpath "$log")/python PYTHONDONTWRITEBYTECODE=
# Memory that was freed is used again, not given back and asked for anew: some machines take ten microseconds for a page.
export MALLOC_TOP_PAD_=16777216 MALLOC_MMAP_THRESHOLD_=33554432 MALLOC_TRIM_THRESHOLD_=268435456

# run_job LOG NAME COMMAND...: its output, exit status and CPU seconds into files, so that jobs may run side by side.
run_job() {
    local log=$1 name=$2 status
    shift 2
    "$@" >"$log/$name.out" 2>&1
    status=$?
    # The second line: user and system time of all children, as 1m2.345s.
    times >"$log/$name.times"
    echo "$status $(awk -F '[ms ]+' 'NR == 2 { printf "%d", 60 * ($1 + $3) + $2 + $4 }' "$log/$name.times")" >"$log/$name.status"
}
export -f run_job

# The tests that are scripts, with the long programs among them, then the short ones: two jobs more than there are processors, since
# some wait, for POV-Ray's threads to start or for a sandbox's time to run out.
scripts() { sed "s#PLAIN#${PLAIN_BUILD:-$build}#; s#BUILD#$build#; /^\#/d" tests/scripts.txt; }
programs() { for p in "${programs[@]}"; do echo "$(basename "$p") $p"; done; }
long='/test_(approve|calibration|cycles.*|embree|materials|povray.*|statistics|suite_scenes)$'
{
    scripts | head -n 2
    programs | grep -E "$long"
    scripts | tail -n +3
    programs | grep -vE "$long"
} | xargs -L 1 -P "$(($(nproc) + 2))" bash -c 'run_job "$0" "$@"' "$log"

# Lines "ok ...", "not ok ..." and "skip ..."; of a test program cmocka's own: "[       OK ] name", "[  FAILED  ] name", "[  SKIPPED ] name",
# which come twice where a test fails: only the first list is counted.
for name in $({ programs && scripts; } | cut -d ' ' -f 1); do
    status=127 seconds=0
    read -r status seconds <"$log/$name.status"
    sed -E '/^\[==========\].* run\.$/q; s/^\[ *OK *\] ([a-z])/ok \1/; s/^\[ *FAILED *\] ([a-z])/not ok \1/; s/^\[ *SKIPPED *\] ([a-z])/skip \1/' \
        "$log/$name.out" >"$log/$name.results"
    p=$(grep -c '^ok ' "$log/$name.results") f=$(grep -c '^not ok ' "$log/$name.results") s=$(grep -c '^skip ' "$log/$name.results")
    if [ "$status" -ne 0 ] && [ "$f" -eq 0 ] || [ $((p + f + s)) -eq 0 ]; then
        f=$((f + 1))
        echo "not ok died with status $status" | tee -a "$log/$name.results"
    fi
    if [ "$f" -gt 0 ]; then
        cat "$log/$name.out"
        sed -n "s/^not ok /$name: /p" "$log/$name.results" >>"$log/failed"
    fi
    [ "$s" -gt 0 ] && grep -i '^skip\(ped:\)\? ' "$log/$name.out"
    printf '%-24s %3d passed, %d failed, %d skipped  (%d CPU s)\n' "$name" "$p" "$f" "$s" "$seconds"
    passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
done

# Once more and together: a log is read from its end.
if [ -s "$log/failed" ]; then
    echo "failed:"
    sort -u "$log/failed"
fi
if [ $skipped -gt 0 ]; then
    echo "$passed passed, $failed failed, $skipped skipped"
else
    echo "$passed passed, $failed failed"
fi
[ $failed -eq 0 ] && [ $passed -gt 0 ]
