#!/bin/bash
# The programs as a user meets them: exit codes, messages, files. Prints "ok NAME", "not ok NAME", or "skip NAME" with
# the reason where this machine cannot do it.
set -u
build=$(realpath "${1:?usage: tests/end_to_end/end_to_end.sh BUILD}")
pathtracer=$build/pathtracer assay=$build/assay
# Where bad input is fed in, the sanitized builds run.
san_pathtracer=$build/san/pathtracer san_assay=$build/san/assay
# The build whose objects mutants are linked with, and that is installed: not that of tests/end_to_end/coverage.sh, by
# another compiler.
plain=$(realpath "${PLAIN_BUILD:-$build}")
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0

ok() { tell "$1" ""; }
not_ok() { tell "$1" "${2:-?}"; }
what=""
. tests/end_to_end/expect.sh

scene=reference/scenes/41_cornell.dae
small="-r 32 32 -s 16 -t 2 -q"

# The command line of pathtracer.
for option in --spp --light-samples --max-bounces --hemisphere --adaptive --resolution --cell --seed \
    --fresnel; do
    expect "help names $option" 0 "$option" "$san_pathtracer" --help
done
expect "version" 0 "pathtracer 0" "$san_pathtracer" --version
expect "no scene" 3 "no scene" "$san_pathtracer" -f "$tmp/x.exr"
expect "no output" 3 "no output" "$san_pathtracer" $scene
expect "unknown option" 3 "unknown option '--sppp'" "$san_pathtracer" --sppp 4 -f "$tmp/x.exr" $scene
expect "missing argument" 3 "needs W H" "$san_pathtracer" $scene -r 4
expect "not a number" 3 "'1x'" "$san_pathtracer" -s 1x -f "$tmp/x.exr" $scene
expect "negative samples" 3 "not a whole number" "$san_pathtracer" -s -1 -f "$tmp/x.exr" $scene
expect "two scenes" 3 "more than one scene" "$san_pathtracer" -f "$tmp/x.exr" $scene $scene
expect "unknown file type" 3 "neither" "$san_pathtracer" -f "$tmp/x.bmp" $scene
expect "cell outside" 3 "reaches out" "$san_pathtracer" -r 8 8 -p 4 4 5 1 -f "$tmp/x.exr" $scene
expect "roulette" 3 "neither on, off, nor" "$san_pathtracer" --roulette 1.5 -f "$tmp/x.exr" $scene
expect "unknown Fresnel" 3 "fresnel" "$san_pathtracer" --fresnel guess -f "$tmp/x.exr" $scene
expect "environment map that is not there" 3 "nosky.exr: cannot read" \
    "$san_pathtracer" $small -e nosky.exr -f "$tmp/x.exr" $scene
expect "environment map of 8 bits" 3 "must be an .exr or .hdr" \
    "$san_pathtracer" $small -e sky.png -f "$tmp/x.exr" $scene
expect "adaptive sobol" 3 "independent" \
    "$san_pathtracer" -a 8 0.1 --sampler sobol -f "$tmp/x.exr" $scene
expect "missing scene" 3 "nowhere.dae" "$san_pathtracer" -f "$tmp/x.exr" nowhere.dae
expect "missing camera" 3 "'nocamera' is neither a camera of the scene" \
    "$san_pathtracer" $small -c nocamera -f "$tmp/x.exr" $scene
parts=tests/fuzz/seeds/collada-parts.dae
expect "cameras of a scene" 0 "eye: orthographic, 12 x 0" "$san_pathtracer" --list-cameras $parts
expect "the first of several" 0 "first of 2 cameras, 'eye'" "$san_pathtracer" -r 8 8 -s 1 -f "$tmp/x.exr" $parts
expect "another camera" 0 "" "$san_pathtracer" $small -c other -f "$tmp/x.exr" $parts
rm -f "$tmp/x.exr"
expect "a lens without perspective" 3 "a lens needs a perspective camera" \
    "$san_pathtracer" $small -b 0.1 -f "$tmp/x.exr" $parts
expect "unwritable output" 3 "/nonexistent/x.exr" \
    "$san_pathtracer" $small -f /nonexistent/x.exr $scene
# Found before the render, which would take days.
expect "unwritable output: at once" 3 "/nonexistent/x.png: cannot write" \
    timeout 60 "$pathtracer" -q -r 4000x4000 -s 1e7 -f "$tmp/x.exr" -f /nonexistent/x.png $scene
for ending in obj gltf glb usd usdz fbx; do
    cp $scene "$tmp/x.$ending"
    expect "only COLLADA: .$ending" 3 "x.$ending: only COLLADA (.dae) is read" "$san_pathtracer" $small -f "$tmp/x.exr" "$tmp/x.$ending"
    rm "$tmp/x.$ending"
done
for bad in tests/bad/*.dae; do
    case $bad in
    */00_valid.dae) continue ;; # what the others are faults of
    */material_cgl_in_collada.dae) dialect=collada ;;
    */light_spot_of_the_assignment.dae) dialect=cgl ;;
    *) dialect=auto ;;
    esac
    expect "bad scene $(basename "$bad")" 3 "$bad" "$san_pathtracer" $small --dialect $dialect -f "$tmp/bad.exr" "$bad"
done
if [ -n "$(ls "$tmp" | grep -v '^out$\|^err$')" ]; then
    not_ok "failures leave no files" "$(ls "$tmp")"
else
    ok "failures leave no files"
fi

