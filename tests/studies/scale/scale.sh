#!/bin/bash
# tests/studies/scale/scale.sh BUILD: renders, a grading batch and a validation in jobs (`assay plan`, `run-job`, `gather`) have the bits of the same
# commands without; what must not be taken for done is not. Slurm: tests/studies/scale/slurm.sh. Prints "ok NAME" or "not ok NAME: why".
set -u
build=$(realpath "${1:?usage: tests/studies/scale/scale.sh BUILD}")
pathtracer=$build/pathtracer assay=$build/assay san_assay=$build/san/assay
scene=$PWD/reference/scenes/41_cornell.dae
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0

what=jobs
. tests/end_to_end/expect.sh
# in_jobs NAME PARTS again|once ARGUMENT...: the images of the arguments, l.exr and l.png whole, x.exr and x.png from jobs, the last first.
in_jobs() {
    local name=$1 parts=$2 again=$3 why="" num
    shift 3
    rm -rf "$tmp/plan" "$tmp"/[lx].*
    local words=(-q -r 37 29 --seed 3 --keep-state)
    "$pathtracer" "${words[@]}" -f "$tmp/l.exr" -f "$tmp/l.png" "$@" >/dev/null 2>"$tmp/err" || why="$(cat "$tmp/err")"
    "$assay" plan --plan "$tmp/plan" --parts "$parts" pathtracer "${words[@]}" -f "$tmp/x.exr" -f "$tmp/x.png" "$@" >"$tmp/jobs" 2>"$tmp/err" || why="$(cat "$tmp/err")"
    num=$(grep -c '^{"job"' "$tmp/jobs")
    { [ "$num" -ge "$parts" ] && [ "$num" -le $((2 * parts)) ]; } || why="$num jobs for $parts: $why"
    "$assay" run-job "$tmp/plan" $(seq $((num - 1)) -1 0) >/dev/null 2>"$tmp/err" || why="$(cat "$tmp/err")"
    "$assay" gather "$tmp/plan" >/dev/null 2>"$tmp/err" || why="$(cat "$tmp/err")"
    [ -z "$why" ] && { cmp "$tmp/l.png" "$tmp/x.png" >"$tmp/out" 2>&1 || why="$(cat "$tmp/out")"; }
    # How far an adaptive render counts depends on its passes, and stands in the state's head and hash; its pixels do not.
    case " $* " in
    *adaptive* | *' -a '*)
        cmp "$tmp/l_rate.png" "$tmp/x_rate.png" >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/out")"
        [ "$(cmp -l "$tmp/l.exr.state" "$tmp/x.exr.state" | wc -l)" -le 36 ] || why="$why other sums"
        ;;
    *) cmp "$tmp/l.exr.state" "$tmp/x.exr.state" >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/out")" ;;
    esac
    # The image by another way: made again at once, and compared value by value.
    [ -z "$why" ] && [ "$again" = again ] && { "$assay" reproduce "$tmp/x.exr" >"$tmp/out" 2>&1 || why="$(cat "$tmp/out")"; }
    tell "$name" "$why"
}
in_jobs "cells beside each other" 6 again -s 5 --aov "$scene"
in_jobs "more jobs than sixteens of rows" 23 again -s 3 --sampler sobol --guiding on "$scene"
in_jobs "the assignment's adaptive rule" 2 once -s 24 -a 4 0.3 "$scene"
in_jobs "a pilot, a part of the samples of a cell, an environment" 2 once -s 24 --samples 3:20 -p 5 4 27 21 --adaptive-unbiased 0.3 --pilot 4 \
    -e reference/scenes/46_sky.exr -- reference/scenes/46_sky.dae

