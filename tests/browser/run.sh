#!/bin/bash
# tests/browser/run.sh BUILD: makes pages and looks at them in chromium. Prints "ok NAME" or "not ok NAME";
# screenshots go into BUILD/browser/shots.
set -u
build=$(realpath "${1:?usage: tests/browser/run.sh BUILD}")
here=$(dirname "$0")
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
mkdir -p "$build/browser/shots"

# look SCRIPT ARGUMENTS...
look() {
    node "$here/$1" "$build/browser" "${@:2}" 2>"$tmp/err" \
        || echo "not ok page: $1 ends: $(grep -m 3 -E 'Error|at .*mjs' "$tmp/err" | tr '\n' ' ')"
}

"$build/assay" validate -q --out "$tmp/report" --only 31_spot_plane >/dev/null
look page.mjs "$tmp/report/index.html" "$tmp/report/results.json" "$build/browser/shots"

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