# The known bugs of tests/mutants still fit the renderer. (`make mutants` builds and finds all of them.)
stale=0
for patch in tests/mutants/*.patch; do
    patch --dry-run --quiet --fuzz=0 -p1 <"$patch" >/dev/null 2>&1 || { stale=1; not_ok "mutant $(basename "$patch")" "does not apply"; }
    sed -n 1p "$patch" | grep -q '^Bug: .' && sed -n 2p "$patch" | grep -q '^Where: .' ||
        { stale=1; not_ok "mutant $(basename "$patch")" "does not begin with the lines 'Bug: ' and 'Where: '"; }
done
[ $stale -eq 0 ] && ok "mutants apply and say what they are"
# Three of them are built and found, and the renderer as it is passes the same scenes.
if tests/mutants/mutants.sh --quick "$plain" >"$tmp/mutants.out" 2>&1; then ok "three mutants are caught"; else
    not_ok "three mutants are caught" "$(cat "$tmp/mutants.out")"
fi
rm -f "$tmp/mutants.out"

# A directory that goes while its image is rendered: the image is saved in the current one.
mkdir "$tmp/gone" "$tmp/here"
(cd "$tmp/here" && exec "$pathtracer" -q -r 32x32 --time 1 -f "$tmp/gone/x.exr" "$OLDPWD/$scene" >/dev/null 2>"$tmp/saved") &
run=$!
sleep 0.4
rm -r "$tmp/gone"
wait $run
tell "a finished render is saved" "$([ $? = 3 ] && [ -s "$tmp"/here/rescued-*-x.exr ] && [ "$(wc -l <"$tmp/saved")" = 1 ] &&
    grep -q "gone/x.exr: cannot write: .*; the render is in rescued-[0-9]*-x.exr instead" "$tmp/saved" || cat "$tmp/saved")"
rm -r "$tmp/here" "$tmp/saved"

# Images.
expect "files are named" 0 "written: $tmp/n.exr $tmp/n.png $tmp/n_rate.png" \
    "$san_pathtracer" -r 16x16 -s 2e1 -a 8 0.1 -f "$tmp/n.exr" -f "$tmp/n.png" $scene
expect "render" 0 "mean radiance" \
    "$san_pathtracer" $small --seed 1 -f "$tmp/a.exr" -f "$tmp/a.png" $scene
expect "environment map" 0 "mean radiance" \
    "$san_pathtracer" $small -e "$tmp/a.exr" -f "$tmp/sky.png" $scene
"$pathtracer" $small -t 1 --seed 1 -f "$tmp/a1.png" $scene >/dev/null
"$pathtracer" $small -t 2 --seed 1 -f "$tmp/a2.png" $scene >/dev/null
if cmp -s "$tmp/a1.png" "$tmp/a2.png"; then ok "1 and 2 threads, same bytes"; else
    not_ok "1 and 2 threads, same bytes" "PNG files differ"
fi
"$pathtracer" $small -t 2 --seed 2 -f "$tmp/a3.png" $scene >/dev/null
if cmp -s "$tmp/a1.png" "$tmp/a3.png"; then
    not_ok "another seed, another image" "PNG files are the same"
else ok "another seed, another image"; fi
expect "two seeds, two images" 0 "written: $tmp/of_2.exr $tmp/of_2.png" \
    "$san_pathtracer" ${small% -q} --seed 1,2 -f "$tmp/of.exr" -f "$tmp/of.png" $scene
if cmp -s "$tmp/a1.png" "$tmp/of_1.png" && cmp -s "$tmp/a3.png" "$tmp/of_2.png"; then ok "two seeds, the bytes of each"; else
    not_ok "two seeds, the bytes of each" "PNG files differ"
fi
expect "two seeds, made again one by one" 0 "made again by: .* --seed 2 " "$assay" reproduce "$tmp/of_2.exr"
expect "one seed twice" 3 "--seed: 7 is there twice" "$san_pathtracer" --seed 7,7 -f "$tmp/of.exr" $scene
expect "two seeds, resumed" 3 "one alone with --resume" "$san_pathtracer" --seed 1,2 --resume "$tmp/of_1.exr" -f "$tmp/of.exr" $scene
expect "two seeds in jobs" 3 "--seed: cannot be cut" "$assay" slurm pathtracer --seed 1,2 -f "$tmp/of.exr" $scene

# Control of tests/support/asan_options.c: what it turns off is on by default, and would now and then make LeakSanitizer
# die.
sky=reference/scenes/46_sky.exr
late_variables() { # ASAN_OPTIONS: those of libraries loaded late that the sanitizer took note of
    ASAN_OPTIONS=$1 "$san_assay" compare $sky $sky 2>&1 | grep -c '__tls_get_addr: 0x'
}
if [ "$(late_variables verbosity=2)" -eq 0 ] && [ "$(late_variables verbosity=2:intercept_tls_get_addr=1)" -gt 0 ]; then
    ok "the search for leaks keeps to what it knows"
else not_ok "the search for leaks keeps to what it knows" "looked at $(late_variables verbosity=2) variables it should not, $(late_variables verbosity=2:intercept_tls_get_addr=1) that it should"; fi

# Stopping and going on. --keep-state leaves every sum to the last bit, so equal states are equal renders.
box="$pathtracer -q -r 48 32 --aov $scene"
$box -s 40 --keep-state -f "$tmp/whole.exr" >/dev/null || not_ok "--keep-state" "failed"
$box -s 17 --keep-state -f "$tmp/part.exr" >/dev/null || not_ok "--keep-state" "failed"
expect "resume" 0 "mean radiance" "$san_pathtracer" -q -r 48 32 --aov $scene -s 40 --keep-state \
    -t 3 --resume "$tmp/part.exr" -f "$tmp/part.exr"
if cmp -s "$tmp/whole.exr.state" "$tmp/part.exr.state"; then ok "resumed, same bytes"; else
    not_ok "resumed, same bytes" "states differ"
fi
expect "resume: other seed" 3 "'seed 1' there, 'seed 2' here" \
    "$san_pathtracer" -q -r 48 32 --aov $scene --seed 2 --resume "$tmp/part.exr" -f "$tmp/part.exr"
expect "resume: fewer samples" 3 "has 40 samples" \
    "$san_pathtracer" -q -r 48 32 --aov $scene -s 8 --resume "$tmp/part.exr" -f "$tmp/part.exr"
expect "resume: no state" 3 "nothing.exr.state: cannot read" \
    "$san_pathtracer" -q -r 48 32 $scene --resume "$tmp/nothing.exr" -f "$tmp/part.exr"
head -c 4000 "$tmp/whole.exr.state" >"$tmp/cut.exr.state"
expect "resume: damaged state" 3 "damaged" \
    "$san_pathtracer" -q -r 48 32 --aov $scene -s 40 --resume "$tmp/cut.exr" -f "$tmp/part.exr"

# interrupt SIGNAL STATUS: interrupts an endless render; its moments are valid, and it can be resumed up to
# two samples more than it has.
interrupt() {
    rm -f "$tmp/long.exr" "$tmp/long.exr.state"
    expect "$1 ends with $2 and says how to resume" "$2" "pathtracer --resume $tmp/long.exr " \
        timeout --preserve-status -s "$1" 1 "$pathtracer" -q -t 2 -r 48 32 -s 1000000 $scene -f "$tmp/long.exr"
    local done
    done=$(grep -o 'after [0-9]* of' "$tmp/err" | grep -o '[0-9]*')
    expect "$1: the image has moments, and is not judged by itself" 3 "the same observations" \
        "$san_assay" compare --margin 0.9 --margin-tile 0.9 "$tmp/long.exr" "$tmp/long.exr"
    $pathtracer -q -r 48 32 $scene -s $((done + 2)) --keep-state --resume "$tmp/long.exr" \
        -f "$tmp/long.exr" >/dev/null
    $pathtracer -q -r 48 32 $scene -s $((done + 2)) --keep-state -f "$tmp/straight.exr" >/dev/null
    if cmp -s "$tmp/long.exr.state" "$tmp/straight.exr.state"; then ok "$1, resumed, same bytes"; else
        not_ok "$1, resumed, same bytes" "states differ after $done samples"
    fi
}
interrupt INT 130
interrupt TERM 143

expect "--time" 0 "stopped by --time" "$pathtracer" -r 32 32 --time 0.3s $scene -f "$tmp/x.exr"
expect "--error" 0 "stopped by --error" "$pathtracer" -r 32 32 --error 40% $scene -f "$tmp/x.exr"
if ls "$tmp"/x.exr.state >/dev/null 2>&1; then not_ok "no state is left" "it is"; else ok "no state is left"; fi
$pathtracer -q -r 32 32 -s 1000000 --write-every 0.2 $scene -f "$tmp/long2.exr" >/dev/null &
for i in $(seq 100); do [ -s "$tmp/long2.exr.state" ] && break; sleep 0.1; done
kill -9 $!
wait $! 2>/dev/null
expect "--write-every: the image of a killed render has moments" 3 "the same observations" \
    "$san_assay" compare --margin 0.9 --margin-tile 0.9 "$tmp/long2.exr" "$tmp/long2.exr"
if [ -s "$tmp/long2.exr.state" ]; then ok "--write-every: its state"; else
    not_ok "--write-every: its state" "none"
fi
expect "--time: not a time" 3 "5d" "$san_pathtracer" --time 5d $scene -f "$tmp/x.exr"
expect "--samples: not a range" 3 "not a range" "$san_pathtracer" --samples 5 $scene -f "$tmp/x.exr"
expect "--samples: empty" 3 "no sample" "$san_pathtracer" --samples 5:5 $scene -f "$tmp/x.exr"
expect "two adaptive modes" 3 "exclude" \
    "$san_pathtracer" -a 32 0.1 --adaptive-unbiased 0.1 $scene -f "$tmp/x.exr"
expect "adaptive images" 0 "mean radiance" "$san_pathtracer" -q -r 16 16 -s 64 -a 16 0.2 $scene \
    -f "$tmp/rule.exr" -f "$tmp/rule.png" --heatmap "$tmp/heat.png"
expect "a pilot's images" 0 "mean radiance" "$san_pathtracer" -q -r 16 16 -s 64 --pilot 16 \
    --adaptive-unbiased 0.2 $scene -f "$tmp/pilot.png"
for file in rule_rate.png heat.png pilot_rate.png; do
    if [ -s "$tmp/$file" ]; then ok "there is $file"; else not_ok "there is $file" "no"; fi
done
expect "--list" 0 "integrators: path normals" "$san_pathtracer" --list
expect "--version names libxml2" 0 "libxml2 [0-9]" "$san_pathtracer" --version
for option in $("$pathtracer" --help | grep -o '^ *\(-., \| \)*--[a-z-]*' | grep -o -- '--[a-z-]*'); do
    if grep -q -- "\\\\-\\\\-$(sed 's/-/\\\\-/g' <<<"${option#--}")" renderer/pathtracer/pathtracer.1; then
        ok "the man page has $option"
    else not_ok "the man page has $option" "no"; fi
done

# merge. Layers: names that OpenImageIO, a reader of its own, finds.
$box --samples 0:10 -f "$tmp/s0.exr" >/dev/null
$box --samples 10:40 -f "$tmp/s1.exr" >/dev/null
$box -s 40 -p 0 0 20 32 -f "$tmp/c0.exr" >/dev/null
$box -s 40 -p 20 0 28 32 -f "$tmp/c1.exr" >/dev/null
$box --seed 2 --samples 10:40 -f "$tmp/s2.exr" >/dev/null
expect "merge samples" 0 "ms.exr" "$san_assay" merge "$tmp/ms.exr" "$tmp/s1.exr" "$tmp/s0.exr"
expect "merge cells" 0 "mc.exr" "$san_assay" merge "$tmp/mc.exr" "$tmp/c1.exr" "$tmp/c0.exr"
if command -v oiiotool >/dev/null; then
    expect "merged cells, same bits" 0 "PASS" \
        oiiotool --fail 0 --hardfail 0 --diff "$tmp/mc.exr" "$tmp/whole.exr"
    expect "merged samples, same mean" 0 "PASS" oiiotool --fail 4e-6 --hardfail 4e-6 \
        "$tmp/ms.exr" --ch R,G,B "$tmp/whole.exr" --ch R,G,B --diff
    expect "layers" 0 "albedo.R.*depth.Z.*id.object.*normal.X.*stderr.R.*variance.B" \
        oiiotool --info -v "$tmp/whole.exr"
else
    ok "oiiotool is not here: bits of merged images are not compared"
fi
expect "merge: the same samples twice" 3 "both have samples" \
    "$san_assay" merge "$tmp/x.exr" "$tmp/s0.exr" "$tmp/s1.exr" "$tmp/whole.exr"
expect "merge: another seed" 3 "different seed" \
    "$san_assay" merge "$tmp/x.exr" "$tmp/s0.exr" "$tmp/s2.exr"
expect "merge: cells overlap" 3 "overlap" \
    "$san_assay" merge "$tmp/x.exr" "$tmp/c0.exr" "$tmp/whole.exr"
$box -s 40 -p 40 0 8 32 -f "$tmp/c2.exr" >/dev/null
expect "merge: a cell is missing" 3 "open" "$san_assay" merge "$tmp/x.exr" "$tmp/c0.exr" "$tmp/c2.exr"
expect "merge: one share" 3 "two shares" "$san_assay" merge "$tmp/x.exr" "$tmp/c0.exr"

# compare: two seeds of a correct renderer; a render that lacks a bounce; too few samples; no file.
render() { "$pathtracer" -q -r 64 64 "$@" $scene >/dev/null || not_ok "render $*" "failed"; }
render -s 256 --seed 3 -f "$tmp/one.exr"
render -s 256 --seed 4 -f "$tmp/two.exr"
render -s 256 --seed 5 -m 4 -f "$tmp/shallow.exr"
render -s 8 --seed 6 -f "$tmp/few.exr"
expect "compare: equivalent" 0 "^EQUIVALENT" \
    "$san_assay" compare --margin 0.02 --margin-tile 0.08 "$tmp/one.exr" "$tmp/two.exr"
expect "compare: different" 1 "^DIFFERENT" \
    "$san_assay" compare --margin 0.002 --margin-tile 0.01 "$tmp/shallow.exr" "$tmp/two.exr"
expect "compare: inconclusive" 2 "^INCONCLUSIVE" \
    "$san_assay" compare --margin 0.002 --margin-tile 0.01 "$tmp/few.exr" "$tmp/two.exr"
# One seed on both sides, of a program and of one whose lamp is 0.1 % brighter.
sed 's/10 10 10/10.01 10.01 10.01/' $scene >"$tmp/brighter.dae"
"$pathtracer" -q -r 200 150 -s 16 --seed 4 -f "$tmp/dark.exr" $scene >/dev/null
"$pathtracer" -q -r 200 150 -s 16 --seed 4 -f "$tmp/brighter.exr" "$tmp/brighter.dae" >/dev/null
expect "compare: one seed" 1 "note: the sides are not independent" "$san_assay" compare "$tmp/brighter.exr" "$tmp/dark.exr"
expect "compare: one seed, paired" 0 "^EQUIVALENT" "$san_assay" compare --paired --margin 0.05 --tile 100 "$tmp/brighter.exr" "$tmp/dark.exr"
expect "compare: one seed, the interval" 0 "^difference +0.100 % \[+0.0[89].*, +0.1[012]" \
    "$san_assay" compare --paired --margin 0.05 --tile 100 "$tmp/brighter.exr" "$tmp/dark.exr"
expect "compare: one seed, not paired" 3 "paired judges them" "$san_assay" compare --margin 0.05 "$tmp/two.exr" "$tmp/two.exr"
expect "compare: one seed, nothing changed" 0 "the same to the bit" \
    "$san_assay" compare --paired --margin 0.05 "$tmp/two.exr" "$tmp/two.exr"
# Folders: 8 renders of one seed each.
for folder in dark brighter; do
    mkdir "$tmp/pairs_$folder"
    for seed in 1 2 3 4 5 6 7 8; do
        "$pathtracer" -q -r 32 32 -s 16 --seed $seed -f "$tmp/pairs_$folder/$seed.exr" "$([ $folder = dark ] && echo $scene || echo "$tmp/brighter.dae")" >/dev/null
    done
done
expect "compare: folders, paired" 0 "^difference +0.100 % \[+0.09.*, +0.1[01]" \
    "$san_assay" compare --paired --margin 0.05 "$tmp/pairs_brighter" "$tmp/pairs_dark"
mv "$tmp/pairs_dark/8.exr" "$tmp/pairs_dark/9.exr"
expect "compare: folders, not of one seed" 3 "need the same name" \
    "$san_assay" compare --paired --margin 0.05 "$tmp/pairs_brighter" "$tmp/pairs_dark"
expect "compare: paired and exchangeable" 3 "cannot be exchanged" \
    "$san_assay" compare --paired --exchangeable "$tmp/two.exr" "$tmp/two.exr"
# Without a margin nothing is equal; the last line has what makes it pass.
expect "compare: nothing found" 2 "^NO DIFFERENCE FOUND" "$san_assay" compare "$tmp/one.exr" "$tmp/two.exr"
accept=$("$san_assay" compare "$tmp/one.exr" "$tmp/two.exr" | sed -n '$s/^for CI: \(.*\) makes this exit with 0.*/\1/p')
expect "compare: nothing found, accepted: $accept" 0 "^NO DIFFERENCE FOUND" \
    "$san_assay" compare $accept --json "$tmp/accepted/results.json" "$tmp/one.exr" "$tmp/two.exr"