# Sample ranges: in_ranges NAME again|once JOBS PARTS RANGES ARGUMENT...: the image of one render, l.exr, and of ranges, x.exr, in which all
# channels agree to float32 rounding, so that counts, being whole, are the same. Made again as one cell in as many ranges: the same bits.
in_ranges() {
    local name=$1 again=$2 jobs=$3 parts=$4 ranges=$5 why=""
    shift 5
    rm -rf "$tmp/plan" "$tmp"/[lx].*
    local words=(-q -r 37 29 --seed 3)
    "$pathtracer" "${words[@]}" -f "$tmp/l.exr" -f "$tmp/l.png" "$@" >/dev/null 2>"$tmp/err" || why="$(cat "$tmp/err")"
    "$assay" plan --plan "$tmp/plan" --parts "$parts" --ranges "$ranges" pathtracer "${words[@]}" -f "$tmp/x.exr" -f "$tmp/x.png" "$@" >"$tmp/jobs" 2>"$tmp/err" || why="$(cat "$tmp/err")"
    [ "$(grep -c '^{"job".*"--samples"' "$tmp/jobs")" -eq "$jobs" ] || why="not $jobs jobs: $why"
    "$assay" run-job "$tmp/plan" $(seq 0 $((jobs - 1))) >/dev/null 2>"$tmp/err" && "$assay" gather "$tmp/plan" >/dev/null 2>"$tmp/err" || why="$(cat "$tmp/err")"
    idiff -q -fail 0 -failrelative 1e-6 -warn 1 "$tmp/l.exr" "$tmp/x.exr" >"$tmp/out" 2>&1 || why="$why $(head -c 300 "$tmp/out")"
    [ -z "$why" ] && [ "$again" = again ] && { "$assay" reproduce "$tmp/x.exr" >"$tmp/out" 2>&1 || why="$(cat "$tmp/out")"; }
    tell "$name" "$why"
}
in_ranges "sample ranges of a pilot, one for each sample" once 7 1 7 -s 24 --samples 3:10 -p 5 4 27 21 --adaptive-unbiased 0.3 --pilot 4 "$scene"
why=$(cmp "$tmp/l_rate.png" "$tmp/x_rate.png" 2>&1)
tell "and its rates" "$why"
in_ranges "sample ranges of cells" again 8 2 4 -s 22 --aov "$scene"
mv "$tmp/x.exr" "$tmp/y.exr" && rm -r "$tmp/plan/jobs" && why=""
"$assay" run-job "$tmp/plan" 7 2 5 0 >/dev/null 2>"$tmp/err" &
"$assay" run-job "$tmp/plan" 6 1 3 4 >"$tmp/out" 2>&1 || why="$(cat "$tmp/out")"
wait $! || why="$why $(cat "$tmp/err")"
"$san_assay" gather "$tmp/plan" >/dev/null 2>"$tmp/err" && cmp "$tmp/x.exr" "$tmp/y.exr" >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/err" "$tmp/out")"
grep -aq "0:5,5:11,11:16,16:22" "$tmp/x.exr" || why="$why not the ranges that they are"
tell "the same bits in another order and by two processes" "$why"
# Of the same ranges by assay merge, which has them as float32 (M2 and M3 are held against one render alone).
why="" merged=()
for at in 0:5 5:11 11:16 16:22; do "$pathtracer" -q -r 37 29 --seed 3 --aov --samples $at -f "$tmp/r$at.exr" "$scene" >/dev/null && merged+=("$tmp/r$at.exr"); done
"$assay" merge "$tmp/m.exr" "${merged[@]}" >/dev/null 2>"$tmp/err" || why=$(cat "$tmp/err")
channels=R,G,B,n,depth.hits,normal.X,normal.Y,normal.Z,albedo.R,albedo.G,albedo.B,id.object
oiiotool "$tmp/m.exr" --ch $channels "$tmp/x.exr" --ch $channels --fail 4e-6 --diff >"$tmp/out" 2>&1 || why="$why $(head -c 300 "$tmp/out")"
tell "sample ranges are what assay merge makes of them" "$why"
why=$(idiff -q -fail 0 -failrelative 1e-8 -warn 1 "$tmp/l.exr" "$tmp/x.exr" >/dev/null 2>&1 && echo "a unit in the last place is not seen")
tell "and not bit by bit what one render makes" "$why"

