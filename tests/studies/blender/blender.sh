#!/bin/bash
# blender.sh BUILD [THREADS]: scenes made in Blender, through its COLLADA exporter, against Cycles. Prints Markdown; fails if a
# difference is found, or none in the negative controls: a point light that is 2 % brighter, a lens that is 0.3 % wider.
set -euo pipefail
build=$1 threads=${2:-1} here=$(dirname "$0") folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
failed=0

# compare NAME DAE EXPECTED TITLE: both images of 256 samples
compare() {
    local size verdict
    size=$(sed -n 's/^size //p' "$folder/$1.size")
    "$build/pathtracer" -q -t "$threads" -s 256 -m 5 -r "$size" -f "$folder/ours.exr" "$2" >/dev/null
    "$build/assay" compare "$folder/ours.exr" "$folder/$1.exr" >"$folder/verdict" || true
    verdict=$(sed -n '1s/:.*//p' "$folder/verdict")
    echo "| $4 | $verdict | $(sed -n '2s/, smallest.*//p' "$folder/verdict" | sed 's/difference //') |"
    [ "$verdict" = "$3" ] || failed=1
}

echo "| scene | verdict | difference of the mean, 95 % |"
echo "|---|---|---|"
for name in first second third parallel edges; do
    blender -b --factory-startup -noaudio --python-exit-code 3 -P "$here/scenes.py" -- "$name" "$folder" 256 "$threads" \
        >"$folder/log" 2>&1 || { tail -5 "$folder/log"; exit 1; }
    oiiotool --info "$folder/$name.exr" | sed 's/.*: *\([0-9]*\) x *\([0-9]*\),.*/size \1x\2/' >"$folder/$name.size"
    expected="NO DIFFERENCE FOUND"
    [ $name != edges ] || expected=DIFFERENT # known: see the page
    compare $name "$folder/$name.dae" "$expected" $name
done
sed 's/>200 180 160</>204 183.6 163.2</' "$folder/first.dae" >"$folder/bright.dae"
compare first "$folder/bright.dae" DIFFERENT "first, a light of 204 W for 200"
sed 's/>48.45549</>48.6</' "$folder/first.dae" >"$folder/wide.dae"
compare first "$folder/wide.dae" DIFFERENT "first, 48.6 degrees for 48.46"
exit $failed
