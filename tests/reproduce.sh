#!/bin/bash
# tests/reproduce.sh BUILD: `assay reproduce` makes pictures again, however they were made, and sees what is not the same.
# Prints "ok NAME" or "not ok NAME: why".
set -u
build=$(realpath "${1:?usage: tests/reproduce.sh BUILD}")
pathtracer=$build/pathtracer assay=$build/assay scene=reference/scenes/41_cornell.dae
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0

expect() { # NAME STATUS PATTERN FILE [OPTION...]
    local name=$1 status=$2 pattern=$3 got
    shift 3
    "$assay" reproduce "$@" >"$tmp/out" 2>&1
    got=$?
    if [ $got -eq "$status" ] && grep -q -- "$pattern" "$tmp/out"; then echo "ok reproduce: $name"; else
        echo "not ok reproduce: $name: status $got: $(head -c 1000 "$tmp/out")"
        failures=$((failures + 1))
    fi
}
render() { # FILE ARGUMENT...
    local out=$1
    shift
    "$pathtracer" -q -r 24 16 -f "$out" "$@" >/dev/null 2>"$tmp/err" || { echo "not ok reproduce: cannot render: $(cat "$tmp/err")" && failures=$((failures + 1)); }
}
again() { # NAME ARGUMENT...
    local name=$1
    shift
    render "$tmp/x.exr" "$@"
    expect "$name" 0 "the same bits in all" "$tmp/x.exr"
}
again "a render" -s 5 -t 3 $scene
# The file that is looked at stays as it is, also where its name hangs on its option.
"$pathtracer" -qHs4 -r 16 16 -f"$tmp/together.exr" $scene >/dev/null
cp "$tmp/together.exr" "$tmp/together.was"
expect "short options together" 0 "the same bits in all" "$tmp/together.exr"
cmp -s "$tmp/together.exr" "$tmp/together.was" || { echo "not ok reproduce: short options together: the file has changed" && failures=$((failures + 1)); }
again "layers" -s 5 --aov $scene
again "a share of the samples" --samples 3:7 $scene
again "a cell" -s 5 -p 3 2 11 9 $scene
again "sobol, light samples, roulette" -s 4 --sampler sobol -l 2 --roulette 0.7 --seed 18446744073709551615 $scene
again "the assignment's adaptive rule" -s 24 -a 4 0.3 $scene
again "a pilot" -s 24 --adaptive-unbiased 0.3 --pilot 4 $scene
again "a pilot, without -s" --adaptive-unbiased 0.3 --pilot 4 $scene
again "stopped by --time" --time 0.3s -r 16 12 $scene
again "stopped by --error" --error 60% -s 200 $scene
again "an environment" -s 4 -e reference/scenes/46_sky.exr reference/scenes/46_sky.dae
again "hemisphere, a lens" -s 4 -H -b 0.1 -d 3 $scene
cp $scene "$tmp/it's a scene.dae"
again "a command of 15 KB" $(yes -- '-s 2' | head -n 3000) $scene
again "a name that needs quotes" -s 2 "$tmp/it's a scene.dae"
timeout --preserve-status -s INT 1 "$pathtracer" -q -r 24 16 -s 1000000 -f "$tmp/r.exr" $scene >/dev/null 2>&1
n=$(sed -n 's/.*after \([0-9]*\) of.*/\1/p' <("$pathtracer" -q -r 24 16 -s 1 --resume "$tmp/r.exr" -f "$tmp/r.exr" $scene 2>&1) | head -n 1)
expect "an interrupted render" 0 "the same bits in all" "$tmp/r.exr"
render "$tmp/a.exr" --samples 0:4 $scene
render "$tmp/b.exr" --samples 4:9 $scene
render "$tmp/c.exr" --samples 9:11 $scene
"$assay" merge "$tmp/ab.exr" "$tmp/a.exr" "$tmp/b.exr" >/dev/null && "$assay" merge "$tmp/abc.exr" "$tmp/c.exr" "$tmp/ab.exr" >/dev/null
expect "a merge of a merge" 0 "the same bits in all" --keep "$tmp/kept.exr" "$tmp/abc.exr"

# What is not the same.
if command -v oiiotool >/dev/null; then
    oiiotool "$tmp/a.exr" --addc 0,0,0,0,0,0,0,0,0.0001,0 -o "$tmp/other.exr" && expect "one channel was changed" 1 "384 of 3840 values DIFFER, first M3" "$tmp/other.exr"
    oiiotool "$tmp/a.exr" --sattrib assay:seed 2 -o "$tmp/other.exr" && expect "another seed is claimed" 3 "assay:seed was '2', and is '1'" "$tmp/other.exr"
    oiiotool "$tmp/a.exr" --attrib assay:command 'pathtracer $(reboot) x.dae' -o "$tmp/other.exr" && expect "a command that a shell would act on" 3 "not a plain command" "$tmp/other.exr"
    oiiotool "$tmp/a.exr" --attrib assay:command 'rm -r /' -o "$tmp/other.exr" && expect "another program's command" 3 "none of this program" "$tmp/other.exr"
fi
render "$tmp/x.exr" -s 2 "$tmp/it's a scene.dae"
sed -i 's/0\.8/0.7/' "$tmp/it's a scene.dae"
expect "the scene was changed" 3 "is not the file that it was made of" "$tmp/x.exr"
rm "$tmp/it's a scene.dae"
expect "the scene is gone" 3 "is not here" "$tmp/x.exr"
expect "the scene is elsewhere" 0 "the same bits" --scene $scene "$tmp/x.exr"
rm "$tmp/b.exr"
expect "a share is gone" 3 "share.*is not here" "$tmp/abc.exr"
expect "a stored reference" 3 "manifest.json says it" golden/41_cornell/cycles.exr
expect "no picture" 3 "cannot read" README.md
[ $failures -eq 0 ]