# Whose they are: job 1 of 2 cells and 3 ranges is samples 2:4 of the first.
plan=$tmp/ranges
words=(pathtracer -q -r 16 32 -f "$tmp/z.exr" "$scene")
"$assay" plan --plan "$plan" --parts 2 --ranges 3 "${words[@]}" -s 6 >"$tmp/jobs"
"$assay" run-job "$plan" 0 1 2 3 4 5 >/dev/null
key() { sed -n "s/^{\"job\":$1,\"key\":\"\([0-9a-f]*\)\".*/\1/p" "$tmp/jobs"; }
state=$plan/jobs/$(key 1)/cell.png.state
cp "$state" "$tmp/state"
replaced() { # NAME PATTERN ARGUMENT...: job 1 with a state by other words is not gathered
    local name=$1 pattern=$2
    shift 2
    "$pathtracer" -q -r 16 32 -p 0 0 16 16 --keep-state -f "$tmp/o.png" "$scene" "$@" >/dev/null && mv "$tmp/o.png.state" "$state"
    expect "$name" 3 "$pattern" "$assay" gather "$plan"
}
replaced "a range of another seed" "'seed 2' there, 'seed 1' here" -s 6 --samples 2:4 --seed 2
replaced "another range" "'first sample 0' there, 'first sample 2' here" -s 6 --samples 0:4
replaced "a longer range" "has not the samples 2:4" -s 6 --samples 2:5
[ -e "$tmp/z.exr" ] && why="something was written" || why=""
tell "nothing of these is gathered" "$why"
cp "$tmp/state" "$state" && printf 'x' | dd of="$state" bs=1 seek=5000 conv=notrunc 2>/dev/null
expect "a damaged range" 3 "cell.png.state: damaged" "$assay" gather "$plan"
cp "$tmp/state" "$state"
expect "the right one" 0 "z.exr" "$assay" gather "$plan"
sed '3d; s/"jobs":6/"jobs":5/' "$plan/plan.jsonl" >"$tmp/p" && cp "$tmp/p" "$plan/plan.jsonl"
expect "a plan that lacks a range" 3 "no job that follows the one before" "$assay" gather "$plan"
expect "more ranges than samples" 3 "7 of 6 samples" "$assay" plan --plan "$tmp/p1" --ranges 7 "${words[@]}" -s 6
expect "ranges of the assignment's rule" 3 "not with --adaptive" "$assay" plan --plan "$tmp/p1" --ranges 2 "${words[@]}" -s 6 -a 2 0.1
expect "ranges and a state" 3 "not with --keep-state" "$assay" plan --plan "$tmp/p1" --ranges 2 "${words[@]}" --keep-state
expect "ranges of what is no render" 3 "says how pathtracer is cut, not grade" "$assay" plan --plan "$tmp/p1" --ranges 2 grade -o "$tmp/g0" tests/end_to_end/quick.rubric

# A plan, its jobs, and what is not done. Of 4 x 40 rows the third job's file is looked into.
cp "$scene" "$tmp/s.dae"
plan=$tmp/plan4 why=""
"$san_assay" plan --plan "$plan" --parts 4 pathtracer -q -r 48 160 -s 2 -f "$tmp/y.exr" "$tmp/s.dae" >"$tmp/jobs"
key() { sed -n "s/^{\"job\":$1,\"key\":\"\([0-9a-f]*\)\".*/\1/p" "$tmp/jobs"; }
hash=$(sha256sum "$scene" | cut -c1-64)
grep -q "\"$tmp/s.dae\":\"$hash\"" "$tmp/jobs" || why="no hash of the scene in $(head -n 1 "$tmp/jobs")"
tell "inputs are known by hash" "$why"
expect "a job that is not made" 3 "job 0 of 4 is not made" "$san_assay" gather "$plan"
expect "a job is made" 0 "job 2: made" "$san_assay" run-job "$plan" 2
expect "and is not made twice" 0 "job 2: was there" "$san_assay" run-job "$plan" 2
state=$plan/jobs/$(key 2)/cell.png.state
cp "$state" "$tmp/state" && printf 'x' | dd of="$state" bs=1 seek=5000 conv=notrunc 2>/dev/null
expect "one that was damaged is made again" 0 "job 2: made" "$san_assay" run-job "$plan" 2
why=$(cmp "$state" "$tmp/state" 2>&1)
tell "with the same bits" "$why"
printf 'x' | dd of="$state" bs=1 seek=5000 conv=notrunc 2>/dev/null
"$san_assay" run-job "$plan" 0 1 3 >/dev/null
expect "one that was damaged is not gathered" 3 "cell.png.state: damaged" "$san_assay" gather "$plan"
rm -rf "$plan/jobs/$(key 1)"
mv "$tmp/s.dae" "$tmp/t.dae"
sed 's/0\.8/0.7/' "$tmp/t.dae" >"$tmp/s.dae"
expect "an input was changed" 3 "s.dae is not what was planned with" "$san_assay" run-job "$plan" 1
rm "$tmp/s.dae"
expect "an input is gone" 3 "s.dae: No such file" "$san_assay" run-job "$plan" 1
mv "$tmp/t.dae" "$tmp/s.dae"
expect "no such job" 3 "is not a whole number from 0 to 3" "$san_assay" run-job "$plan" 4
head -n 3 "$plan/plan.jsonl" >"$tmp/p" && mkdir "$tmp/half" && cp "$tmp/p" "$tmp/half/plan.jsonl"
expect "a plan cut short" 3 "not a whole plan" "$san_assay" run-job "$tmp/half" 0
expect "a render that looks at all of its image" 3 "cannot be cut into jobs" "$san_assay" plan --plan "$tmp/p1" pathtracer --error 1% -f "$tmp/y.exr" "$scene"
expect "what cannot be planned" 3 "begins with pathtracer, grade, validate or reference" "$san_assay" plan report x.json
expect "a word that a plan uses" 3 "means something else in a plan" "$san_assay" plan --plan "$tmp/p1" pathtracer -f x.exr -e "{out}" -s 1 "{job}"

