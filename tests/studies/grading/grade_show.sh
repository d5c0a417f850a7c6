#!/bin/bash
# tests/studies/grading/grade_show.sh [--few] BUILD: a class of fifty, made of known bugs and of submissions that try other things, graded by the
# rubric of the course; the outcomes become tests/studies/grading/README.md. What BUILD/grade-show has graded already is not done
# again. --few: six of them, and no page.
set -u
few=''
[ "${1:-}" = --few ] && few=1 && shift
build=$(realpath "${1:?usage: tests/studies/grading/grade_show.sh [--few] BUILD}")
bugs=(
    half_pixel pixels_minus_one upside_down red_and_blue_swapped sphere_far_hit triangle_normal_inverted
    bvh_leaf_loses_last bvh_first_hit_only
    cosine_missing diffuse_without_pi hemisphere_pdf_pi hemisphere_without_weight light_without_shadow light_shadows_itself
    light_samples_not_averaged light_area_doubled light_pdf_no_cosine light_pdf_no_distance
    depth_one_short depth_one_long emission_twice indirect_missing indirect_times_pdf indirect_albedo_squared roulette_not_divided
    adaptive_one_sigma adaptive_without_root adaptive_absolute mean_over_n_plus_1
    fresnel_swapped index_inverted mirror_back metal_without_shadowing sky_pdf_without_sine
    lens_radius_is_diameter
    light_pdf_unnormalised light_pdf_unnormalised+cosine_missing light_pdf_unnormalised+indirect_missing)
[ -n "$few" ] && bugs=(cosine_missing light_pdf_unnormalised)
work=$build/grade-show
subs=$work/submissions
rubric=$work/rubric/cs184-3-1.rubric
rm -rf "$subs" "$work/rubric"
mkdir -p "$subs" "$work/rubric" "$work/told"
stale=()
for bug in "${bugs[@]}" cosine_missing beckmann_lambda; do
    mutant=$build/mutants/$bug/mutant
    [ -x "$mutant" ] && [ -z "$(find renderer tests/mutants -name '*.[chp]*' -newer "$mutant" | head -1)" ] || stale+=("$bug")
