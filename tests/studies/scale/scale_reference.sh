#!/bin/bash
# tests/studies/scale/scale_reference.sh BUILD: references in jobs (`assay plan reference`, `run-job`, `gather`) have the bits of `assay reference`,
# and replicates that are missing, damaged, exchanged or made twice are refused. In the engines' places our own program
# renders an image for each seed; the engines themselves: tests/studies/scale/scale_live.sh. Prints "ok NAME" or "not ok NAME: why".
set -u
build=$(realpath "${1:?usage: tests/studies/scale/scale_reference.sh BUILD}")
pathtracer=$build/pathtracer assay=$build/assay san_assay=$build/san/assay
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0

what="references in jobs"
. tests/end_to_end/expect.sh

# A suite of one scene, which both engines have noise in.
mkdir "$tmp/suite" "$tmp/bin"
suite=$tmp/suite/41_cornell
cp reference/scenes/41_cornell.dae "$tmp/suite"
sed 's/"width": [0-9]*, "height": [0-9]*/"width": 16, "height": 16/; s/"tile": 16/"tile": 8/; /"consistency"/d
    s/"replicates": [0-9]*, "spp": [0-9]*/"replicates": 4, "spp": 4/; s/"replicates": [0-9]*, "subgrid": [0-9]*/"replicates": 4, "subgrid": 1/' \
    reference/scenes/41_cornell.json >"$suite.json"
render() { echo "'$pathtracer' -q -t 1 -r 16 16 -m 2 -s $1 --seed $2 -f $3 '$suite.dae'"; }
cat >"$tmp/bin/blender" <<END
#!/bin/bash
k=0
for seed in \$(grep -o '[0-9]*' seeds.json); do
    $(render 4 '$seed' '"replicate_$(printf %04d $k).exr"') || exit 1
    k=\$((k + 1))
done
echo 'ASSAY OK {"version": "Blender 0", "settings": {"samples": 4}}'
END
# A window is twice as wide as the image; the rest are replicates, of which no two have the same file.
"$pathtracer" -q -r 32 32 -s 4 -m 1 -f "$tmp/window.exr" "$suite.dae" >/dev/null
cat >"$tmp/bin/povray" <<END
#!/bin/bash
case "\$*" in
--version) echo POV-Ray 0 ;;
*+W32*) cp "$tmp/window.exr" scene.exr ;;
*) $(render 4 '$(cksum scene.pov | cut -d " " -f 1)' scene.exr) ;;
esac
echo 'retained for re-use: 0'
END
chmod +x "$tmp/bin/blender" "$tmp/bin/povray"
export PATH="$tmp/bin:$PATH"
words=(reference --suite "$tmp/suite" --work "$tmp/work")

# Each replicate a job, and 36 images, 32 of them windows, in 3; the last job first.
"$assay" "${words[@]}" -t 1 --out "$tmp/l" >"$tmp/out" 2>&1 || cat "$tmp/out"
in_jobs() { # ENGINE PARTS
    local plan=$tmp/$1 why num
    why=$("$assay" plan --plan "$plan" --parts "$2" "${words[@]}" --engine "$1" --out "$tmp/x" 2>&1 >"$tmp/jobs")
    num=$(grep -c '^{"job"' "$tmp/jobs")
    [ "$num" -eq "$2" ] || why="$why $num jobs for $2"
    "$assay" run-job "$plan" $(seq $((num - 1)) -1 0) >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/out")"
    "$assay" gather "$plan" >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/out")"
    grep -q "^$tmp/x/41_cornell/$1.exr: 16 x 16 pixels, 4 x replicate" "$tmp/out" || why="$why said: $(cat "$tmp/out")"
    cmp "$tmp/l/41_cornell/$1.exr" "$tmp/x/41_cornell/$1.exr" >"$tmp/out" 2>&1 || why="$why $(cat "$tmp/out")"
    tell "$1" "$why"
}
in_jobs cycles 4
in_jobs povray 3
no_times() { sed -E '/"(cpu_s|wall_s|date)":/d' "$1"; }
why=$(diff <(no_times "$tmp/l/41_cornell/manifest.json") <(no_times "$tmp/x/41_cornell/manifest.json") | head -n 6)
grep -q '"passed": true' "$tmp/x/41_cornell/manifest.json" || why="$why no test of independence"
tell "the manifest but for times" "$why"

# A reference that is up to date gets no job, and gather prints what `assay reference` would.
"$assay" plan --plan "$tmp/none" "${words[@]}" --out "$tmp/y" --golden "$tmp/x" >"$tmp/jobs" 2>&1
tell "what is up to date has no job" "$(grep -q '"jobs":0' "$tmp/jobs" && [ "$(wc -l <"$tmp/jobs")" -eq 1 ] || cat "$tmp/jobs")"
"$assay" "${words[@]}" --out "$tmp/y" --golden "$tmp/x" >"$tmp/said" 2>&1
"$assay" gather "$tmp/none" >"$tmp/out" 2>&1
tell "and is told of as without jobs" "$(cmp "$tmp/said" "$tmp/out" 2>&1; grep -c 'up to date' "$tmp/out" | sed '/^2$/d')"
rm -r "$tmp/x/41_cornell"
expect "a reference that was up to date" 3 "was up to date when this was planned" "$san_assay" gather "$tmp/none"