# The class: submissions that are right, that crash, and that are not programs.
mkdir "$tmp/class"
cp "$pathtracer" "$tmp/class/right" && printf '#!/bin/sh\nexit 3\n' >"$tmp/class/dead" && chmod +x "$tmp/class/dead" && mkdir "$tmp/class/empty" && echo later >"$tmp/class/empty/note"
no_times() { sed -E 's/"(cpu_s|wall_s|seconds|seconds_a|seconds_b|a)": [0-9.e-]+//; /"(command|date|key)":/d' "$1"; }
"$assay" grade -o "$tmp/g1" tests/end_to_end/quick.rubric "$tmp"/class/* >/dev/null 2>"$tmp/err.g1"
one=$?
why=$("$assay" plan --plan "$tmp/gplan" grade -o "$tmp/g2" tests/end_to_end/quick.rubric "$tmp"/class/* 2>&1 >"$tmp/jobs") &&
    "$assay" run-job "$tmp/gplan" 2 0 1 >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/out")"
"$assay" gather "$tmp/gplan" >/dev/null 2>"$tmp/err"
two=$?
[ $one -eq $two ] || why="exit codes $one and $two: $(cat "$tmp/err.g1" "$tmp/err") $why"
for f in grades.json right/grade.json dead/grade.json empty/grade.json; do
    cmp -s <(no_times "$tmp/g1/$f") <(no_times "$tmp/g2/$f") || why="$why $f: $(diff <(no_times "$tmp/g1/$f") <(no_times "$tmp/g2/$f") | head -n 4)"
done
for f in grades.csv right/point.png; do cmp -s "$tmp/g1/$f" "$tmp/g2/$f" || why="$why $f differs"; done
[ -e "$tmp/g2/index.html" ] || why="$why no page"
# The hash of hash_tree.h, computed independently.
hash=$(printf 'f %s note\n' "$(sha256sum "$tmp/class/empty/note" | cut -c1-64)" | sha256sum | cut -c1-64)
grep -q "\"$tmp/class/empty\":\"$hash\"" "$tmp/jobs" || why="$why no hash of a directory"
if grep -q "no sandbox" "$tmp/err.g1"; then
    echo "skip jobs: a grading batch ($(tail -n 1 "$tmp/err.g1"))"
else
    tell "a grading batch" "$why"
fi

# The suite: two scenes that take no time, of one of them only the claim of consistency, in jobs by scenes and by claims.
wanted=(--only 12_point_plane/consistency --only 38_spot_edge/truth --only 38_spot_edge/cycles --only 38_spot_edge/cycles:truth)
"$assay" validate -q "${wanted[@]}" --out "$tmp/v1" >"$tmp/table1" 2>"$tmp/err"
one=$?
# The page, with its images, all but digits, in any order: times differ, by which a table is sorted, and numbers are those of results.json.
page() { tr -d '0-9.:TZ-' <"$1" | sed 's/</\n</g' | sort; }
validation() { # NAME scene|claim JOBS
    local name=$1 by=$2 jobs=$3 two why
    rm -rf "$tmp/vplan" "$tmp/v2"
    why=$("$assay" plan --plan "$tmp/vplan" --by "$by" validate -q "${wanted[@]}" --out "$tmp/v2" 2>&1 >"$tmp/jobs") &&
        "$assay" run-job "$tmp/vplan" $(seq $((jobs - 1)) -1 0) >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/out")"
    [ "$(grep -c '^{"job"' "$tmp/jobs")" -eq "$jobs" ] || why="$why not $jobs jobs"
    "$assay" gather "$tmp/vplan" >"$tmp/table2" 2>"$tmp/err"
    two=$?
    [ $one -eq $two ] || why="exit codes $one and $two: $(cat "$tmp/err") $why"
    cmp -s <(no_times "$tmp/v1/results.json") <(no_times "$tmp/v2/results.json") || why="$why $(diff <(no_times "$tmp/v1/results.json") <(no_times "$tmp/v2/results.json") | head -n 6)"
    cmp -s <(grep -v index.html "$tmp/table1") <(grep -v index.html "$tmp/table2") || why="$why another table"
    cmp -s <(sed -E 's/ time(stamp)?="[^"]*"//g' "$tmp/v1/junit.xml") <(sed -E 's/ time(stamp)?="[^"]*"//g' "$tmp/v2/junit.xml") || why="$why another junit.xml"
    cmp -s <(page "$tmp/v1/index.html") <(page "$tmp/v2/index.html") || why="$why another page"
    [ -s "$tmp/v2/index.html" ] && [ -e "$tmp/v2/data/38_spot_edge/pathtracer.exr" ] || why="$why files are missing"
    tell "$name" "$why"
}
validation "a validation" scene 2
validation "a validation by claims" claim 4
# Noise, whose efficiency is a time: the same numbers but for those.
noise() { # RESULTS
    python3 -c 'import json, sys
def without(x):
    if isinstance(x, dict): return {k: without(v) for k, v in x.items() if k not in ("seconds", "cpu_s", "efficiency", "efficiency_ci")}
    return [without(v) for v in x] if isinstance(x, list) else x
print(json.dumps(without(json.load(open(sys.argv[1]))["noise"]), indent=1))' "$1"
}
"$assay" validate -q --only 38_spot_edge/noise --out "$tmp/n1" >"$tmp/out" 2>&1
why=$("$assay" plan --plan "$tmp/nplan" --by claim validate -q --only 38_spot_edge/noise --out "$tmp/n2" 2>&1 >"$tmp/jobs") &&
    "$assay" run-job "$tmp/nplan" 0 >"$tmp/out" 2>&1 && "$assay" gather "$tmp/nplan" >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/out")"
tell "the noise of a scene" "$why$(diff <(noise "$tmp/n1/results.json") <(noise "$tmp/n2/results.json") | head -n 6)$(noise "$tmp/n1/results.json" |
    grep '"verdict": "EQUIVALENT"' >/dev/null || echo " no verdict")"
rerun=$(sed -n 's/.*"rerun": "assay \(validate --only 38_spot_edge[^"]*\)".*/\1/p' "$tmp/v1/results.json" | head -n 1)
why=$("$assay" $rerun -q --out "$tmp/v3" 2>&1 >"$tmp/out") && [ "$(grep -c '"expected"' "$tmp/v3/results.json")" -eq 1 ] &&
    cmp -s <(sed -n 2p "$tmp/table1" | tr -s ' ') <(sed -n 2p "$tmp/out" | tr -s ' ') || why="$rerun: $why"
tell "a claim says how to judge it alone" "$why"
expect "a claim that there is not" 3 "no claim '38_spot_edge/blender'; there are truth, cycles, cycles:truth" "$san_assay" validate --only 38_spot_edge/blender --out "$tmp/v3"
expect "a validation whose next look depends on the last" 3 "cannot be cut into jobs" "$san_assay" plan --plan "$tmp/p1" validate --budget 5s --out "$tmp/v3"
[ $failures -eq 0 ]