expect "compare: it has passed in the results, too" 0 "All 1 claims" "$san_assay" report --github "$tmp/accepted/results.json"
expect "compare: more could have been missed" 2 "accepted is no more than 0.01 % and 0.04 %" \
    "$san_assay" compare --accept-mdb 1e-4 -r "$tmp/accepted/page.html" "$tmp/one.exr" "$tmp/two.exr"
expect "compare: the page says so" 0 "NO DIFFERENCE FOUND</b>: .*accepted is no more than 0.01 %" grep -o "<b>NO DIFFERENCE FOUND</b>:[^<]*" "$tmp/accepted/page.html"
expect "compare: accepted and a margin" 3 "without --margin" \
    "$san_assay" compare --accept-mdb 0.1 --margin 0.1 "$tmp/one.exr" "$tmp/two.exr"
expect "compare: a margin of the variance that is not shown" 2 "^INCONCLUSIVE: the variance" \
    "$san_assay" compare --margin 0.5 --margin-variance 1e-4 "$tmp/one.exr" "$tmp/two.exr"
for size in "37 21 -s 1024" "1 1 -s 100000" "17 5 -s 1024"; do
    for seed in 1 2; do "$pathtracer" -q -r $size --seed $seed -f "$tmp/odd$seed.exr" $scene >/dev/null; done
    expect "compare: $size" 0 "^EQUIVALENT" "$san_assay" compare --margin 0.2 --tile 16 "$tmp/odd1.exr" "$tmp/odd2.exr"
done
expect "compare: missing file" 3 "gone.exr" "$san_assay" compare "$tmp/gone.exr" "$tmp/two.exr"
expect "compare: a PNG without its curve" 3 "what light is a code" \
    "$san_assay" compare "$tmp/a.png" "$tmp/two.exr"
expect "compare: other size" 3 "32" "$san_assay" compare "$tmp/a.exr" "$tmp/two.exr"
"$pathtracer" $small --sampler sobol -f "$tmp/sobol.exr" $scene >/dev/null
expect "compare: samples that are not independent" 3 "compare directories of 16 renders each, made with --seed 1" \
    "$san_assay" compare "$tmp/sobol.exr" "$tmp/sobol.exr"
expect "compare: json" 0 "EQUIVALENT" "$san_assay" compare --margin 0.02 --margin-tile 0.08 \
    --json "$tmp/cmp/results.json" "$tmp/one.exr" "$tmp/two.exr"
# compare: inputs from elsewhere. Replicates are any float images, so moments images do.
for option in --alpha --margin --margin-tile --margin-variance --accept-mdb --accept-mdb-tile --paired --again --exchangeable --same-program --filter-width --curve --spp-a --spp-b; do
    expect "compare: help names $option" 0 "$option" "$san_assay" compare --help
done
for k in 1 2 3 4 5; do
    for set in a b c a2 b2 c2; do
        mkdir -p "$tmp/runs_$set"
        case $set in c*) bounces=1 ;; *) bounces=5 ;; esac
        case $set in a) seed=10 ;; b) seed=20 ;; c) seed=30 ;; a2) seed=40 ;; b2) seed=50 ;; c2) seed=60 ;; esac
        "$pathtracer" -q -r 32 32 -s 32 -m $bounces --seed $((seed + k)) -f "$tmp/runs_$set/$k.exr" $scene \
            >/dev/null || not_ok "render runs_$set" "failed"
    done
done
expect "compare: directories" 1 "5 replicates" "$san_assay" compare "$tmp/runs_c" "$tmp/runs_b"
expect "compare: exchangeable, equal" 2 "^NO DIFFERENCE FOUND" \
    "$san_assay" compare --exchangeable --alpha 0.01 "$tmp/runs_a" "$tmp/runs_b"
expect "compare: exchangeable, what could be missed is accepted" 0 "^NO DIFFERENCE FOUND" \
    "$san_assay" compare --exchangeable --alpha 0.01 --accept-mdb 1 --accept-mdb-tile 9 "$tmp/runs_a" "$tmp/runs_b"
expect "compare: exchangeable, different" 1 "^DIFFERENT.*p = 0.00794 by 252 labellings" \
    "$san_assay" compare --exchangeable --alpha 0.01 "$tmp/runs_c" "$tmp/runs_b"
expect "compare: too few replicates" 2 "7 a side are needed" \
    "$san_assay" compare --exchangeable "$tmp/runs_c" "$tmp/runs_b"
expect "compare: exchangeable in two stages" 1 "^DIFFERENT.*fresh seeds.*p = 0.0079 and 0.004" \
    "$san_assay" compare --exchangeable --alpha 1e-4 --again "$tmp/runs_c2" "$tmp/runs_b2" \
    --json "$tmp/perm/results.json" "$tmp/runs_c" "$tmp/runs_b"
expect "compare: exchangeable, the same seeds again" 3 "fresh seeds" \
    "$san_assay" compare --exchangeable --alpha 1e-4 --again "$tmp/runs_c2" "$tmp/runs_b" "$tmp/runs_c" "$tmp/runs_b"
expect "compare: results have the notes" 0 "judged by permutation" grep '"notes"' -A 3 "$tmp/perm/results.json"
expect "report of directories" 0 "index.html" "$san_assay" report "$tmp/perm/results.json"
cp "$tmp/runs_a/1.exr" "$tmp/runs_a2/copy.exr"
cp "$tmp/runs_a/1.exr" "$tmp/runs_a2/copy2.exr"
expect "compare: a seed that was ignored" 3 "copy.exr and copy2.exr are the same image" \
    "$san_assay" compare "$tmp/runs_a2" "$tmp/runs_b"
expect "compare: exchangeable files" 3 "one.exr: cannot read" \
    "$san_assay" compare --exchangeable "$tmp/one.exr" "$tmp/two.exr"
expect "compare: exchangeable with a margin" 3 "no margin" \
    "$san_assay" compare --exchangeable --margin 0.1 "$tmp/runs_a" "$tmp/runs_b"
render -s 256 --seed 7 -m 4 -f "$tmp/shallow2.exr"
render -s 256 --seed 8 -f "$tmp/two2.exr"
expect "compare: two stages" 1 "^DIFFERENT.*confirmed" "$san_assay" compare --alpha 1e-9 \
    --again "$tmp/shallow2.exr" "$tmp/two2.exr" "$tmp/shallow.exr" "$tmp/two.exr"
expect "compare: two stages, not needed" 2 "were not needed" "$san_assay" compare --alpha 1e-3 \
    --again "$tmp/shallow2.exr" "$tmp/two2.exr" "$tmp/one.exr" "$tmp/two.exr"
expect "compare: two stages of the same files" 3 "fresh seeds" "$san_assay" compare --alpha 1e-9 \
    --again "$tmp/shallow.exr" "$tmp/two2.exr" "$tmp/shallow.exr" "$tmp/two.exr"
"$pathtracer" -q -r 64 64 -s 256 --seed 3 -f "$tmp/one.png" $scene >/dev/null
"$pathtracer" -q -r 64 64 -s 256 --seed 4 -f "$tmp/two.png" $scene >/dev/null
"$pathtracer" -q -r 64 64 -s 256 --seed 5 -m 1 -f "$tmp/shallow.png" $scene >/dev/null
expect "compare: PNG, equal but for what is saturated" 2 "note: saturated: [0-9]* of 4096" \
    "$san_assay" compare --curve srgb --margin 0.2 --margin-tile 0.8 "$tmp/one.png" "$tmp/two.png"
