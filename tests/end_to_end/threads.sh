#!/bin/bash
# tests/end_to_end/threads.sh PATHTRACER [SCENE.dae...]: renders each scene (all of reference/scenes) with 1, 2, 3, 7
# and 16 threads and compares all sums bit by bit, as --keep-state leaves them in double; 41_cornell also with other
# samplers and options. "ok NAME" or "not ok NAME: why" for each; with a PATHTRACER built for it, TSan's reports count,
# too.
set -u
pathtracer=$(realpath "${1:?usage: tests/end_to_end/threads.sh PATHTRACER [SCENE.dae...]}")
shift
[ $# -gt 0 ] || set -- reference/scenes/*.dae
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
export TSAN_OPTIONS="halt_on_error=1 exitcode=66 ${TSAN_OPTIONS:-}"
failures=0
first=reference/scenes/41_cornell.dae

# 72 x 56: 20 tiles, of which the last row and column are not whole.
render() { # THREADS ARGUMENT...
    "$pathtracer" -q -r 72 56 -s 6 --keep-state -t "$@" -f "$tmp/$1.exr" >"$tmp/out" 2>&1
}

what="1, 2, 3, 7 and 16 threads"
. tests/end_to_end/expect.sh
same_bits() { # NAME ARGUMENT...
    local name=$1 why="" t
    shift
    for t in 1 2 3 7 16; do
        rm -f "$tmp/$t.exr.state"
        render $t "$@" || why="$t threads: $(tail -c 2000 "$tmp/out")"
        [ -z "$why" ] && { cmp "$tmp/1.exr.state" "$tmp/$t.exr.state" >"$tmp/out" 2>&1 || why="$t threads: $(cat "$tmp/out")"; }
        [ -n "$why" ] && break
    done
    tell "$name" "$why"
}

for scene in "$@"; do
    sky=${scene%.dae}.exr
    if [ -f "$sky" ]; then set -- -e "$sky"; else set --; fi
    same_bits "$(basename "$scene" .dae)" "$@" "$scene"
done
same_bits "sobol" --sampler sobol "$first"
same_bits "the assignment's adaptive rule" -a 2 0.5 "$first"
same_bits "guiding" --guiding on "$first"
same_bits "a pilot" --adaptive-unbiased 0.3 --pilot 4 "$first"
same_bits "layers" --aov "$first"
same_bits "one path at a time" --isa scalar "$first"
same_bits "roulette, several light samples" --roulette on -l 3 "$first"
# Control: the comparison can fail, as another seed gives other sums.
render 1 --seed 8 "$first" && cp "$tmp/1.exr.state" "$tmp/other" && render 1 --seed 9 "$first"
# The seed stands in the head; the last 32 bytes are a hash, the 1000 before them are sums.
if cmp -s <(tail -c 1032 "$tmp/other" | head -c 1000) <(tail -c 1032 "$tmp/1.exr.state" | head -c 1000); then
    echo "not ok another seed has other bits"
    failures=$((failures + 1))
else echo "ok another seed has other bits"; fi
[ $failures -eq 0 ]
