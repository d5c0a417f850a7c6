#!/bin/bash
# Runs every test program of BUILD/san/tests and the end-to-end tests, and ends with the line
# "N passed, N failed[, N skipped]". A program that dies, or that runs no test, counts as failed.
set -u
build=${1:?usage: tests/run.sh BUILD}
passed=0 failed=0 skipped=0
log=$build/check
rm -rf "$log"
mkdir -p "$log"

# cmocka's own lines: "[       OK ] name", "[  FAILED  ] name", "[  SKIPPED ] name".
count() {
    grep -c "^\[ *$1 *\] [a-z]" "$2"
}

# One job: its output, exit status and seconds into files, so that jobs may run side by side.
run_job() {
    local log=$1 name=$2 start=$SECONDS
    shift 2
    "$@" >"$log/$name.out" 2>&1
    echo "$? $((SECONDS - start))" >"$log/$name.status"
}
export -f run_job

programs=()
for program in "$build"/san/tests/test_*; do
    case $program in *.o | *.d) continue ;; esac
    programs+=("$program")
done
# The longest first: as many as there are processors at a time.
{
    echo "end_to_end tests/end_to_end.sh $build"
    for program in "${programs[@]}"; do
        case $program in */test_calibration | */test_cycles* | */test_povray* | */test_embree | */test_lights) echo "$(basename "$program") $program" ;; esac
    done
    for program in "${programs[@]}"; do
        case $program in */test_calibration | */test_cycles* | */test_povray* | */test_embree | */test_lights) ;; *) echo "$(basename "$program") $program" ;; esac
    done
} | xargs -L 1 -P "$(nproc)" bash -c 'run_job "$0" "$@"' "$log"

for program in "${programs[@]}"; do
    name=$(basename "$program")
    status=127 seconds=0
    read -r status seconds <"$log/$name.status"
    # The lines carry the name twice where a test fails; only the first list is counted.
    sed '/^\[==========\] [0-9]* test/q' "$log/$name.out" >"$log/$name.first"
    p=$(count OK "$log/$name.first") f=$(count FAILED "$log/$name.first")
    s=$(count SKIPPED "$log/$name.first")
    if [ "$status" -ne 0 ] && [ "$f" -eq 0 ] || [ $((p + f + s)) -eq 0 ]; then
        f=$((f + 1))
        echo "$name: died with status $status"
    fi
    [ "$f" -gt 0 ] && cat "$log/$name.out"
    [ "$s" -gt 0 ] && grep -i "skip" "$log/$name.out"
    printf '%-24s %3d passed, %d failed, %d skipped  (%d s)\n' "$name" "$p" "$f" "$s" "$seconds"
    passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
done

status=127 seconds=0
read -r status seconds <"$log/end_to_end.status"
p=$(grep -c '^ok ' "$log/end_to_end.out") f=$(grep -c '^not ok ' "$log/end_to_end.out")
if [ "$status" -ne 0 ] && [ "$f" -eq 0 ] || [ $((p + f)) -eq 0 ]; then
    f=$((f + 1))
    echo "end_to_end: died with status $status"
fi
[ "$f" -gt 0 ] && cat "$log/end_to_end.out"
printf '%-24s %3d passed, %d failed  (%d s)\n' end_to_end "$p" "$f" "$seconds"
passed=$((passed + p)) failed=$((failed + f))

if [ $skipped -gt 0 ]; then
    echo "$passed passed, $failed failed, $skipped skipped"
else
    echo "$passed passed, $failed failed"
fi
[ $failed -eq 0 ] && [ $passed -gt 0 ]