expect "compare: PNG, different" 1 "^DIFFERENT" \
    "$san_assay" compare --curve srgb --json "$tmp/png/results.json" "$tmp/shallow.png" "$tmp/two.png"
expect "report --github" 0 "^::error title=.*DIFFERENT, expected EQUIVALENT" \
    env GITHUB_STEP_SUMMARY="$tmp/summary.md" "$san_assay" report --github "$tmp/png/results.json"
expect "report --github: the summary" 0 "^## Of 1 claims 1 came out wrong" cat "$tmp/summary.md"
expect "report --github: with another" 3 "no other" "$san_assay" report --github --matrix "$tmp/png/results.json"
expect "report of PNGs" 0 "index.html" "$san_assay" report "$tmp/png/results.json"
expect "compare: the same program, equal" 2 "^NO DIFFERENCE FOUND: no sign of another law" \
    "$san_assay" compare --same-program "$tmp/one.exr" "$tmp/two.exr"
expect "compare: the same program, for CI" 0 "note: the mean by itself: EQUIVALENT" \
    "$san_assay" compare --same-program --accept-mdb 0.01 --accept-mdb-tile 0.1 --margin 0.02 --margin-tile 0.08 \
    "$tmp/one.exr" "$tmp/two.exr"
expect "compare: the same program, different" 1 "^DIFFERENT: the law changed: .*p < 1e-12" \
    "$san_assay" compare --same-program --alpha 1e-6 --json "$tmp/law/results.json" "$tmp/shallow.exr" "$tmp/two.exr"
expect "compare: results have the score" 0 '"score": "' cat "$tmp/law/results.json"
expect "report of the same program" 0 "index.html" "$san_assay" report "$tmp/law/results.json"
expect "compare: the same program, PNG without a curve" 1 "mean by itself was not judged: .*what light is a code" \
    "$san_assay" compare --same-program --alpha 1e-6 "$tmp/shallow.png" "$tmp/two.png"
expect "compare: the same program, no means for a page" 3 "needs means" \
    "$san_assay" compare --same-program --json "$tmp/law/png.json" "$tmp/one.png" "$tmp/two.png"
expect "compare: the same program, directories" 1 "flips of 121 pixels" \
    "$san_assay" compare --same-program --filter-width 3 "$tmp/runs_c" "$tmp/runs_b"
expect "compare: the same program, other samples" 3 "A has 8 samples a pixel, B 256" \
    "$san_assay" compare --same-program "$tmp/few.exr" "$tmp/two.exr"
expect "compare: the same program, one seed" 3 "one seed" \
    "$san_assay" compare --same-program "$tmp/one.png" "$tmp/one.png"
expect "compare: the same program, again" 3 "nor --again nor --paired" \
    "$san_assay" compare --same-program --again "$tmp/one.exr" "$tmp/one.exr" "$tmp/one.exr" "$tmp/two.exr"
expect "compare: a filter for nothing" 3 "is for --same-program" \
    "$san_assay" compare --filter-width 3 "$tmp/one.exr" "$tmp/two.exr"
expect "compare: PNG against moments" 1 "is not used" \
    "$san_assay" compare --curve srgb --filter-width 1 "$tmp/shallow.png" "$tmp/two.exr"
expect "compare: independent pixels, said of nothing" 3 "whose noise is not known" \
    "$san_assay" compare --filter-width 1 "$tmp/one.exr" "$tmp/two.exr"
expect "compare: nor of whole images" 3 "exchangeable takes whole images" \
    "$san_assay" compare --exchangeable --filter-width 1 "$tmp/runs_c" "$tmp/runs_b"
expect "compare: the same PNG" 3 "the same image" \
    "$san_assay" compare --curve srgb "$tmp/one.png" "$tmp/one.png"
expect "compare: a curve for nothing" 3 "neither" \
    "$san_assay" compare --curve srgb "$tmp/one.exr" "$tmp/two.exr"
expect "compare: unknown curve" 3 "none of" \
    "$san_assay" compare --curve film "$tmp/one.png" "$tmp/two.png"
expect "compare: samples of a file that says them" 3 "says itself" \
    "$san_assay" compare --spp-a 4 "$tmp/one.exr" "$tmp/two.exr"

expect "report of a comparison" 0 "index.html" "$san_assay" report "$tmp/cmp/results.json"
mkdir -p "$tmp/history"
for k in 1 2; do
    mkdir -p "$tmp/history/$k"
    sed "s/\"date\": \"2/\"date\": \"$k/" "$tmp/png/results.json" >"$tmp/history/$k/results.json"
done
expect "report --history" 0 "^0 of 1 claims moved in the last of 2 runs: .*/history/history.html" \
    "$san_assay" report --history "$tmp/history/"
sed -i 's/"difference": -*0/"difference": 9/' "$tmp/history/2/results.json"
expect "report --history: a move" 1 "^1 of 1 claims moved" "$san_assay" report --history "$tmp/history"
expect "report --history: nothing there" 3 "no results.json" "$san_assay" report --history "$tmp/runs_a"
expect "report --history with another option" 3 "alone" "$san_assay" report --history "$tmp/history" --matrix
expect "compare --report" 1 "^DIFFERENT" "$san_assay" compare --curve srgb --report "$tmp/png/page.html" \
    "$tmp/shallow.png" "$tmp/two.png"
expect "compare --report: the page has the notes" 0 "<li>.*rounded\|<li>.*curve" grep -A 3 'class="notes"' "$tmp/png/page.html"
expect "compare --report: only the page is left" 0 "^index.html page.html results.json results.json.a.exr results.json.b.exr results.json.relative.exr results.json.z.exr $" \
    sh -c "ls '$tmp/png' | tr '\\n' ' '"
expect "compare --report: no directory" 3 "one.exr: not a directory" "$san_assay" compare --margin 0.5 -r "$tmp/one.exr/page.html" \
    "$tmp/one.exr" "$tmp/two.exr"
expect "unknown verb" 3 "unknown verb" "$san_assay" assay
expect "report: no file" 3 "none.json" "$san_assay" report none.json

# Convergence. Controls: our own program with a slope that is not -1/2, with a bias, with a seed without
# effect.
converge="$assay converge -q --engine pathtracer --shrink 8 -k 8 --ladder 1,4,16 --alpha 0.01 --slope-margin 0.25"
expect "converge" 0 "slope of RMSE.*EQUIVALENT" \
    $converge --margin 0.2 -o "$tmp/conv" 41_cornell
expect "converge: results have all rungs" 0 "^3$" grep -c '"spp"' "$tmp/conv/results.json"
expect "converge: the depth ladder is on the page" 0 "Depth ladder" grep -o "<b>Depth ladder" "$tmp/conv/index.html"
expect "converge: too few samples to tell a bias" 2 "RMS bias.*INCONCLUSIVE" \
    $converge --margin 0.001 -o "$tmp/conv2" 41_cornell
expect "converge: against a long run of our own" 0 "pathtracer, 1024 samples" \
    $converge --margin 0.2 --reference own -o "$tmp/conv3" 41_cornell
expect "converge: against a closed form" 0 "closed form" \
    $converge --margin 0.2 -o "$tmp/conv4" 13_square_patch
faulty() {
    printf '#!/bin/bash\n%s\n' "$1" >"$tmp/faulty"
    chmod +x "$tmp/faulty"
}
faulty "exec $pathtracer \"\$@\" -s 4"
expect "converge: samples without effect" 1 "slope of RMSE.*DIFFERENT" \
    $converge --pathtracer "$tmp/faulty" -o "$tmp/conv5" 41_cornell
faulty "exec $pathtracer \"\$@\" -m 1"
expect "converge: a bias" 1 "RMS bias.*DIFFERENT" \
    $converge --pathtracer "$tmp/faulty" -o "$tmp/conv6" 41_cornell
faulty "exec $pathtracer \"\$@\" --seed 7"
expect "converge: a seed without effect" 3 "the seed has no effect" \
    $converge --pathtracer "$tmp/faulty" -o "$tmp/conv7" 41_cornell
expect "converge: no scene" 3 "name of a scene" "$san_assay" converge
expect "converge: unknown scene" 3 "no scene 'x'" "$san_assay" converge -o "$tmp/conv8" x
expect "converge: two rungs" 3 "three rungs" "$san_assay" converge --ladder 1,4 x
expect "converge: a ladder that falls" 3 "does not ascend" "$san_assay" converge --ladder 4,1,16 x
expect "converge: size" 3 "3 times smaller" "$san_assay" converge --shrink 3 -o "$tmp/conv8" 41_cornell
expect "report of convergence as Markdown" 0 "| slope of RMSE |" \
    "$san_assay" report --markdown "$tmp/conv/results.json"
expect "report of claims and convergence" 0 "joined.html" "$san_assay" report \
    --converge "$tmp/conv/results.json" -o "$tmp/joined.html" "$tmp/cmp/results.json"

# export.
expect "export to POV-Ray" 0 "c.pov" "$san_assay" export -o "$tmp/c.pov" $scene
expect "export to Cycles" 0 "c.json" "$san_assay" export -o "$tmp/c.json" $scene
expect "export to Mitsuba" 0 "c.xml" \
    "$san_assay" export -o "$tmp/c.xml" -m 3 -b 0.1 -d 2 -e "$tmp/a.exr" $scene
if xmllint --noout "$tmp/c.xml" && grep -q 'thinlens' "$tmp/c.xml" && [ -s "$tmp/c_environment.exr" ] &&
    [ "$(grep -c 'type="ply"' "$tmp/c.xml")" -eq "$(ls "$tmp"/c_object_*.ply | wc -l)" ]; then
    ok "the Mitsuba scene is XML, with its files"
else not_ok "the Mitsuba scene is XML, with its files" "$(ls "$tmp"/c[._]*)"; fi
for ending in json pov xml pbrt; do
    expect "orthographic camera to .$ending" 3 "an orthographic camera" "$san_assay" export -o "$tmp/o.$ending" $parts
