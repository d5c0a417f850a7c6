#!/bin/bash
# tests/studies/scale/large.sh BUILD SIDE: an image of SIDE x SIDE pixels, of which the sums alone are 96 bytes each, made in 64 jobs and put together
# while no program may have more than 2 GiB of addresses. Its pixels are those of a render of some cells by themselves. Prints the
# measured figures, "ok NAME" or "not ok NAME: why".
set -u
build=$(realpath "${1:?usage: tests/studies/scale/large.sh BUILD SIDE}") side=$2
pathtracer=$build/pathtracer assay=$build/assay scene=$PWD/reference/scenes/41_cornell.dae
tmp=$(mktemp -d "${TMPDIR:-/tmp}/assay-large.XXXXXX")
trap 'rm -rf "$tmp"' EXIT
failures=0
TIMEFORMAT='%U + %S CPU s, %R s'
what=large
. tests/end_to_end/expect.sh
limited() { (ulimit -v $((2 << 20)) && "$@"); }
render=(-q -r "$side" "$side" -s 1)
limited "$assay" plan --plan "$tmp/plan" --parts 64 pathtracer "${render[@]}" -f "$tmp/x.exr" -f "$tmp/x.png" "$scene" >"$tmp/out" 2>&1 || tell "plan" "$(tail -n 1 "$tmp/out")"
num=$(grep -c '^{"job"' "$tmp/out")
echo "$num jobs:"
time limited "$assay" run-job "$tmp/plan" $(seq 0 $((num - 1))) >"$tmp/out" 2>&1
tell "jobs of an image of $side x $side within 2 GiB each" "$([ "$(grep -c ': made' "$tmp/out")" -eq "$num" ] || tail -n 1 "$tmp/out")"
echo "gather, of $(du -sh "$tmp/plan" | cut -f 1):"
time limited "$assay" gather "$tmp/plan" >"$tmp/out" 2>&1
tell "put together within 2 GiB" "$([ -e "$tmp/x.exr" ] && [ -e "$tmp/x.png" ] || tail -n 1 "$tmp/out")"
ls -l "$tmp/x.exr" "$tmp/x.png" | awk '{print $5, "bytes"}'
# Cells across the borders of jobs, at the corners and in the middle, from the PNG of the whole and by themselves.
why=""
for at in "0 0" "$((side - 50)) $((side - 40))" "$((side / 2 - 20)) $((side / 2 - 30))" "17 $((side / 64 * 5 - 3))"; do
    read -r x y <<<"$at"
    "$pathtracer" "${render[@]}" -p "$x" "$y" 50 40 -f "$tmp/c.png" "$scene" >/dev/null 2>&1
    oiiotool "$tmp/x.png" --cut "50x40+$x+$((side - y - 40))" -o "$tmp/d.png" 2>"$tmp/err" && oiiotool --diff --fail 0 --warn 0 "$tmp/c.png" "$tmp/d.png" >"$tmp/out" 2>&1 || why="$why cell at $at: $(head -n 2 "$tmp/out" "$tmp/err" | tr '\n' ' ')"
done
tell "its pixels are those of cells by themselves" "$why"
[ $failures -eq 0 ]
