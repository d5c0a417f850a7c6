#!/bin/bash
# tests/end_to_end/no_memory.sh [--all] BUILD [CASE...]: whole commands while memory runs out, each on tiny inputs:
# every allocation fails in a run of its own, as described in tests/end_to_end/no_memory.c, whose planted faults have to
# be found first. Without --all, for each command at most 12 allocations of libraries and 36 of our own code, with call
# stacks that no earlier command had. CASE: a pattern of names. Prints "ok NAME" or "not ok NAME: why".
set -u
[ "${1:-}" = --all ] && export NO_MEMORY_ALL=1000000 && shift
build=$(realpath "${1:?usage: tests/end_to_end/no_memory.sh [--all] BUILD [CASE...]}")
shift
wanted=("${@:-*}")
pathtracer=$build/san/no_memory/pathtracer assay=$build/san/no_memory/assay
# Renders the inputs, and is the renderer that the commands themselves run; its clocks stand still, too.
plain=$(realpath "${PLAIN_BUILD:-$build}")/no_memory/pathtracer
root=$PWD scenes=$PWD/reference/scenes seeds=$PWD/tests/fuzz/seeds
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
chmod 711 "$tmp"
failures=0
mkdir "$tmp/bin" "$tmp/in"
export PATH=$tmp/bin:$PATH NO_MEMORY_DONE=$tmp/done

# no_memory NAME COMMAND...: in a copy of $start, if that is not empty; at most $most allocations.
start="" most=12
no_memory() {
    local name=$1 pattern
    shift
    for pattern in "${wanted[@]}"; do
        # shellcheck disable=SC2053
        [[ $name == $pattern ]] || continue
        mkdir "$tmp/case"
        [ -n "$start" ] && cp -R "$start" "$tmp/case/start"
        NO_MEMORY=$tmp/case NO_MEMORY_NAME=$name NO_MEMORY_MOST=${NO_MEMORY_ALL:-$most} TMPDIR=$tmp/case/tmp "$@" 2>"$tmp/err" ||
            failures=$((failures + 1))
        rm -rf "$tmp/case"
    done
    start="" most=12
}
prepare() { "$@" >"$tmp/out" 2>&1 || { echo "not ok no memory: cannot prepare: $*: $(head -c 300 "$tmp/out")" && failures=$((failures + 1)); }; }
render() { prepare "$plain" -q -t 1 -r 16 16 "$@"; }

for fault in none unchecked undefined leak silent misleading 'two lines' points wrong half; do
    [[ $fault == @(leak|undefined) ]] && ! nm -D "$assay" | grep -q __asan && continue
    mkdir "$tmp/case"
    seen=$(NO_MEMORY=$tmp/case NO_MEMORY_DONE=/dev/null NO_MEMORY_FAULT=$fault NO_MEMORY_NAME=fault "$assay" 2>/dev/null | grep -c '^not ok')
    rm -rf "$tmp/case"
    case "$fault:$seen" in
    none:0 | [!n]*:[1-9]) echo "ok no memory: fault '$fault'" ;;
    *) echo "not ok no memory: fault '$fault': $seen findings" && failures=$((failures + 1)) ;;
    esac
done

cd "$tmp/in" || exit 1
cornell=$scenes/41_cornell.dae point=$scenes/12_point_plane.dae square=$scenes/13_square_patch.dae
for i in 1 2; do
    render -s 8 --seed $i -f $i.exr "$point"
    render -r 32 32 -s 8 --seed $i -f $i.png "$point"
    mkdir r$i
    for k in 1 2 3; do render -s 2 --seed $i$k -f r$i/$k.exr "$point"; done
    render --samples $((i - 1)):$i -s 2 -f s$i.exr "$cornell"
done