done
expect "export to pbrt" 0 "c.pbrt" "$san_assay" export -o "$tmp/c.pbrt" -b 0.1 -d 2 $scene
expect "export: what pbrt has not" 3 "Beckmann" "$san_assay" export -o "$tmp/d.pbrt" reference/scenes/24_beckmann.dae
if ls "$tmp"/d.pbrt* >/dev/null 2>&1; then not_ok "a refused export leaves no file" "it does"; else
    ok "a refused export leaves no file"
fi
expect "export: a sky that is missing" 0 "warning.*give -e reference/scenes/46_sky.exr" \
    "$san_assay" export -o "$tmp/sky.json" reference/scenes/46_sky.dae
expect "export: the sky that was missing" 0 "^$tmp/sky.json$" \
    "$san_assay" export -o "$tmp/sky.json" -e reference/scenes/46_sky.exr reference/scenes/46_sky.dae
if grep -q warning "$tmp/err"; then not_ok "export: with its sky there is no warning" "$(cat "$tmp/err")"; else
    ok "export: with its sky there is no warning"
fi
expect "export: unknown kind" 3 "ends in none of" "$san_assay" export -o "$tmp/c.txt" $scene

# validate, against the goldens.
out=$tmp/report
validate="$assay validate -q --out $out"
expect "validate a closed form" 0 "EQUIVALENT" $validate --only 11_furnace
for file in index.html results.json junit.xml; do
    if [ -s "$out/$file" ]; then ok "validate writes $file"; else not_ok "validate writes $file" "no"; fi
done
if xmllint --noout "$out/junit.xml"; then ok "junit.xml is XML"; else not_ok "junit.xml is XML" "no"; fi
expect "a deliberate mismatch is found" 0 "DIFFERENT" $validate --budget 5m --only 91_albedo_2_percent
expect "validate: unknown scene" 3 "no scene" $validate --only 99_nothing

# More and more samples: cheap scenes are decided with fewer than the 64 and 256 declared.
expect "validate --budget" 0 "EQUIVALENT" \
    $validate --budget 5m --only 10_furnace_one --only 12_point_plane --only 31_spot_plane
# (Nine claims of ours, each with one look.)
if [ "$(grep -c '"n_a": 16.0' "$out/results.json")" -eq 18 ]; then
    ok "--budget decides with fewer samples than declared"
else not_ok "--budget decides with fewer samples than declared" "$(grep '"n_a"' "$out/results.json" | head -40)"; fi
expect "a spent budget is inconclusive" 2 "INCONCLUSIVE" $validate --budget 1s --only 41_cornell --only 45_many_lights
tell "a spent budget passes nothing" "$(python3 -c 'import json, sys
r = json.load(open(sys.argv[1]))
for c in r["claims"] + [n for n in r["noise"] if n["engine"] == "pathtracer"]: # what is stored of others is not judged
    if c["passed"]: print(c)' "$out/results.json")"
expect "a spent budget says so" 2 "budget spent" $validate --budget 0.001s --only 12_point_plane
expect "validate: alpha 1e-9 means two stages" 0 "EQUIVALENT" $validate --alpha 1e-9 --only 31_spot_plane
if [ "$(grep -c '"stages": 2' "$out/results.json")" -eq 2 ] && [ "$(grep -c '"stages": 1' "$out/results.json")" -eq 4 ]; then
    ok "two stages against the closed form, one against goldens"
else not_ok "two stages against the closed form, one against goldens" "$(grep '"stages"' "$out/results.json")"; fi
expect "validate: --budget is no time" 3 "5d" $validate --budget 5d
expect "validate: --stages" 3 "stages" $validate --stages 3

# Negative controls: wrong programs under test.
wrong() {
    printf '#!/bin/sh\n%s\n' "$1" >"$tmp/wrong"
    chmod +x "$tmp/wrong"
}
wrong "exec $pathtracer \"\$@\" -m 4"
expect "one bounce less fails" 1 "DIFFERENT" $validate --only 11_furnace/truth --pathtracer "$tmp/wrong"
expect "one bounce less fails at the first look" 1 "DIFFERENT" \
    $validate --until-different --only 11_furnace/truth --pathtracer "$tmp/wrong"
expect "one bounce less fails twice, with fresh seeds" 1 "DIFFERENT" \
    $validate --budget 5m --stages 2 --only 11_furnace/truth --pathtracer "$tmp/wrong"
if grep -q 'with fresh seeds, confirmed' "$out/results.json"; then ok "a second stage confirms"; else
    not_ok "a second stage confirms" "$(grep '"reason"' "$out/results.json")"
fi
wrong "exit 5"
expect "a program that dies is not judged" 3 "exit status 5" \
    $validate --only 11_furnace --pathtracer "$tmp/wrong"
wrong "sleep 60"
expect "a program that hangs is not judged" 3 "no end after" \
    $validate --only 11_furnace --timeout 1 --pathtracer "$tmp/wrong"
wrong "exit 0"
expect "a program that writes nothing is not judged" 3 "pathtracer.exr" \
    $validate --only 12_point_plane --pathtracer "$tmp/wrong"
expect "a missing program is not judged" 3 "nothing-here" \
    $validate --only 11_furnace --pathtracer "$tmp/nothing-here"

# Further renderers. student_tracer shares no code with ours; it reads the exported Mitsuba scene.
engine_path=$build:$build/tests:$PATH
few="--engine-spp 16 --engine-replicates 8"
student="$validate --only 12_point_plane $few" fake="$validate --only 12_point_plane/fake:truth $few --engine"
expect "another renderer is judged" 0 "student *pathtracer .*EQUIVALENT *EQUIVALENT" \
    env PATH="$engine_path" $student --engine student
