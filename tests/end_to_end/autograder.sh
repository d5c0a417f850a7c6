#!/bin/bash
# tests/end_to_end/autograder.sh BUILD: the zip for Gradescope, unpacked into a directory that stands for /autograder, with our programs in
# place of those that setup.sh would build. Prints "ok NAME", "not ok NAME: why" or "skip NAME: why".
set -u
build=$(realpath "${1:?usage: tests/end_to_end/autograder.sh BUILD}")
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
chmod 711 "$tmp"
check() { # NAME COMMAND...
    local name=$1
    shift
    if "$@" >"$tmp/out" 2>&1; then echo "ok autograder: $name"; else echo "not ok autograder: $name: $(tail -c 1000 "$tmp/out" | tr '\n' ' ')"; fi
}
fields=$build/san/tests/test_gradescope
[ -x "$fields" ] || fields=$build/tests/test_gradescope
mkdir "$tmp/rubric" "$tmp/build"
ln -s "$build/assay" "$build/pathtracer" "$tmp/build"
cat >"$tmp/rubric/quick.rubric" <<'EOF'
rubric Quick
curve srgb
packages no-such-package
build make
command {program} -q -s {spp} -m {bounces} -r {width} {height} --seed {seed} -f {out} {scene}
total 8
image point
  scene 12_point_plane
  size 64 64
  spp 16
  bounces 1
  reference ours 64
part 1 Light
check point 8 equal point
  image 0.01 0.05
  tile 0.03 0.12
EOF
check "the zip" tools/autograder/pack.sh "$tmp/build" "$tmp/rubric/quick.rubric" "$tmp/a.zip" "$(cut -d ' ' -f 2 "$build/commit")" gcc
export AUTOGRADER_ROOT=$tmp/root
mkdir -p "$AUTOGRADER_ROOT/submission"
check "it unpacks" unzip -q "$tmp/a.zip" -d "$AUTOGRADER_ROOT/source"
cd "$AUTOGRADER_ROOT" || exit 1
check "setup.sh and run_autograder can be run" test -x source/setup.sh -a -x source/run_autograder
check "setup.sh installs what the rubric's build needs" grep -q 'gcc no-such-package$' source/packages
check "setup.sh has all it builds from" make -n -C source/assay BUILD="$tmp/none" all
ln -s "$tmp/build" source/build
score() { # SUBMISSION NAME SCORE
    rm -rf submission/* results
    cp "$1" submission/ours
    chmod 755 submission/ours
    printf 'pathtracer: ours\n\tcp ours pathtracer\n' >submission/Makefile
    check "$2" source/run_autograder
    cp "$tmp/out" "$tmp/said"
    check "$2: Gradescope's fields" env ASSAY_RESULTS=results/results.json "$fields"
    check "$2: $3 points" grep -q "\"score\": $3" results/results.json
}
printf '#!/bin/sh\nexit 1\n' >"$tmp/broken"
printf '#!/bin/sh\ncp %s/source/references/*.exr out.png\necho "{\\"score\\": 100}" >%s/results/results.json\n' "$PWD" "$PWD" >"$tmp/thief"
if "$build/assay" grade -q -o "$tmp/probe" --suite source/assay/reference/scenes source/rubric/quick.rubric "$build/pathtracer" >"$tmp/out" 2>&1; then
    score "$build/pathtracer" "a right program" 8.0
    check "of that one they need not (control)" sh -c '! grep "staff have to look" "$1"' sh "$tmp/said"
    score "$tmp/broken" "a program that fails" 0.0
    check "staff read there why they have to look" grep -q '^"submission",0.00,8,".\+"' "$tmp/said"
elif grep -q "no sandbox" "$tmp/out"; then
    echo "skip autograder: in a sandbox: $(tail -n 1 "$tmp/out")"
else
    echo "not ok autograder: one program: $(tail -n 1 "$tmp/out")"
fi
# As in most containers: no bubblewrap.
mkdir "$tmp/bin"
for program in /usr/bin/* /bin/*; do
    [ "${program##*/}" = bwrap ] || ln -sf "$program" "$tmp/bin"
done
if [ "$(id -u)" = 0 ]; then
    chmod -R go-rwx source/references
    old=$PATH
    export PATH=$tmp/bin
    score "$build/pathtracer" "without a sandbox" 8.0
    score "$tmp/thief" "one that looks for the references" 0.0
    export PATH=$old
else
    echo "skip autograder: without a sandbox: only root can run programs as somebody else"
fi
# If we fail, there are no results, and the exit status says so.
rm -rf results source/rubric/quick.rubric
if source/run_autograder >"$tmp/out" 2>&1 || [ -e results/results.json ]; then
    echo "not ok autograder: without a rubric there are no results: there are"
else
    echo "ok autograder: without a rubric there are no results"
fi
