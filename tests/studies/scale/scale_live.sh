#!/bin/bash
# tests/studies/scale/scale_live.sh BUILD: references and a validation with --live in jobs, with Blender and POV-Ray themselves, have the bits
# of the same commands without. What must be refused: tests/studies/scale/scale_reference.sh. Prints "ok NAME", "not ok NAME: why", or
# "skip NAME: why" where an engine is not there.
set -u
build=$(realpath "${1:?usage: tests/studies/scale/scale_live.sh BUILD}")
assay=$build/assay
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0

for program in blender povray; do
    command -v $program >/dev/null || { echo "skip live jobs: no $program in PATH: NOT TESTED" && exit 0; }
done
what="live jobs"
. tests/end_to_end/expect.sh
run_all() { "$assay" run-job "$1" $(seq $(($(grep -c '^{"job"' "$1/plan.jsonl") - 1)) -1 0); } # the last first
no_times() { sed -E 's/"(cpu_s|wall_s|seconds|seconds_a|seconds_b|a|b)": [0-9.e-]+//; /"(command|date)":/d' "$1"; }

# A room of noise for both engines: of Cycles each replicate a job, of POV-Ray 36 images in 6.
mkdir "$tmp/suite"
cp reference/scenes/41_cornell.dae "$tmp/suite"
sed 's/"width": [0-9]*, "height": [0-9]*/"width": 16, "height": 16/; s/"tile": 16/"tile": 8/; /"consistency"/d
    s/"replicates": [0-9]*, "spp": [0-9]*/"replicates": 4, "spp": 16/; s/"replicates": [0-9]*, "subgrid": [0-9]*/"replicates": 4, "subgrid": 1/' \
    reference/scenes/41_cornell.json >"$tmp/suite/41_cornell.json"
words=(reference --suite "$tmp/suite" --work "$tmp/work" --seed 3)
"$assay" "${words[@]}" -t 1 --out "$tmp/l" >"$tmp/out" 2>&1 || cat "$tmp/out"
for wish in cycles:4 povray:6; do
    engine=${wish%:*} jobs=${wish#*:}
    why=$("$assay" plan --plan "$tmp/$engine" --parts "$jobs" "${words[@]}" --engine "$engine" --out "$tmp/x" 2>&1 >"$tmp/jobs")
    [ "$(grep -c '^{"job"' "$tmp/jobs")" -eq "$jobs" ] || why="$why not $jobs jobs"
    run_all "$tmp/$engine" >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/out")"
    "$assay" gather "$tmp/$engine" >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/out")"
    cmp "$tmp/l/41_cornell/$engine.exr" "$tmp/x/41_cornell/$engine.exr" >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/out")"
    tell "replicates of $engine" "$why"
done
for f in l x; do no_times "$tmp/$f/41_cornell/manifest.json" | sed '/"command"/d' >"$tmp/$f.json"; done
tell "the manifest but for times" "$(diff "$tmp/l.json" "$tmp/x.json" | head -n 6; grep -c '"passed": true' "$tmp/x.json" | sed '/^2$/d')"

# The comparison can fail: with another seed the replicates are others.
"$assay" "${words[@]}" --seed 4 --engine cycles -t 1 --out "$tmp/y" >"$tmp/out" 2>&1 || cat "$tmp/out"
tell "another seed makes another reference" "$([ -e "$tmp/y/41_cornell/cycles.exr" ] && ! cmp -s "$tmp/l/41_cornell/cycles.exr" "$tmp/y/41_cornell/cycles.exr" || echo the same or none)"

words=(validate -q --live --only 12_point_plane --only 32_sun_plane --reference-seed 5)
"$assay" "${words[@]}" -t 1 --out "$tmp/v1" >"$tmp/table1" 2>"$tmp/err"
one=$?
why=$("$assay" plan --plan "$tmp/vplan" "${words[@]}" --out "$tmp/v2" 2>&1 >"$tmp/jobs")
grep -q '"[^"]*/blender":"[0-9a-f]\{64\}"' "$tmp/jobs" && grep -q '"[^"]*/povray":"[0-9a-f]\{64\}"' "$tmp/jobs" || why="$why engines are no inputs"
run_all "$tmp/vplan" >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/out")"
"$assay" gather "$tmp/vplan" >"$tmp/table2" 2>"$tmp/err"
two=$?
[ $one -eq 0 ] && [ $two -eq 0 ] || why="$why exit codes $one and $two: $(cat "$tmp/err")"
cmp -s <(no_times "$tmp/v1/results.json") <(no_times "$tmp/v2/results.json") || why="$why $(diff <(no_times "$tmp/v1/results.json") <(no_times "$tmp/v2/results.json") | head -n 6)"
cmp -s <(grep -v index.html "$tmp/table1") <(grep -v index.html "$tmp/table2") || why="$why another table"
for scene in 12_point_plane 32_sun_plane; do
    for engine in cycles povray; do cmp "$tmp/v1/data/$scene/$engine.exr" "$tmp/v2/data/$scene/$engine.exr" >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/out")"; done
done
grep -q '"loader"' "$tmp/v2/results.json" || why="$why nothing of Blender's importer"
tell "a validation with --live" "$why"
[ $failures -eq 0 ]
