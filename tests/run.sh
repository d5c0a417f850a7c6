#!/bin/bash
# tests/run.sh BUILD PROGRAM...: runs the test programs, the end-to-end tests, `make lint` and a fixed run of each fuzzer, and ends with the line
# "N passed, N failed[, N skipped]". A program that dies, or that runs no test, counts as failed.
set -u
build=${1:?usage: tests/run.sh BUILD PROGRAM...}
shift
programs=("$@")
passed=0 failed=0 skipped=0
log=$build/check
rm -rf "$log"
mkdir -p "$log"

# cmocka's own lines: "[       OK ] name", "[  FAILED  ] name", "[  SKIPPED ] name".
count() {
    grep -c "^\[ *$1 *\] [a-z]" "$2"
}

# run_job LOG PROGRAM BUILD: its output, exit status and seconds into files, so that jobs may run side by
# side. Test programs take no arguments; scripts take BUILD.
run_job() {
    local log=$1 name start=$SECONDS
    name=$(basename "$2" .sh)
    case $2 in
    */fuzz.sh) tests/fuzz/run.sh -j 1 "$3" fixed ;;
    *.sh) "$2" "$3" ;;
    *) "$2" ;;
    esac >"$log/$name.out" 2>&1
    echo "$? $((SECONDS - start))" >"$log/$name.status"
}
export -f run_job

# The longest first: one more than there are processors at a time, since some wait for other programs.
{
    echo tests/end_to_end/end_to_end.sh
    echo tests/end_to_end/lint.sh
    echo tests/end_to_end/docs.sh
    echo tests/fuzz.sh
    long='/test_(approve|calibration|cycles.*|embree|materials|povray.*|statistics|suite_scenes)$'
    printf '%s\n' "${programs[@]}" | grep -E "$long"
    printf '%s\n' "${programs[@]}" | grep -vE "$long"
} | xargs -I{} -P "$(($(nproc) + 1))" bash -c 'run_job "$0" {} "$1"' "$log" "$build"

for program in "${programs[@]}"; do
    name=$(basename "$program")
    status=127 seconds=0
    read -r status seconds <"$log/$name.status"
    # The lines carry the name twice where a test fails; only the first list is counted.
    sed '/^\[==========\].* run\.$/q' "$log/$name.out" >"$log/$name.first"
    p=$(count OK "$log/$name.first") f=$(count FAILED "$log/$name.first")
    s=$(count SKIPPED "$log/$name.first")
    if [ "$status" -ne 0 ] && [ "$f" -eq 0 ] || [ $((p + f + s)) -eq 0 ]; then
        f=$((f + 1))
        echo "$name: died with status $status"
    fi
    if [ "$f" -gt 0 ]; then
        cat "$log/$name.out"
        sed -n "s/^\[ *FAILED *\] \([a-z]\)/$name: \1/p" "$log/$name.first" >>"$log/failed"
        grep -q "^$name: " "$log/failed" || echo "$name: died with status $status" >>"$log/failed"
    fi
    [ "$s" -gt 0 ] && grep -i "skip" "$log/$name.out"
    printf '%-24s %3d passed, %d failed, %d skipped  (%d s)\n' "$name" "$p" "$f" "$s" "$seconds"
    passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
done

# Lines "ok ...", "not ok ..." and "skip ...".
for name in end_to_end lint docs fuzz; do
    status=127 seconds=0
    read -r status seconds <"$log/$name.status"
    p=$(grep -c '^ok ' "$log/$name.out") f=$(grep -c '^not ok ' "$log/$name.out")
    s=$(grep -c '^skip ' "$log/$name.out")
    if [ "$status" -ne 0 ] && [ "$f" -eq 0 ] || [ $((p + f)) -eq 0 ]; then
        f=$((f + 1))
        echo "$name: died with status $status"
    fi
    if [ "$f" -gt 0 ]; then
        cat "$log/$name.out"
        grep '^not ok ' "$log/$name.out" >>"$log/failed" || echo "$name: died with status $status" >>"$log/failed"
    fi
    [ "$s" -gt 0 ] && grep '^skip ' "$log/$name.out"
    printf '%-24s %3d passed, %d failed, %d skipped  (%d s)\n' "$name" "$p" "$f" "$s" "$seconds"
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