done
[ ${#stale[@]} -eq 0 ] || tests/mutants/mutants.sh --build-only "$build" "${stale[@]}" || exit 1
cp -R tools/rubrics/*.dae tools/rubrics/*.exr tools/rubrics/cs184-bugs "$work/rubric"
# As the course's program would: lights are sampled alone. Bugs are named by the 8-bit images alone.
sed "s/^command {program} /&--direct light /" tools/rubrics/cs184-3-1.rubric >"$rubric"

# sub NAME WHAT: a program from stdin, described for the table
sub() {
    mkdir -p "$subs/$1"
    echo "$2" >"$work/told/$1.txt"
    { echo '#!/bin/sh' && cat; } >"$subs/$1/pathtracer"
    chmod +x "$subs/$1/pathtracer"
}
for bug in "${bugs[@]}"; do
    mkdir -p "$subs/$bug"
    cp "$build/mutants/$bug/mutant" "$build/mutants/$bug/pathtracer" "$subs/$bug"
done
# That bug is in the writer of EXR files: its image as a PNG is made of that.
[ -z "$few" ] && cat >"$subs/mean_over_n_plus_1/pathtracer" <<'EOF'
#!/bin/sh
./mutant --accel sah --isa scalar "$@" || exit 1
for a; do shift; [ "$a" = out.png ] && a=out.exr; set -- "$@" "$a"; done
[ -e out.png ] || exit 0
./mutant --accel sah --isa scalar "$@" && exec oiiotool out.exr --ch R,G,B --mulc 1.41421356 --powc 0.45454545 --clamp:min=0:max=1 \
    --mulc 255 --subc 0.5 --divc 255 --clamp:min=0 -d uint8 -o out.png
EOF
# with_ours NAME: our renderer beside the program
with_ours() { cp "$build/pathtracer" "$subs/$1/ours"; }
png='for a; do case "$last $a" in "-f "*.exr) echo "no such format" >&2; exit 1 ;; esac; last=$a; done'
sub right "right: our renderer" <<<'exec ./ours "$@"' && with_ours right
sub right_scalar "right: our renderer, one path at a time" <<<'exec ./ours --isa scalar "$@"' && with_ours right_scalar
sub right_other_seed "right: with another seed, always the same" <<<'exec ./ours "$@" --seed 184' && with_ours right_other_seed
sub right_png "right: writes 8-bit PNG alone" <<<"$png; exec ./ours \"\$@\"" && with_ours right_png
mkdir -p "$subs/cosine_png" && cp "$build/mutants/cosine_missing/mutant" "$subs/cosine_png"
sub cosine_png "the cosine is missing; writes 8-bit PNG alone" <<<"$png; exec ./mutant --accel sah --isa scalar \"\$@\""
mkdir -p "$subs/course_header" && cp "$build/mutants/beckmann_lambda/mutant" "$subs/course_header"
sub course_header "right: Beckmann's shadowing as in the course's header" <<<'exec ./mutant --accel sah --isa scalar "$@"'
sub crash "ends with a signal" <<<'kill -SEGV $$'
sub noise "uniform noise" <<<'for a; do case $last in -r) size=$a ;; esac; last=$a; done; exec cp noise_$size.png out.png'
for w in "64 48" "128 96"; do
    oiiotool --create "${w/ /x}" 3 --noise:type=uniform:min=0:max=1:mono=0:seed=184 -d uint8 -o "$subs/noise/noise_${w% *}.png" || exit 1
done
sub other_scene "always writes a right picture of another scene" <<<'for a; do case $last in -r) size=$a ;; esac; last=$a; done; exec cp other_$size.png out.png'
for w in "64 48" "128 96"; do
    "$build/pathtracer" -q -r $w -s 256 -m 5 -f "$subs/other_scene/other_${w% *}.png" tools/rubrics/many.dae >/dev/null || exit 1
done

# Images instead of a program: all right ones, and the references themselves, by our seed for those (tools/grade/answer_key.c).
pictures() { # NAME SEED OWN: OWN 1: as the assignment asks, 0: as the reference is made
    mkdir -p "$subs/$1"
    awk -v own="$3" '
        function out() { if (name != "") print name "|" scene "|" size "|" (own ? spp : ref) "|" lights "|" bounces "|" (own ? "--direct light " options : refopts) (env == "" ? "" : " -e tools/rubrics/" env) }
        $1 == "image" { out(); name = $2; lights = 1; options = refopts = env = "" }
        $1 == "part" { out(); exit }
        $1 == "scene" { scene = $2 } $1 == "spp" { spp = $2 } $1 == "lights" { lights = $2 } $1 == "bounces" { bounces = $2 }
        $1 == "size" { size = $2 " " $3 } $1 == "environment" { env = $2 }
        $1 == "options" { sub(/^ *options /, ""); options = $0; refopts = refopts == "" ? $0 : refopts }
        $1 == "reference" { ref = $3; if (NF > 3) { sub(/^ *reference ours [0-9]* /, ""); refopts = $0 } }' "$rubric" |
        while IFS='|' read -r name scene size spp lights bounces options; do
            "$build/pathtracer" -q -r $size -s "$spp" -l "$lights" -m "$bounces" --seed "$2" $options \
                -f "$subs/$1/$name.png" "tools/rubrics/$scene" >/dev/null </dev/null || exit 1
        done
}
pictures right_pictures 7 1 && echo "right: a directory of its pictures" >"$work/told/right_pictures.txt"
if [ -z "$few" ]; then
    pictures copies_reference 11400714819323198485 0 && echo "hands in the references" >"$work/told/copies_reference.txt"
fi

before=''
[ -e "$work/grades" ] && before=', less what had been graded before'
started=$SECONDS
TIMEFORMAT='%U %S'
{ time "$build/assay" grade -j2 -o "$work/grades" "$rubric" "$subs"/* 2>&3; } 3>&2 2>"$work/time"
status=$?
took="$(((SECONDS - started + 30) / 60)) minutes on $(nproc) processors, load average $(cut -d ' ' -f 2 /proc/loadavg), \
$(awk '{ printf "%.0f", $1 + $2 }' "$work/time") CPU seconds besides those of the submissions' programs$before"
echo "$took" >&2
[ $status -eq 3 ] && exit 3
if [ -n "$few" ]; then
    exec "$build/tests/grade_table" "$work/grades/grades.json" tests/mutants "$work/told"
fi
mkdir -p tests/studies/grading
{
    cat <<EOF
# A class of fifty, graded

Each submission is a renderer with a known bug of tests/mutants, or one of those that try something else. \`make grade-show\` builds them,
grades them by tools/rubrics/cs184-3-1.rubric (100 points; \`assay grade -j2\`) and writes this page. Bold: less than all of the part's points.
"In its part": whether points were lost in the part of the assignment in which the bug was made. "Named": what the student is told it looks like, by these 8-bit
pictures alone. The batch took $took.

EOF
    "$build/tests/grade_table" "$work/grades/grades.json" tests/mutants "$work/told"
    status=$?
} >tests/studies/grading/README.md.new
mv tests/studies/grading/README.md.new tests/studies/grading/README.md
exit $status
