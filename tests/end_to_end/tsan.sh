#!/bin/bash
# tests/end_to_end/tsan.sh BUILD/tsan TEST...: everything that runs threads, under ThreadSanitizer: the renders of tests/end_to_end/threads.sh on
# every scene, grading and a validation with several threads, and the test programs named. "ok" or "not ok" lines.
set -u
tsan=$(realpath "${1:?usage: tests/end_to_end/tsan.sh BUILD/tsan TEST...}")
shift
export TSAN_OPTIONS="halt_on_error=1 exitcode=66"
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0
tell() { # NAME STATUS
    if [ "$2" -eq 0 ]; then echo "ok no race: $1"; else
        echo "not ok no race: $1: $(grep -m1 -A12 'WARNING: ThreadSanitizer' "$tmp/out" || tail -n 3 "$tmp/out")"
        failures=$((failures + 1))
    fi
}
# Control: a race is seen.
cat >"$tmp/race.c" <<'END'
#include <pthread.h>
static int n;
static void *add(void *arg)
{
    for (int i = 0; i < 100000; i++)
        n++;
    return arg;
}
int main(void)
{
    pthread_t t;
    pthread_create(&t, 0, add, 0);
    add(0);
    pthread_join(t, 0);
    return 0;
}
END
gcc -g -fsanitize=thread -o "$tmp/race" "$tmp/race.c" -pthread && "$tmp/race" >"$tmp/out" 2>&1
if [ $? -eq 66 ]; then echo "ok a race is seen"; else echo "not ok a race is seen" && failures=1; fi

tests/end_to_end/threads.sh "$tsan/pathtracer" | tee "$tmp/threads"
[ "${PIPESTATUS[0]}" -eq 0 ] || failures=$((failures + 1))
for test in "$@"; do
    "$tsan/tests/$test" >"$tmp/out" 2>&1
    tell "$test" $?
done
"$tsan/pathtracer" -q -r 64 64 -s 100000 -t 7 --time 3s --write-every 0.2 -f "$tmp/x.exr" reference/scenes/41_cornell.dae >"$tmp/out" 2>&1
tell "a render that writes meanwhile" $?
timeout --preserve-status -s INT 3 "$tsan/pathtracer" -r 64 64 -s 100000 -t 7 -f "$tmp/x.exr" \
    reference/scenes/41_cornell.dae >"$tmp/out" 2>&1
[ $? -eq 130 ]
tell "an interrupted render with progress" $?
"$tsan/assay" validate -q --pathtracer "$tsan/pathtracer" --threads 7 --only 12_point_plane --only 31_spot_plane --only 92_half_pixel/cycles --out "$tmp/report" >"$tmp/out" 2>&1
tell "a validation" $?
for seed in 1 2; do
    "$tsan/pathtracer" -q -r 64 64 -s 16 --seed $seed -f "$tmp/$seed.exr" reference/scenes/41_cornell.dae
done
"$tsan/assay" compare -t 7 --expect "NO DIFFERENCE FOUND" --accept-mdb 1000 "$tmp/1.exr" "$tmp/2.exr" >"$tmp/out" 2>&1
tell "a comparison" $?
[ $failures -eq 0 ]