draw=("$pathtracer" -q -t 1 -r 8 8)
no_memory "render: moments, layers and state" "${draw[@]}" -s 2 --aov --keep-state -f x.exr "$cornell"
no_memory "render: PNG and heat map" "${draw[@]}" -s 2 -c "$seeds/camera.info" --heatmap h.png -f x.png "$cornell"
no_memory "render: a sky (.hdr)" "${draw[@]}" -s 2 -e "$seeds/picture.hdr" -f x.exr "$point"
no_memory "render: a sky (.exr)" "${draw[@]}" -s 2 -e "$scenes/46_sky.exr" -f x.exr "$scenes/46_sky.dae"
no_memory "render: textures" "${draw[@]}" -s 2 -f x.exr "$scenes/29_textures.dae"
no_memory "render: the assignment's rule" "${draw[@]}" -s 24 -a 4 0.3 -f x.exr -f x.png "$point"
no_memory "render: a pilot" "${draw[@]}" -s 24 --adaptive-unbiased 0.3 --pilot 4 -f x.exr -f x.png "$point"
no_memory "render: guiding" "${draw[@]}" -s 2 --guiding on -f x.exr "$scenes/22_glass_sphere.dae"
for accel in bruteforce centroid sah; do
    no_memory "render: $accel" "${draw[@]}" --accel $accel --sampler sobol -s 2 -f x.exr "$scenes/22_glass_sphere.dae"
done
mkdir state && render -r 8 8 -s 2 --keep-state -f state/x.exr "$point"
start=$tmp/in/state
no_memory "render: resumed" "${draw[@]}" -s 4 --resume x.exr --keep-state -f x.exr "$point"

no_memory "merge" "$assay" merge x.exr "$tmp/in/s1.exr" "$tmp/in/s2.exr"
for format in json pov xml pbrt; do no_memory "export: $format" "$assay" export -o x.$format "$scenes/27_smooth_normals.dae"; done
for format in json pov; do no_memory "export: textures, $format" "$assay" export -o x.$format "$scenes/29_textures.dae"; done
for format in json pov xml; do no_memory "export: a sky, $format" "$assay" export -o x.$format "$scenes/46_sky.dae"; done

# OpenImageIO, which reads all but moments files, takes half a second to load: fewer allocations there.
versus=("$assay" compare -t 1 --alpha 0.01) # one thread: allocations come in the same order each time
no_memory "compare: moments" "${versus[@]}" --margin 0.3 --margin-tile 0.9 --json x.json "$tmp/in/1.exr" "$tmp/in/2.exr"
no_memory "compare: variance, two stages" "${versus[@]}" --margin-variance 0.9 --again "$tmp/in/r1/1.exr" "$tmp/in/r2/1.exr" -- "$tmp/in/1.exr" "$tmp/in/2.exr"
no_memory "compare: the same program" "${versus[@]}" --same-program "$tmp/in/1.exr" "$tmp/in/2.exr"
most=5
no_memory "compare: directories" "${versus[@]}" "$tmp/in/r1" "$tmp/in/r2"
most=5
no_memory "compare: whole images exchanged" "${versus[@]}" --exchangeable "$tmp/in/r1" "$tmp/in/r2"
most=5
no_memory "compare: PNG" "${versus[@]}" --curve srgb "$tmp/in/1.png" "$tmp/in/2.png"

# A suite of one scene; in place of the engines our own program renders an image for each seed.
mkdir suite && cp "$square" suite
cat >suite/13_square_patch.json <<END_OF_SCENE
{"title": "Plane", "detects": "much", "blind_to": "the rest", "width": 16, "height": 16, "depth": 1, "spp": 8, "tile": 8, "expect": "EQUIVALENT",
 "consistency": {"renders": 8, "spp": 4, "margin": 0.9},
 "variants": [{"name": "light", "options": ["--direct", "light"], "spp": 8, "margin_global": 0.9, "margin_tile": 0.9}],
 "references": {
$(sed -n '/"truth": {/,/^    },/p' "$scenes/13_square_patch.json")
    "cycles": {"class": "exact", "margin_global": 0.9, "margin_tile": 0.9, "replicates": 3, "spp": 4}}}
END_OF_SCENE
cat >"$tmp/bin/other" <<END_OF_ENGINE
#!/bin/bash
exec "$plain" -q -t 1 -r 16 16 -m 1 -s "\$2" --seed "\$3" -f "\$4" "$square"
END_OF_ENGINE
cat >"$tmp/bin/blender" <<'END_OF_ENGINE'
#!/bin/bash
k=0
for seed in $(grep -o '[0-9]*' seeds.json); do
    other - 4 "$seed" "replicate_$(printf %04d $k).exr" >/dev/null || exit 1
    k=$((k + 1))