# engine COMMAND [EXPRESSES]: the description of fake.sh, which is beside it.
engine() {
    cat >"$tmp/fake.json" <<EOF
{"name": "fake", "format": "mitsuba", "output": "mean", "image": "pfm", "command": [$1],
 "expresses": [${2:-"\"diffuse\", \"point\""}]}
EOF
}
# fake SCRIPT: a renderer that gets scene, spp, seed and out.
fake() {
    printf '#!/bin/sh\n%s\n' "$1" >"$tmp/fake.sh"
    chmod +x "$tmp/fake.sh"
}
command='"./fake.sh", "{scene}", "{spp}", "{seed}", "{out}"'
engine "$command"
# "A<tab>B<tab>VERDICT<tab>COMMAND" of claims that have one; the verdict of one.
claims_of() { python3 -c 'import json, sys
for c in json.load(open(sys.argv[1]))["claims"]:
    if "rerun" in c: print(c["a"], c["b"], c.get("verdict"), c["rerun"], sep="\t")' "$1"; }
verdict_of() { claims_of "$1" | awk -F '\t' -v a="$2" -v b="$3" '$1 == a && $2 == b { print $3; exit }'; }
fake 'exec student_tracer "$@" 1.05'
expect "a renderer that is 5 % too bright differs" 1 "fake *truth *+[45]\..*DIFFERENT *EQUIVALENT *WRONG" \
    env PATH="$engine_path" $fake "$tmp/fake.json"
# A spectral renderer, say, that mixes channels by a tenth: right for grey, and so with a run for each channel.
fake 'awk -F "\"" -v OFS="\"" "/<rgb/ { split(\$4, v, \", *\"); m = (v[1] + v[2] + v[3]) / 3
    \$4 = sprintf(\"%.9g, %.9g, %.9g\", v[1] + (m - v[1]) / 10, v[2] + (m - v[2]) / 10, v[3] + (m - v[3]) / 10) } 1" "$1" >"$1.xml"
scene=$1.xml
shift
exec student_tracer "$scene" "$@"'
expect "a renderer that mixes colours differs" 1 "fake *truth .*DIFFERENT *EQUIVALENT *WRONG" env PATH="$engine_path" $fake "$tmp/fake.json"
sed 's/"expresses"/"channels": "separate", "expresses"/' "$tmp/fake.json" >"$tmp/apart.json"
expect "and does not with each channel by itself" 0 "fake *truth .*EQUIVALENT *EQUIVALENT *ok" env PATH="$engine_path" $fake "$tmp/apart.json"
fake 'exec student_tracer "$@" 1.05'
# The commands that results.json has for each claim, here with names of suite and engine that need quotes: each judges
# its claim again, with the same verdict.
mkdir "$tmp/my suite" "$tmp/my engine"
cp reference/scenes/12_point_plane.* "$tmp/my suite"
cp "$tmp/fake.json" "$tmp/fake.sh" "$tmp/my engine"
env PATH="$engine_path" $student --out "$out/first" --suite "$tmp/my suite" --engine "$tmp/my engine/fake.json" >/dev/null 2>&1
reruns=0 differ=""
while IFS=$'\t' read -r a b verdict again; do
    (cd "$tmp" && env PATH="$engine_path" sh -c "$again -q --out '$out/again'") >/dev/null 2>&1
    found=$(verdict_of "$out/again/results.json" "$a" "$b")
    [ "$found" = "$verdict" ] || differ="$differ $a/$b: $verdict, '$found' by: $again"
    reruns=$((reruns + 1))
done < <(claims_of "$out/first/results.json")
tell "the $reruns printed commands judge their claims again" "$([ "$reruns" -ge 3 ] && echo "$differ" || echo "no commands")"
bad_engine() { # NAME PATTERN SCRIPT
    fake "$3"
    expect "a renderer that $1 is not judged" 3 "$2" $fake "$tmp/fake.json" --timeout 15
}
pfm='printf "PF\n64 64\n-1.0\n";'
bad_engine "exits with 1" "exit status 1: no light" 'echo no light; exit 1'
bad_engine "hangs" "no end after 15 s" 'sleep 100'
bad_engine "writes nothing" "wrote no image, .*replicate_0000.pfm is not there" ':'
bad_engine "writes garbage" "replicate_0000.pfm" 'echo garbage >$4'
bad_engine "writes another size" "3 x 1 pixels, not 64 x 64" \
    'printf "PF\n3 1\n-1.0\n123456789012123456789012123456789012" >$4'
bad_engine "writes NaN" "is not finite" "($pfm head -c 49152 /dev/zero | tr '\\0' '\\377') >\$4"
bad_engine "ignores its seed" "the seed has no effect" "($pfm yes abcdefg | head -c 49152) >\$4"
bad_engine "finds light once" "replicate 2 is black, as an earlier one is: no light was found (see " \
    "n=\$(cat '$tmp/lit' 2>/dev/null || echo 0); echo \$((n + 1)) >'$tmp/lit'; ($pfm if [ \$n = 0 ]; then yes abcdefg; else cat /dev/zero; fi | head -c 49152) >\$4"
tell "and its image is kept" "$(ls "$(sed -n 's/.*(see \(.*\)).*/\1/p' "$tmp/err" | head -n 1)"/replicate_0002.pfm 2>&1 >/dev/null)"
bad_engine "makes one of two images" "replicate 2 is the same image as an earlier one: the program has few different images" \
    "n=\$(cat '$tmp/calls' 2>/dev/null || echo 0); echo \$((n + 1)) >'$tmp/calls'; ($pfm yes abcdef\$((n % 2)) | head -c 49152) >\$4"
sed -i 's/"pfm"/"hdr"/' "$tmp/fake.json"
bad_engine "has less noise than RGBE shows" "or less than RGBE's 8 bits show" \
    "(printf '#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 64 +X 64\n'; yes abcdefg | head -c 16384) >\$4"
sed -i 's/"hdr"/"pfm"/' "$tmp/fake.json"
rm "$tmp/fake.sh"
expect "a renderer that is not there is not judged" 3 "fake.sh: no such program" \
    $fake "$tmp/fake.json"
bad_description() { # NAME PATTERN
    expect "description: $1" 3 "fake.json: .*$2" \
        "$san_assay" validate --only 12_point_plane --engine "$tmp/fake.json"
}
engine "$command, \"{samples}\""
bad_description "unknown placeholder" "'command' \[5\]: unknown placeholder '{samples}'"
engine '"x", "{scene}", "{out}"'
bad_description "no seed" "no {seed}"
engine "$command" '"magic"'
bad_description "unknown feature" "'magic' is no feature"
echo '{"name": "fake", "colour": 1}' >"$tmp/fake.json"
bad_description "unknown key" "unknown key 'colour'"
engine "$command" '"diffuse"'
expect "a renderer that can express nothing" 3 "fake can express none .*does not list: point" \
    $student --engine "$tmp/fake.json"
# Convergence of any renderer. Controls: a bias, and samples that are not taken.
converge="env PATH=$engine_path $assay converge -q --shrink 4 -k 8 --ladder 1,4,16 --alpha 0.01 --slope-margin 0.25 --margin 0.05"
# said PATTERN...: the last command printed a line with each.
said() { for pattern; do grep -q "$pattern" "$tmp/out" || echo "no line with $pattern"; done; }
expect "converge: another renderer beside ours" 0 "^student *variance / pathtracer's at 16 spp" \
    $converge --engine student --engine pathtracer -o "$tmp/conv9" 13_square_patch
tell "converge: which is judged" "$(said "^student *slope of RMSE .*EQUIVALENT" "^student *RMS bias .*EQUIVALENT")"
expect "converge: a renderer that is noisier than another" 1 "^student: at 16 samples its variance is .* times that of pathtracer-sobol .*, margin 100 %" \
    $converge --engine student --engine pathtracer-sobol --margin-variance 1 -o "$tmp/conv9" 13_square_patch
tell "converge: which the row says, too" "$(said "^student *variance / pathtracer-sobol's at 16 spp .*DIFFERENT" "^student *variance / pathtracer-sobol's at 1 spp .*MEASURED")"
expect "converge: one that is less noisy" 0 "^pathtracer-sobol *variance / student's at 16 spp .*EQUIVALENT" \
    $converge --engine pathtracer-sobol --engine student --margin-variance 1 -o "$tmp/conv9" 13_square_patch
expect "converge: of the noise of one alone nothing can be said" 3 "margin-variance is of the first --engine over others" $converge --engine student --margin-variance 1 13_square_patch
engine "$command" '"diffuse", "area"'
fake 'exec student_tracer "$@" 1.2'
expect "converge: another renderer with a bias" 1 "^fake: .*RMS bias is above 5 %" \
    $converge --engine "$tmp/fake.json" -o "$tmp/conv9" 13_square_patch
expect "converge: its page says why" 0 "<b>fake</b>: .*RMS bias is above 5 %" cat "$tmp/conv9/index.html"
fake 'exec student_tracer "$1" 4 "$3" "$4"'
expect "converge: another renderer whose samples have no effect" 1 "^fake: the slope is not at most -1/2" \
    $converge --engine "$tmp/fake.json" -o "$tmp/conv9" 13_square_patch
expect "converge: what a renderer cannot express" 3 "student: could not be judged: it cannot express this scene: .*mirror" \
    $converge --engine student -o "$tmp/conv9" 21_mirror
# described NAME OUTPUT_AND_KEYS [WORDS]: our renderer, described in NAME.json.
described() {
    echo "{\"name\": \"$1\", \"format\": \"dae\", \"expresses\": [\"diffuse\", \"area\"], \"output\": $2,
        \"command\": [\"$pathtracer\", \"-q\", \"{scene}\", \"-s\", \"{spp}\", \"-r\", \"{width}\", \"{height}\", ${3:-} \"-f\", \"{out}\"]}" >"$tmp/$1.json"
}
described stated '"moments"' '"--seed", "{seed}",'
expect "converge: a renderer that writes moments" 0 "^stated *slope of RMSE .*EQUIVALENT" \
    $converge --engine "$tmp/stated.json" -o "$tmp/conv9" 13_square_patch
described tent '"mean", "filter": "tent:1"' '"--seed", "{seed}", "--filter", "tent:1",'
tent="${converge/--shrink 4/} --engine $tmp/tent.json"
expect "converge: a renderer with another pixel filter" 0 "^tent *RMS bias .*EQUIVALENT" $tent -o "$tmp/conv9" 13_square_patch
expect "converge: which stored references have not" 3 "cycles: stored with the pixel filter box:0.5, not tent:1" \
    $tent --reference cycles -o "$tmp/conv9" 13_square_patch
expect "converge: and which cannot be made smaller" 3 "tent: --shrink is for pixel filters of one box" $converge --engine "$tmp/tent.json" 13_square_patch
expect "converge: two filters have no common reference" 3 "its pixel filter is box:0.5, that of tent tent:1" \
    $tent --engine student 13_square_patch
described same '"noisy"'
expect "converge: a renderer without seeds" 3 "same.json: convergence is measured on images with seeds" $converge --engine "$tmp/same.json" 13_square_patch
expect "converge: an engine twice" 3 "pathtracer is given twice" $converge --engine pathtracer --engine pathtracer 13_square_patch
expect "converge: an engine that is not there" 3 "engines/blendr.json: cannot read" $converge --engine blendr 13_square_patch
expect "converge: a reference that is not there" 3 "13_square_patch has no reference 'pbrt'" $converge --engine student --reference pbrt 13_square_patch
sed 's/"point", //' reference/engines/student.json >"$tmp/no_points.json"
expect "what a renderer cannot express is listed" 0 "student cannot express 12_point_plane" \
    env PATH="$engine_path" $validate --only 11_furnace/student:truth --only 12_point_plane \
    --engine "$tmp/no_points.json" --engine-spp 4 --engine-replicates 3

# An engine's own pixel filter: references are made with it, and a filter other than the declared one is found.
filtered() { # FILTER
    cat >"$tmp/filtered.json" <<END
{"name": "filtered", "format": "dae", "expresses": ["diffuse", "environment"], "output": "mean", "spp": 256, "replicates": 16,
 "command": ["$PWD/build/pathtracer", "-q", "{scene}", "-s", "{spp}", "-m", "{depth}", "--seed", "{seed}", "-r", "{width}",
             "{height}", "-t", "{threads}", "--filter", "$1", "-f", "{out}"],
 "environment_args": ["-e", "{environment}"], "filter": "gauss:0.5:2", "shared_samples": false}
END
    "$assay" validate -q --only 34_sky_constant/filtered:truth --engine "$tmp/filtered.json" -o "$tmp/filtered"
}
expect "a pixel filter that is declared is that of both sides" 0 "^filtered has the pixel filter gauss:0.5:2, .*left out.* cycles in" filtered gauss:0.5:2
expect "a wider filter than is declared is found" 1 "34_sky_constant  *filtered  *truth .* DIFFERENT" filtered gauss:0.6:2.4

# Missing, stale and damaged goldens are never a pass.
expect "missing goldens are not judged" 3 "11_furnace" $validate --only 11_furnace/cycles --golden "$tmp/none"
cp -R golden "$tmp/golden"
printf 'x' >>"$tmp/golden/11_furnace/cycles.exr"
expect "a damaged golden is not judged" 3 "cycles" $validate --only 11_furnace/cycles --golden "$tmp/golden"
cp -R reference/scenes "$tmp/scenes"
echo '<!-- changed -->' >>"$tmp/scenes/11_furnace.dae"
expect "a stale golden is not judged" 3 "11_furnace" $validate --only 11_furnace/cycles --suite "$tmp/scenes"

# golden: what may be stored. The stored goldens serve as candidates.
golden="$san_assay golden"
expect "golden status" 0 "current  41_cornell/cycles" $golden status
expect "golden status of damaged goldens" 3 "damaged  11_furnace/cycles" \
    $golden status --golden "$tmp/golden"
expect "golden status of another scene" 3 "stale    11_furnace/cycles" \
    $golden status --suite "$tmp/scenes"
expect "golden approve needs names" 3 "takes --all, --new or names" $golden approve --from golden
expect "golden approve: nothing is stored" 3 "approve it with --new" \
    $golden approve --from golden --golden "$tmp/store" 11_furnace
expect "golden approve --new" 0 "6 approved" \
    $golden approve --from golden --golden "$tmp/store" --new 11_furnace
expect "golden approve: the same again" 0 "1 unchanged" \
    $golden approve --from golden --golden "$tmp/store" 11_furnace/cycles
expect "golden approve: no candidate" 3 "no candidate in" \
    $golden approve --from "$tmp/none" --golden "$tmp/store" 11_furnace/cycles
expect "golden approve --all: none needed" 0 "0 approved, 0 unchanged" \
    $golden approve --all --from "$tmp/none" --golden "$tmp/store" 11_furnace/cycles
expect "golden approve: not in the suite" 3 "no such reference" \
    $golden approve --from golden --golden "$tmp/store" 98_deleted/cycles
# Two images and four records of noise share the alpha of the run, 1e-3.
mkdir "$tmp/again" && cp -R "$tmp/store/11_furnace" "$tmp/again"
sed -i 's/"made": *"2/"made":"3/g' "$tmp/again/11_furnace/noise.json"
expect "golden approve: noise that was measured again" 0 "4 approved, 2 unchanged" \
    $golden approve --from "$tmp/again" --golden "$tmp/store" 11_furnace
tell "each of six candidates has a sixth of alpha" "$(grep -o '"alpha": *[0-9.e-]*' "$tmp/store/11_furnace/noise.json" | sed 's/.*://' |
    awk '6 * $1 > 0.000999 && 6 * $1 < 0.001001 { n++ } END { if (n != 4 || NR != 4) print n + 0, "of", NR }')"
cp -R golden/41_cornell "$tmp/store/98_deleted"
expect "golden status: an orphan" 3 "orphan   .*98_deleted/cycles" $golden status --golden "$tmp/store"
expect "golden: unknown" 3 "none of render" $golden forget

# diagnose: names a bug, and none where there is none.
expect "diagnose: help lists the views" 0 "12_point_plane" "$san_assay" diagnose --help
expect "diagnose: the correct renderer" 0 "nothing wrong found" "$assay" diagnose --seed 5
if tests/mutants/mutants.sh --quick --build-only "$plain" point_light_linear seed_ignored variance_halved; then
    ok "bugs can be built"
else
    not_ok "bugs can be built" "see $build/mutants"
fi
for bug in point_light_linear seed_ignored variance_halved; do
    expect "diagnose: $bug" 1 "tests/mutants/$bug.patch" "$assay" diagnose --seed 6 \
        --pathtracer "$plain/mutants/$bug/pathtracer" --json "$tmp/diagnosis.json"
    expect "diagnose: $bug alone" 0 "\"named\":\[\"$bug\"\]" bash -c "tr -d ' \n' <'$tmp/diagnosis.json'"
done
expect "diagnose: left out of the catalogue" 1 "none of the" "$assay" diagnose --seed 6 \
    --pathtracer "$plain/mutants/point_light_linear/pathtracer" --without point_light_linear
expect "a validation of a wrong renderer" 1 "DIFFERENT" "$assay" validate --only 12_point_plane \
    --pathtracer "$plain/mutants/point_light_linear/pathtracer" --out "$tmp/wrong_suite"
expect "diagnose: the images of a validation" 1 "tests/mutants/point_light_linear.patch" \
    "$assay" diagnose "$tmp/wrong_suite/results.json"
sed "s|{here}/mine.sh|$tmp/wrong_engine.sh|; s|\"spp\": 32, \"replicates\": 64|\"spp\": 16, \"replicates\": 16|" reference/engines/mine.json >"$tmp/wrong_engine.json"
sed "s|^exec pathtracer|exec '$plain/mutants/point_light_linear/pathtracer'|" reference/engines/mine.sh >"$tmp/wrong_engine.sh"
chmod +x "$tmp/wrong_engine.sh"
expect "a validation of a wrong engine" 1 "DIFFERENT" "$assay" validate --only 12_point_plane --engine "$tmp/wrong_engine.json" --out "$tmp/wrong_engine"
expect "diagnose: the engine of a validation" 1 "tests/mutants/point_light_linear.patch" "$assay" diagnose "$tmp/wrong_engine/results.json"
# Another program may differ by less than the margin (0.3 % for Cycles) and is not accused of it; for 2 % it is.
cp reference/engines/mine.sh "$tmp/scaled.sh"
sed -i "s|^exec pathtracer|exec $pathtracer|" "$tmp/scaled.sh"
for case in "1.002 0 nothing wrong found" "1.02 1 none of the"; do
    read -r scale code words <<<"$case"
    sed "s|{here}/mine.sh|$tmp/scaled.sh|; s|\"point\"|&, \"area\"|; s|\"spp\": 32, \"replicates\": 64|\"spp\": 16, \"replicates\": 16, \"scale\": $scale|" reference/engines/mine.json >"$tmp/scaled.json"
    "$assay" validate -q --only 12_point_plane --only 13_square_patch/mine:pathtracer --engine "$tmp/scaled.json" --out "$tmp/scaled" >"$tmp/out" 2>&1
    expect "diagnose: an engine whose images are $scale times ours" "$code" "$words" "$assay" diagnose "$tmp/scaled/results.json"
done
expect "diagnose: what the catalogue does not know" 1 "not looked at: 13_square_patch: it is DIFFERENT" "$assay" diagnose "$tmp/scaled/results.json"
# Nor is it accused of a pixel filter that it declares, which shows at the edge of a cone of light.
sed "s|^exec pathtracer|exec $pathtracer --filter gauss:0.5:2|" reference/engines/mine.sh >"$tmp/scaled.sh"
sed "s|{here}/mine.sh|$tmp/scaled.sh|; s|\"point\"|&, \"spot\", \"falloff\"|; s|\"spp\": 32, \"replicates\": 64|\"spp\": 64, \"replicates\": 16, \"filter\": \"gauss:0.5:2\", \"shared_samples\": false|" \
    reference/engines/mine.json >"$tmp/scaled.json"
"$assay" validate -q --only 38_spot_edge/mine:pathtracer --engine "$tmp/scaled.json" --out "$tmp/scaled" >"$tmp/out" 2>&1
expect "diagnose: an engine with a pixel filter" 0 "nothing wrong found" "$assay" diagnose "$tmp/scaled/results.json"
plane="$pathtracer -q -m 1 -s 64 reference/scenes/12_point_plane.dae"
$plane -r 48 48 -f "$tmp/plane.exr" >"$tmp/out" && $plane -r 40 40 -f "$tmp/odd.exr" >"$tmp/out"
expect "diagnose: one image, larger than the catalogue's" 0 "nothing wrong found" \
    "$san_assay" diagnose --scene 12_point_plane "$tmp/plane.exr"
expect "diagnose: a size that is no multiple" 3 "40 x 40 pixels: the width has to be" \
    "$san_assay" diagnose --scene 12_point_plane "$tmp/odd.exr"
expect "diagnose: another shape" 3 "width by height is not" \
    "$san_assay" diagnose --scene 39_three_lamps-four_light_samples "$tmp/plane.exr"
expect "diagnose: unknown view" 3 "has no '99_none'" "$san_assay" diagnose --scene 99_none "$tmp/plane.exr"
expect "diagnose: no image" 3 "needs the image" "$san_assay" diagnose --scene 12_point_plane
expect "diagnose: unknown bug" 3 "has no bug 'x'" "$san_assay" diagnose --without x
expect "diagnose: no catalogue" 3 "none/manifest.json" "$san_assay" diagnose --catalogue "$tmp/none"
expect "diagnose: no program" 3 "no such program" "$san_assay" diagnose --pathtracer "$tmp/none"

# Each part of `make bench` on its smallest case: tests that it runs, not its results.
ASSAY_CS184=$tmp/none expect "bench, a tiny run that says what it skips" 0 "SKIPPED: no $tmp/none" \
    "$build/tests/bench" --smoke --build "$build" --out "$tmp/bench"
expect "bench: its figures" 0 '"mrays_per_cpu_second"' cat "$tmp/bench/results.json"
expect "bench: no such part" 3 "'nonsense' is none of: rays, paths, jobs, scaling" "$build/tests/bench" nonsense

# Grading: right programs among hostile ones; a hostile one costs its author the check, and never stops the run.
expect "grade: help" 0 "unsafe-no-sandbox" "$san_assay" grade --help
expect "grade: the rubric of the course" 0 "100 points" "$san_assay" grade --check-rubric tools/rubrics/cs184-3-1.rubric
sed 's/^  spp 16/  spp sixteen/; s/^check point 4/check point 4 5/' tools/rubrics/template.rubric >"$tmp/wrong.rubric"
expect "grade: a mistake has its line" 3 "wrong.rubric:1[0-9]: spp" "$san_assay" grade --check-rubric "$tmp/wrong.rubric"
expect "grade: mistakes are counted" 3 "mistakes" "$san_assay" grade --check-rubric "$tmp/wrong.rubric"
expect "grade: no submission" 3 "no submission" "$san_assay" grade tools/rubrics/template.rubric
# The folder of a grade is made anew: nobody's work is removed for it.
mkdir -p "$tmp/handed/ada" "$tmp/other/ada" && touch "$tmp/handed/ada/a.png" "$tmp/other/ada/mine"
expect "grade: into the folder of the submissions" 3 "the grade of .*handed/ada would take its place" "$san_assay" grade -o "$tmp/handed" tools/rubrics/template.rubric "$tmp/handed"/*
expect "grade: the same from within" 3 "the grade of ada would take its place" env -C "$tmp/handed" "$san_assay" grade -o . "$PWD/tools/rubrics/template.rubric" ada
expect "grade: over a folder of somebody else" 3 "other/ada is there already, and no grade" "$san_assay" grade -o "$tmp/other" tools/rubrics/template.rubric "$tmp/handed/ada"
tell "grade: all of them are still there" "$(ls "$tmp/handed/ada/a.png" "$tmp/other/ada/mine" 2>&1 >/dev/null)"
cp tests/end_to_end/quick.rubric "$tmp/quick.rubric"
mkdir -p "$tmp/subs" "$tmp/subs/images" "$tmp/subs/empty" "$tmp/subs/source" "$tmp/subs/linked"
sub() { # NAME: a shell script from stdin
    { echo '#!/bin/sh' && cat; } >"$tmp/subs/$1" && chmod +x "$tmp/subs/$1"
}
cp "$pathtracer" "$tmp/subs/right"
"$pathtracer" -q -s 16 -m 1 -r 64 64 --seed 9 -f "$tmp/subs/images/point.png" reference/scenes/12_point_plane.dae >/dev/null
cp "$pathtracer" "$tmp/subs/source/pathtracer"
ln -s "$tmp/subs/images/point.png" "$tmp/subs/linked/point.png"
cp "$pathtracer" "$tmp/subs/other_scene.bin"
sub crash <<<'kill -SEGV $$'
sub hang <<<'trap "" TERM; while :; do sleep 1; done'
sub fork_bomb <<<'b() { b | b & }; b; wait; sleep 100'
sub huge_file <<<'exec head -c 100G /dev/zero >out.png'
sub link_out <<<"ln -s $tmp/subs/images/point.png out.png"
sub reads_golden <<<"cp $PWD/golden/12_point_plane/* $tmp/subs/images/point.png out.png"
sub made_up <<<'echo "{\"score\": 100}" >results.json; echo "{\"points\": 100}" >grade.json; echo "0 ended" >.report'
sub noise <<<'head -c 12288 /dev/urandom >out.png'
sub text <<<'echo "I am an image" >out.png'
sub nothing <<<'exit 0'
{ printf '\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\1\0\0\0\1\0\0\x08\2\0\0\0\xe3\xe6\xa7\xb4\0\0\0\x10IDAT' && head -c 100 /dev/zero; } >"$tmp/subs/bomb.png"
mkdir -p "$tmp/subs/bomb" && mv "$tmp/subs/bomb.png" "$tmp/subs/bomb/point.png" && rm "$tmp/subs/other_scene.bin"
if "$assay" grade -q -o "$tmp/probe" "$tmp/quick.rubric" "$tmp/subs/right" >"$tmp/out" 2>&1; then
    expect "grade: a batch, of which staff look at some" 2 "right  *8.00 of 8" "$assay" grade -j2 -o "$tmp/grades" "$tmp/quick.rubric" "$tmp/subs"/*
    points() { awk -F, -v id="\"$1\"" '$1 == id { print $2 }' "$tmp/grades/grades.csv"; }
    for good in right images source; do
        [ "$(points $good)" = 8.00 ] && ok "grade: $good has all points" || not_ok "grade: $good has all points" "$(points $good)"
    done
    for bad in crash hang fork_bomb huge_file link_out linked reads_golden made_up noise text nothing bomb empty; do
        [ "$(points $bad)" = 0.00 ] && ok "grade: $bad has none" || not_ok "grade: $bad has none" "$(points $bad)"
    done
    for why in "crash signal 11" "hang no end after 10 s" "huge_file all 16 MiB of its directory are full" "link_out wrote no out.png" \
        "nothing wrote no out.png" "noise not an OpenEXR" "bomb 65536 x 65536" "empty It does not start: there is no program"; do
        expect "grade: what $why" 0 "${why#* }" cat "$tmp/grades/${why%% *}/results.json"
    done
    expect "grade: Gradescope's fields" 0 '"max_score": 8.0' cat "$tmp/grades/right/results.json"
    expect "grade: the chance of another score" 0 '"chance": [0-9.e-]*' cat "$tmp/grades/right/grade.json"
    expect "grade: JUnit as Ant's schema has it" 0 '^true$' xmllint --xpath 'count(//testsuite[@id and @package and @hostname and @timestamp and *[1][self::properties] and *[last()][self::system-err]]) = count(//testsuite) and not(//testcase[not(@classname and @time)] | //failure[not(@type)])' "$tmp/grades/junit.xml"
    expect "grade: JUnit" 0 'testsuite name="fork_bomb" tests="1" failures="1"' xmllint "$tmp/grades/junit.xml"
    cp "$tmp/grades/grades.csv" "$tmp/first.csv" && rm -r "$tmp/grades/right" "$tmp/grades/text"
    expect "grade: goes on where it was" 2 "right  *8.00 of 8" "$assay" grade -o "$tmp/grades" "$tmp/quick.rubric" "$tmp/subs"/*
    cmp -s "$tmp/first.csv" "$tmp/grades/grades.csv" && ok "grade: the same points again" || not_ok "grade: the same points again" "they differ"
    mkdir "$tmp/two" && cp -r "$plain/mutants/light_pdf_unnormalised" "$tmp/two/student" && cp "$pathtracer" "$tmp/two/right"
    cp -r tools/rubrics/cs184-bugs tools/rubrics/corner.dae "$tmp"
    { # one image of those whose bugs are known
        printf '%s\n' "rubric Named" "bugs cs184-bugs" "total 10" \
            "command {program} -q -s {spp} -l {lights} -m {bounces} -r {width} {height} --seed {seed} {options} -f {out} {scene}"
        sed -n '/^image corner$/,/^ *reference/p' tools/rubrics/cs184-3-1.rubric
        printf '%s\n' "part 4 Indirect light" "check corner 8 equal corner" "image 0.02 0.08" "tile 0.06 0.2" \
            "check secret 2 equal corner" "image 0.02 0.08" "tile 0.06 0.2" "title Behind the curtain" "visibility hidden"
    } >"$tmp/named.rubric"
    expect "grade: with diagnosis" 0 "student  *0.00 of 10" "$assay" grade -j 2 -o "$tmp/named" "$tmp/named.rubric" "$tmp/two"/*
    expect "grade: the bug is named" 0 '"name": "light_pdf_unnormalised"' cat "$tmp/named/student/grade.json"
    expect "grade: to the student" 0 "This looks like: " cat "$tmp/named/student/results.json"
    expect "grade: on the page" 0 "This looks like a known mistake" cat "$tmp/named/student/index.html"
    expect "grade: the plot of it" 0 "all points while a bar touches green" cat "$tmp/named/student/index.html"
    expect "grade: and whether another run would change it" 0 "gets the same points here" cat "$tmp/named/student/index.html"
    expect "grade: a right program is not diagnosed" 0 '"diagnosis": null' cat "$tmp/named/right/grade.json"
    expect "grade: staff see who has it" 0 'student/index.html.*density lacks a factor of the distance' bash -c "tr -d '\n' <'$tmp/named/index.html'"
    if ! grep -q "<html" "$tmp/named/student/index.html" ||
        grep -q "Behind the curtain\|http://\|https://\|<script" "$tmp/named/student/index.html"; then
        not_ok "grade: the page has no hidden check and needs no other file" "it does"
    else
        ok "grade: the page has no hidden check and needs no other file"
    fi
    expect "grade: two of a name" 3 "would both be" "$assay" grade -o "$tmp/x" "$tmp/quick.rubric" "$tmp/subs/right" "$tmp/probe/../subs/right"
elif grep -q "no sandbox" "$tmp/out"; then
    echo "skip grade: programs of submissions, hostile and right ($(cat "$tmp/out"))"
else
    not_ok "grade: one submission" "$(cat "$tmp/out")"
fi
expect "grade: references alone" 0 "references of .*quick.rubric" "$assay" grade --prepare -o "$tmp/prepared" "$tmp/quick.rubric"
expect "grade: which are there" 0 "[.]exr" ls "$tmp/prepared/.references"
expect "grade: references and no submission" 3 "takes no submissions" "$san_assay" grade --prepare tools/rubrics/template.rubric x
expect "grade: without bubblewrap it refuses" 3 "unsafe-no-sandbox" env PATH=/nowhere "$assay" grade -o "$tmp/x" "$tmp/quick.rubric" "$tmp/subs/right"

# Installed elsewhere, it needs nothing of the checkout.
if make -s BUILD="$plain" PREFIX="$tmp/usr" install >"$tmp/out" 2>&1; then ok "make install"; else
    not_ok "make install" "$(cat "$tmp/out")"
fi
# Installed below /usr, it is hidden from a submission's build, which would copy it.
installed=/usr/local/assay-installed.$$
if [ "$(id -u)" = 0 ] && make -s BUILD="$plain" PREFIX="$installed" install >"$tmp/out" 2>&1; then
    mkdir -p "$tmp/copies" && chmod 711 "$tmp"
    printf 'pathtracer:\n\tcp %s/bin/pathtracer pathtracer\n' "$installed" >"$tmp/copies/Makefile"
    sed 's/^command/build make\ncommand/' tests/end_to_end/quick.rubric >"$tmp/copies.rubric"
    for mode in "" --unsafe-no-sandbox; do
        expect "installed below /usr, a build cannot copy it $mode" 2 " 0.00 of 8" "$installed/bin/assay" grade $mode -o "$tmp/copied" "$tmp/copies.rubric" "$tmp/copies"
    done
else echo "skip installed below /usr: only root can do that"; fi
rm -rf "$installed"
cd "$tmp" || exit 1
expect "the installed programs work" 0 "EQUIVALENT" \
    "$tmp/usr/bin/assay" validate -q --out "$tmp/installed" --only 11_furnace/cycles
printf 'PF\n1 1\n-1.0\n%012d' 0 >"$tmp/one.pfm"
expect "installed, it reads images from elsewhere" 3 "A and B are the same image" "$tmp/usr/bin/assay" compare "$tmp/one.pfm" "$tmp/one.pfm"
mv "$tmp/usr/lib/assay/oiio.so" "$tmp/oiio.so"
expect "without OpenImageIO: a line" 3 "cannot load what reads images: .*oiio.so is not there" "$tmp/usr/bin/assay" compare "$tmp/one.pfm" "$tmp/one.pfm"
expect "without it PNG is read" 1 "^DIFFERENT" "$tmp/usr/bin/assay" compare --curve srgb "$tmp/shallow.png" "$tmp/two.png"
echo garbage >"$tmp/usr/lib/assay/oiio.so"
expect "with a damaged one: a line" 3 "cannot load what reads images: .*oiio.so" "$tmp/usr/bin/assay" compare "$tmp/one.pfm" "$tmp/one.pfm"

[ $failures -eq 0 ]
