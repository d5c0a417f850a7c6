#!/bin/bash
# tests/browser/browser.sh BUILD: makes pages and looks at them in chromium. Prints "ok NAME" or "not ok NAME";
# screenshots go into BUILD/browser/shots.
set -u
build=$(realpath "${1:?usage: tests/browser/browser.sh BUILD}")
here=$(dirname "$0")
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
mkdir -p "$build/browser/shots"
if [ ! -d "$build/browser/node_modules/playwright-core" ]; then
    echo "skip page: no playwright-core in $build/browser: npm could not install it"
    exit 0
fi

# look SCRIPT ARGUMENTS...
look() {
    node "$here/$1" "$build/browser" "${@:2}" 2>"$tmp/err" \
        || echo "not ok page: $1 ends: $(grep -m 3 -E 'Error|at .*mjs' "$tmp/err" | tr '\n' ' ')"
}

"$build/assay" validate -q --out "$tmp/report" --only 31_spot_plane >/dev/null

# While a run goes on its page tells what is judged so far, and nothing else is left of that.
"$build/assay" validate -q --out "$tmp/going" --page-every 0.1 --only 10_furnace_one --only 12_point_plane --only 31_spot_plane >/dev/null &
run=$! seen=no
while [ $seen = no ] && kill -0 $run 2>/dev/null; do
    cp "$tmp/going/index.html" "$tmp/going.html" 2>/dev/null && grep -q 'The run goes on: [1-9][0-9]* more' "$tmp/going.html" && seen=yes
    sleep 0.02
done
wait $run
if [ $? = 0 ] && [ $seen = yes ] && ! grep -q 'The run goes on\|http-equiv="refresh"' "$tmp/going/index.html" && [ ! -e "$tmp/going/so_far.json" ]; then
    echo "ok page: it is there while the run goes on"; else
    echo "not ok page: it is there while the run goes on: seen $seen, $(ls "$tmp/going" | tr '\n' ' ')"; fi

sed 's/id="layer-0"/id="layer-x"/; s/id="layer-1"/id="layer-0"/; s/id="layer-x"/id="layer-1"/' "$tmp/report/index.html" >"$tmp/exchanged.html"
look page.mjs "$tmp/report/index.html" "$tmp/report/results.json" "$build/browser/shots" "$tmp/going.html" "$tmp/going/index.html" "$tmp/exchanged.html"

# File names as an attacker would choose them, and all the texts of results.json too.
evil='<img src=x onerror=alert(1)>'
for seed in 1 2; do
    "$build/pathtracer" -q -r 48 32 -s 16 --seed $seed -f "$tmp/$seed.exr" reference/scenes/12_point_plane.dae >/dev/null
    mv "$tmp/$seed.exr" "$tmp/$evil\"'$seed.exr"
done
"$build/assay" compare -q --json "$tmp/evil.json" --report "$tmp/compared.html" "$tmp/$evil\"'1.exr" "$tmp/$evil\"'2.exr"
sed -i "s|\"reason\": \".*\"|\"reason\": \"</script><script>alert(2)</script>\", \"notes\": [\"$evil\"]|" "$tmp/evil.json"
"$build/assay" report -o "$tmp/evil.html" "$tmp/evil.json" >/dev/null
for page in evil compared; do look names.mjs "$tmp/$page.html"; done

# A class of seven: the two of tools/docs/guide-course.md, and five in the states that need staff.
mkdir -p "$tmp/class/ada"
cp "$build/pathtracer" "$tmp/class/ada/"
for id in bob cyd dan eve fay gus; do
    mkdir "$tmp/class/$id"
    cp "$build/pathtracer" "$tmp/class/$id/ours"
    printf '#!/bin/sh\nexec ./ours "$@" --only direct\n' >"$tmp/class/$id/pathtracer"
    chmod +x "$tmp/class/$id/pathtracer"
done
grade() { "$build/assay" grade -q --unsafe-no-sandbox -o "$tmp/grades" tools/rubrics/template.rubric "$tmp/class"/*; }
grade
node "$here/grades_states.mjs" "$tmp/grades"
grade
[ $? = 2 ] && echo "ok grades: staff are needed" || echo "not ok grades: staff are needed: another exit code"
look grades.mjs "$build/browser/shots" "$tmp/grades"