done
echo 'ASSAY OK {"version": "none", "settings": {}}'
END_OF_ENGINE
chmod +x "$tmp/bin"/*
cat >other.json <<END_OF_ENGINE
{"name": "other", "format": "mitsuba", "output": "mean", "image": "exr", "expresses": ["diffuse", "area"], "spp": 4, "replicates": 3,
 "command": ["$tmp/bin/other", "{scene}", "{spp}", "{seed}", "{out}"]}
END_OF_ENGINE
places=(--suite "$tmp/in/suite" --golden "$tmp/in/store")
golden=("$assay" golden render --suite "$tmp/in/suite" --share "$root/reference" -t 1 --engine cycles --seed 1)
approve=("$assay" golden approve --suite "$tmp/in/suite" --from "$tmp/in/candidate" --new)
no_memory "golden render" "${golden[@]}" --work "$tmp/case/tmp/work" -o new
prepare "${golden[@]}" --work "$tmp/work" -o candidate
mkdir store
start=$tmp/in/store
no_memory "golden approve: new" "${approve[@]}" --golden . 13_square_patch/cycles
prepare "${approve[@]}" --golden store 13_square_patch/cycles
no_memory "golden status" "$assay" golden status "${places[@]}"
validate=("$assay" validate -q -t 1 "${places[@]}" --share "$root/reference" --pathtracer "$plain")
no_memory "validate" "${validate[@]}" --out report
most=5
no_memory "validate: an engine" "${validate[@]}" --out report --engine "$tmp/in/other.json" --only 13_square_patch/other:truth
"${validate[@]}" --out report >/dev/null 2>&1
for kind in "" --markdown --matrix --github; do
    start=$tmp/in/report
    no_memory "report $kind" "$assay" report $kind results.json
done
mkdir -p history/1 history/2 && cp "$seeds/results.json" history/1 && cp report/results.json history/2
start=$tmp/in/history
no_memory "report --history" "$assay" report --history .

no_memory "converge" "$assay" converge -q -t 1 "${places[@]}" --pathtracer "$plain" --engine pathtracer -k 4 --ladder 1,4,16 --depth-spp 2 -o out 13_square_patch
most=5
no_memory "converge: an engine" "$assay" converge -q -t 1 "${places[@]}" --engine "$tmp/in/other.json" -k 4 --ladder 1,4,16 -o out 13_square_patch
render -r 32 32 -m 1 -f view.exr "$point"
no_memory "diagnose" "$assay" diagnose --suite "$scenes" --catalogue "$root/golden/diagnose" --json x.json --scene 12_point_plane "$tmp/in/view.exr"
mkdir -p subs/1 subs/2 && cp 1.png subs/1/point.png && cp 2.png subs/2/point.png
sed 's/size 64 64/size 32 32/; s/^total/allow images\n&/' "$root/tests/end_to_end/quick.rubric" >quick.rubric
grade=("$assay" grade --unsafe-no-sandbox --suite "$scenes" --golden "$tmp/in/store" --pathtracer "$plain")
most=8
no_memory "grade" "${grade[@]}" -o grades "$tmp/in/quick.rubric" "$tmp/in/subs/1" "$tmp/in/subs/2"
no_memory "grade: rubric" "${grade[@]}" --check-rubric "$root/tools/rubrics/cs184-3-1.rubric"

jobs=("$assay" plan --plan plan --parts 2 pathtracer -q -t 1 -r 8 32 -s 2 -f x.exr "$point")
no_memory "plan" "${jobs[@]}"
prepare "${jobs[@]}"
mkdir planned && mv plan planned
start=$tmp/in/planned
no_memory "run-job" "$assay" run-job plan 0
cd planned && prepare "$assay" run-job plan 0 1
cd ..
start=$tmp/in/planned
no_memory "gather" "$assay" gather plan

again=("$assay" reproduce -t 1)
no_memory "reproduce: a render" "${again[@]}" --pathtracer "$plain" "$tmp/in/1.exr"
prepare "$assay" compare -q --alpha 0.01 --margin 0.3 --margin-tile 0.9 --json c.json "$tmp/in/1.exr" "$tmp/in/2.exr"
no_memory "reproduce: results" "${again[@]}" "$tmp/in/c.json"
[ $failures -eq 0 ]