# Jobs that are missing or whose files do not match. sign: forges the receipt of a job (hash_tree.h).
plan=$tmp/cycles
artefact() { echo "$plan/jobs/$(sed -n "s/^{\"job\":$1,\"key\":\"\([0-9a-f]*\)\".*/\1/p" "$plan/plan.jsonl")"; }
sign() {
    local at=$1 hash name
    hash=$(for name in $(cd "$at" && ls | LC_ALL=C sort | grep -v '^job.json$'); do printf 'f %s %s\n' "$(sha256sum "$at/$name" | cut -c1-64)" "$name"; done | sha256sum | cut -c1-64)
    sed -i "s/\"sha256\": \"[0-9a-f]*\"/\"sha256\": \"$hash\"/" "$at/job.json"
}
three=$(artefact 3)
cp -r "$three" "$tmp/three"
again() { rm -rf "$three" && cp -r "$tmp/three" "$three"; }
rm -rf "$three"
expect "a replicate that is missing" 3 "job 3 of 4 is not made" "$assay" gather "$plan"
again
printf 'x' | dd of="$three/picture_0003.exr" bs=1 seek=1500 conv=notrunc 2>/dev/null
expect "a replicate that was damaged" 3 "job 3: .* is not what the job wrote" "$assay" gather "$plan"
sign "$three"
expect "and signed" 3 "picture_0003.exr" "$san_assay" gather "$plan"
rm -rf "$three" && cp -r "$(artefact 2)" "$three"
expect "another job's artefact" 3 "has images 2:3, those from 3 on are wanted" "$assay" gather "$plan"
again && cp "$(artefact 2)/picture_0002.exr" "$three/picture_0003.exr" && sign "$three"
expect "another job's replicate" 3 "Cycles: replicate 3 is the same image as an earlier one" "$san_assay" gather "$plan"
# The seed of replicate 2 again, of whose four samples it shares all, with a fifth.
seed=$(sed -n '/"seeds"/,/]/p' "$tmp/l/41_cornell/manifest.json" | grep -o '[0-9][0-9]*' | sed -n 3p)
again && eval "$(render 5 "$seed" "$tmp/twice.exr")" >/dev/null && cp "$tmp/twice.exr" "$three/picture_0003.exr" && sign "$three"
expect "a seed that was used twice" 3 "Cycles: replicates 2 and 3 are not independent: correlation 0[.]" "$san_assay" gather "$plan"
again && sed -i 's/Blender 0/Blender 1/' "$three/part.json" && sign "$three"
expect "a replicate of another version" 3 "made by Blender 1 with other settings than the first part, of Blender 0" "$san_assay" gather "$plan"
again
tell "nothing was written by any of these" "$([ ! -e "$tmp/x/41_cornell/cycles.exr" ] || echo there is a cycles.exr)"
cp "$plan/plan.jsonl" "$tmp/kept" && sed -i '1s/"job":0,"jobs":4/"job":0,"jobs":3/' "$plan/plan.jsonl"
expect "a plan that does not know of all its jobs" 3 "images 3:4 are missing" "$san_assay" gather "$plan"
cp "$tmp/kept" "$plan/plan.jsonl"
cp "$suite.json" "$tmp/kept" && sed -i 's/"replicates": 4, "spp": 4/"replicates": 4, "spp": 8/' "$suite.json"
expect "a suite that asks for something else by now" 3 "of another reference, or of other settings" "$san_assay" gather "$plan"
cp "$tmp/kept" "$suite.json"
rm -rf "$three"
echo >>"$tmp/bin/blender"
expect "another Blender than was planned with" 3 "bin/blender is not what was planned with" "$san_assay" run-job "$plan" 3
plan=$tmp/povray
two=$(artefact 2)
cp "$two/picture_0034.exr" "$two/picture_0035.exr" && sign "$two"
expect "a replicate of POV-Ray twice" 3 "POV-Ray: replicates 2 and 3 are the same" "$san_assay" gather "$plan"
expect "images that there are not" 3 "no images 35:37 among its 36" "$san_assay" "${words[@]}" --engine povray --images 35:37 --out "$tmp/p"
expect "no range" 3 "'7' is not a range A:B" "$assay" "${words[@]}" --images 7
expect "images of two references" 3 "is of one reference" "$assay" "${words[@]}" --images 0:1 --out "$tmp/p"
expect "images planned" 3 "these are a job already" "$assay" plan --plan "$tmp/p1" "${words[@]}" --engine cycles --images 0:1
[ $failures -eq 0 ]
