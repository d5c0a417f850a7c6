#!/bin/bash
# tests/end_to_end/grading.sh BUILD: grades the class of "A graded submission in five minutes"
# (tools/docs/guide-course.md) and three more students: cyd with ada's program, eve with a seed of her own, mal with our
# reference plus further samples. Points; who has whose noise; the same grades on one processor and two, and after an
# interruption; another rubric, appeals, one image for several scenes, variants of a scene. Prints "ok NAME" or "not ok
# NAME: why".
set -u
build=$(realpath "${1:?usage: tests/end_to_end/grading.sh BUILD}")
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0

what=grading
. tests/end_to_end/expect.sh
check() { # NAME COMMAND...
    local name=$1
    shift
    tell "$name" "$("$@" >"$tmp/out" 2>&1 || { echo failed: && head -c 1000 "$tmp/out"; })"
}
student() { # NAME OPTION...: our program with these options besides
    mkdir -p "$tmp/submissions/$1"
    cp "$build/pathtracer" "$tmp/submissions/$1/ours"
    printf '#!/bin/sh\nexec ./ours "$@" %s\n' "${*:2}" >"$tmp/submissions/$1/pathtracer"
    chmod +x "$tmp/submissions/$1/pathtracer"
}
mkdir -p "$tmp/submissions/ada" && cp "$build/pathtracer" "$tmp/submissions/ada/"
student bob --only direct
student cyd -t 2
student eve --seed 77
student mal -s 1300 --seed 11400714819323198485 # the reference (its seed can be read in answer_key.c) with 276 samples more
rubric=tools/rubrics/template.rubric
grade() { "$build/assay" grade -q "$@" "$rubric" "$tmp/submissions"/*; }
# Hash of what is the same in every run: all but times.
sums() { (cd "$1" && cat */grade.json | grep -v '"cpu_s"\|"wall_s"' | sha256sum) | grep .; }
points() { grep -q "^\"$1\",$2," "$tmp/two/grades.csv"; }

check "the rubric" "$build/assay" grade --check-rubric "$rubric"
expect "'after' another scene is pointed out" 0 "3-2.rubric:$(grep -n -m 1 'after matt' tools/rubrics/cs184-3-2.rubric | cut -d : -f 1): note: 'after matt' is an image of another scene" "$build/assay" grade --check-rubric tools/rubrics/cs184-3-2.rubric
if ! grade -o "$tmp/two" -j2 >"$tmp/out" 2>&1 && grep -q "no sandbox" "$tmp/out"; then
    echo "skip grading: programs of submissions ($(cat "$tmp/out"))"
    exit 0
fi
check "ada has all points" points ada 10.00
check "bob has not" points bob 4.00
check "eve has all points" points eve 10.00
tr -d '\n' <"$tmp/two/index.html" | sed -n 's/.*<h2>The same noise//p' | sed 's,</ul>.*,,' >"$tmp/alike"
check "ada and cyd have the same noise" grep -q '>ada</a>, <a href="cyd/staff.html">cyd</a></li>' "$tmp/alike"
check "eve has her own" bash -c "! grep -q eve '$tmp/alike'"
tr -d '\n' <"$tmp/two/index.html" | sed -n 's/.*<h2>The noise of the reference//p' | sed 's,</ul>.*,,' >"$tmp/copied"
check "mal has the reference's noise" grep -q '>mal</a>: cornell' "$tmp/copied"
check "nobody else has" test "$(grep -o '<li>' "$tmp/copied" | wc -l)" -eq 1
check "where no mistakes are known nobody says that none was found" grep -q 'What is wrong shows <b>' "$tmp/two/bob/staff.html"
# What bob lost, a check says that is shown after the due date: until then his page does not. Shown (control), it does.
reads() { cat "$tmp/$1/bob/index.html" "$tmp/$1/bob/results.json" | python3 -c '
import json, re, sys
page, results = sys.stdin.read().split("</html>")
results = json.loads(results)
print(page, results["output"], [t["output"] for t in results["tests"] if t["visibility"] == "visible"])'; }
sed '/^ *visibility/d' "$rubric" >"$tmp/shown.rubric"
"$build/assay" grade -q -o "$tmp/shown" --before "$tmp/two" "$tmp/shown.rubric" "$tmp/submissions/bob" >"$tmp/out" 2>&1
for what_is_lost in 'bounced off two surfaces' 'cornell'; do
    check "a hidden check's conclusion: '$what_is_lost' is for staff" grep -q "$what_is_lost" "$tmp/two/bob/staff.html"
    tell "not for bob" "$(reads two 2>&1 | grep -o ".\{40\}$what_is_lost.*\|Traceback")"
    tell "but if the check is shown" "$(reads shown 2>&1 | grep -q "$what_is_lost" || echo "it is not")"
done
check "nor are its points" bash -c "grep -q 'bob: 4.00 of 4 points' '$tmp/two/bob/index.html' && grep -q 'bob: 4.00 of 10 points' '$tmp/shown/bob/index.html'"
# Points are told to a hundredth: a check that loses less than half of one loses nothing, and no page then looks for a
# mistake. Margins of a slope of 1 around what was measured: bob's 6 points less 0.003, and less 0.03 (control).
for loss in 0.0005 0.005; do
    python3 - "$loss" "$tmp" <<'END'
import json, re, sys
loss, tmp = float(sys.argv[1]), sys.argv[2]
cornell = next(c for c in json.load(open(f"{tmp}/shown/bob/grade.json"))["checks"] if c["name"] == "cornell")
tile = next(i for i in cornell["intervals"] if i["what"] == "furthest tile")
full = max(tile["lo"], -tile["hi"]) - loss
head, tail = open(f"{tmp}/shown.rubric").read().split("check cornell")
tail = re.sub("(?m)^  image .*", "  image 0.98 0.99", re.sub("(?m)^  tile .*", f"  tile {full:.9f} {full + 1:.9f}", tail))
open(f"{tmp}/loss-{loss}.rubric", "w").write(head + "check cornell" + tail)
END
    "$build/assay" grade -q -o "$tmp/loss-$loss" --before "$tmp/two" "$tmp/loss-$loss.rubric" "$tmp/submissions/bob" >"$tmp/out" 2>&1
done
check "a loss of 0.003 points is none" bash -c "grep -q '\"points\": 10.0' '$tmp/loss-0.0005/bob/grade.json' && ! grep -q 'class=\"finding\"\|What to look at' '$tmp/loss-0.0005/bob/index.html'"
check "one of 0.03 is one" bash -c "grep -q 'bob: 9.97 of 10' '$tmp/loss-0.005/bob/index.html' && grep -q 'class=\"finding\"' '$tmp/loss-0.005/bob/index.html'"
# The command on the page of staff, as a shell reads it, from where the class was graded.
(cd "$tmp" && "$build/assay" grade -q -o "the class's" "$OLDPWD/$rubric" submissions/ada >/dev/null 2>&1)
printed=$(python3 -c 'import html, re, sys
print(html.unescape(re.search("<pre><code>(assay grade .*)</code></pre>", open(sys.argv[1]).read())[1]))' "$tmp/the class's/ada/staff.html")
rm "$tmp/the class's/ada/grade.json"
check "the printed command grades again: $printed" env -C "$tmp" PATH="$build:$PATH" sh -c "$printed"
check "into the same directory" test -e "$tmp/the class's/ada/grade.json" -a ! -e "$tmp/grades"
check "on one processor" grade -o "$tmp/one" -j 1
check "the same points and reasons on one and on two" test "$(sums "$tmp/one")" = "$(sums "$tmp/two")"
rm -r "$tmp/one/ada" "$tmp/one/eve/grade.json"
check "after an interruption" grade -o "$tmp/one" -j 2
check "the same again" test "$(sums "$tmp/one")" = "$(sums "$tmp/two")"

# Too few samples to decide: a program is run again, with others, until it is; one that takes no other number of samples is left to
# staff, one that is far off needs no further run. Without a budget none is run again.
mv "$tmp/submissions" "$tmp/class"
student right
student deaf -s 4
student dim -m 0
sed '/^image/,$d; s/^total.*/total 8/' tests/end_to_end/quick.rubric >"$tmp/noisy.rubric"
cat >>"$tmp/noisy.rubric" <<'END'
image box
  scene 41_cornell
  size 64 64
  spp 4
  bounces 3
  reference ours 512
part 1 Light
check box 8 equal box
  image 0.01 0.05
  tile 0.04 0.12
END
sed 's/^total/budget cpu 0\n&/' "$tmp/noisy.rubric" >"$tmp/poor.rubric"
for kind in noisy poor; do "$build/assay" grade -q -j 2 -o "$tmp/$kind" "$tmp/$kind.rubric" "$tmp/submissions"/* >"$tmp/out" 2>&1; done
runs() { # FOLDER: of each student the points, whether they are provisional, the runs of the image
    python3 -c '
import json, sys
for id in "deaf", "dim", "right":
    grade = json.load(open(f"{sys.argv[1]}/{id}/grade.json"))
    runs = grade["pictures"][0]["runs"]
    print(id, grade["points"], grade["checks"][0]["provisional"], runs if runs == 1 else "more")' "$1" 2>&1
}
tell "further runs decide where there was too much noise" "$(runs "$tmp/noisy" | diff - <(printf '%s\n' 'deaf 8.0 True more' 'dim 0.0 False 1' 'right 8.0 False more'))"
tell "and none is asked for without a budget" "$(runs "$tmp/poor" | diff - <(printf '%s\n' 'deaf 8.0 True 1' 'dim 0.0 False 1' 'right 8.0 True 1'))"
seen() { tell "$1's reason: $3" "$(grep -q "too noisy to be decided.*$3" "$tmp/$2/$1/grade.json" || grep '"seen"' "$tmp/$2/$1/grade.json")"; }
seen right poor "the next run is not within 'budget cpu 0'"
seen deaf noisy "samples, and .*'box'" # the same with another number, or too slow on a busy machine
"$build/assay" grade -q --unsafe-no-sandbox -o "$tmp/bare" "$tmp/poor.rubric" "$tmp/submissions/right" >"$tmp/out" 2>&1
check "without a sandbox an image may have the name of its directory" grep -q '"file": "box.png"' "$tmp/bare/right/grade.json"
rm -r "$tmp/submissions" && mv "$tmp/class" "$tmp/submissions"

# No image within the limit of wall time: of one that computed for a second of its six staff are told, as the machine may have been busy;
# one that only waits does so on any machine (control).
mkdir -p "$tmp/late/slow" "$tmp/late/idle"
printf '#!/bin/sh\n(ulimit -t 1; while :; do :; done)\nsleep 100\n' >"$tmp/late/slow/pathtracer"
printf '#!/bin/sh\nsleep 100\n' >"$tmp/late/idle/pathtracer"
chmod +x "$tmp/late"/*/pathtracer
sed 's/^limit wall.*/limit wall 6/; /^image cornell/,/^$/d; /^part 2/,$d; s/^total.*/total 4/' "$rubric" >"$tmp/late.rubric"
"$build/assay" grade -q -j 2 -o "$tmp/lated" "$tmp/late.rubric" "$tmp/late/slow" "$tmp/late/idle" >"$tmp/out" 2>&1
check "a run without end says how long it computed" grep -q 'no end after 6 s, of which it computed for [0-9.]* s' "$tmp/lated/slow/grade.json"
check "and staff have to look" grep -q '"flag": "'"'point' had not ended after 6 s, of which it computed" "$tmp/lated/slow/grade.json"
check "nobody promises that another run gets the same" bash -c "! grep -q 'gets the same points' '$tmp/lated/slow/index.html'"
check "nor says that images differ where there is none" bash -c "! grep -q 'images differ' '$tmp/lated/slow/index.html'"
check "one that waits (control)" grep -q '"wrong": ".*no end after 6 s"' "$tmp/lated/idle/grade.json"
check "is nobody's to look at for that" bash -c "! grep -q '\"flag\": \".*computed' '$tmp/lated/idle/grade.json'"

# Another rubric for the same images: they are judged anew, not rendered; --again renders them (control).
times() { (cd "$1" && grep -h '"wall_s"' */grade.json); }
sed 's/^check point 4/check point 5/; s/^check cornell 6/check cornell 5/; s/0.06 0.2/0.06 0.3/' "$rubric" >"$tmp/other.rubric"
before=$(times "$tmp/two")
again() { "$build/assay" grade -q -o "$tmp/two" "$@" "$tmp/other.rubric" "$tmp/submissions"/*; }
check "another rubric" again
check "its points" points bob 5.00
check "of the same runs" test "$(times "$tmp/two")" = "$before"
check "what changed is said" grep -q '"was": 4.0' "$tmp/two/bob/grade.json"
printf '# id check points reason\nbob cornell 3.5 shown to staff\n' >"$tmp/appeals"
check "with an appeal" again --appeals "$tmp/appeals"
check "its points" points bob 8.50
check "of the same runs" test "$(times "$tmp/two")" = "$before"
check "the appeal stands in the list" grep -q '^"bob",8.50,.*cornell by appeal' "$tmp/two/grades.csv"
expect "appeals that are not named again: it is said" 0 "^1 decision of staff no longer applies, 'bob' cornell first, 3.50 points: name the file" \
    "$build/assay" grade -q -o "$tmp/three" --before "$tmp/two" "$tmp/other.rubric" "$tmp/submissions"/*
printf '# nobody\n' >"$tmp/withdrawn"
"$build/assay" grade -q -o "$tmp/four" --before "$tmp/two" --appeals "$tmp/withdrawn" "$tmp/other.rubric" "$tmp/submissions/bob" 2>"$tmp/err"
check "one that is withdrawn is not (control)" test ! -s "$tmp/err"
rm -rf "$tmp/four"
sed -n 1p "$tmp/appeals" >"$tmp/beyond" && echo 'bob cornell 5.5 shown' >>"$tmp/beyond"
expect "more points than the check has" 3 "beyond:2: .*'5.5'.* 0 to 5, the points of 'cornell' in .*other.rubric" "$build/assay" grade -q -o "$tmp/four" --appeals "$tmp/beyond" "$tmp/other.rubric" "$tmp/submissions/bob"
mkdir -p "$tmp/names/grades.csv" && cp -r "$tmp/submissions/ada" "$tmp/names/here"
expect "a name that our own files have" 3 "grades.csv: 'grades.csv' is no name for a submission" "$build/assay" grade -q -o "$tmp/four" "$tmp/other.rubric" "$tmp/names/grades.csv"
check "the folder one is in" env -C "$tmp/names/here" "$build/assay" grade -q -o "$tmp/four" "$tmp/other.rubric" .
check "has its own name" grep -q '^"here",10.00,' "$tmp/four/grades.csv"
# Kept runs whose files are no longer what they were, as after a power failure: each is run again, and the points stay.
damage() { # COMMAND: on every kept image
    local name
    for name in "$tmp"/four/.runs/here/*/out.png; do "$@" "$name"; done
    sed 's/^check point 5/check point 4/; s/^total.*/total 9/' "$tmp/other.rubric" >"$tmp/damaged.rubric"
    "$build/assay" grade -q -o "$tmp/four" "$tmp/damaged.rubric" "$tmp/names/here" && grep -q '^"here",9.00,' "$tmp/four/grades.csv" &&
        "$build/assay" grade -q -o "$tmp/four" "$tmp/other.rubric" "$tmp/names/here" && grep -q '^"here",10.00,' "$tmp/four/grades.csv"
}
check "kept images cut short" damage truncate -s 1000
check "kept images emptied" damage truncate -s 0
check "kept images removed" damage rm
rm -rf "$tmp/four"
check "of the same runs" test "$(times "$tmp/three")" = "$before"
expect "grades that are not there" 3 "no: No such file or directory" "$build/assay" grade -q -o "$tmp/four" --before "$tmp/no" "$tmp/other.rubric" "$tmp/submissions"/*
check "and nothing is graded" test ! -e "$tmp/four"
check "what changed" grep -q '"was": 3.5' "$tmp/three/bob/grade.json"
expect "one graded alone: the others are said to be left out of the list" 0 "now list 1; $(($(ls "$tmp/submissions" | wc -l) - 1)) graded before, .* are not among them" "$build/assay" grade -q -o "$tmp/three" "$tmp/other.rubric" "$tmp/submissions/ada"
# A program whose Parts 1 and 2 are done and that still shows normals, as the starter code does; with other normals
# than the starter code's it is not one.
mkdir "$tmp/course" && cp tools/rubrics/*.dae "$tmp/course"
{
    sed '/^# Part 3$/,$d; /^total /d; /^bugs /d' tools/rubrics/cs184-3-1.rubric
    sed -n '/^part 1/,/^part 3/p' tools/rubrics/cs184-3-1.rubric | sed '$d'
} >"$tmp/course/half.rubric"
mkdir "$tmp/half"
for name in nia nio; do
    mkdir "$tmp/half/$name" && cp "$build/pathtracer" "$tmp/half/$name/ours"
    printf '#!/bin/sh\nexec ./ours "$@" --integrator normals%s\n' "$([ $name = nia ] && echo ' --starter normals')" >"$tmp/half/$name/pathtracer"
    chmod +x "$tmp/half/$name/pathtracer"
done
check "programs that show normals" "$build/assay" grade -q -o "$tmp/five" "$tmp/course/half.rubric" "$tmp/half"/*
check "keep what can be told of Parts 1 and 2: all but shadows" grep -q '^"nia",34.00,' "$tmp/five/grades.csv"
check "and it is said" grep -q '"accepted": "normal_shading"' "$tmp/five/nia/grade.json"
check "other normals (control)" sh -c 'grep "^\"nio\"," "$1" | grep -v "\"nio\",34.00,"' sh "$tmp/five/grades.csv"
check "graded again" again --again
check "of other runs (control)" test "$(times "$tmp/two")" != "$before"

# A scene beside the rubric that has changed since: rendered anew, with another reference.
cp tools/rubrics/shapes.dae "$tmp/shapes.dae"
printf '%s\n' "rubric Shapes" "command {program} -q -s {spp} -m {bounces} -r {width} {height} -f {out} {scene}" "image shapes" "scene shapes.dae" \
    "size 16 16" "spp 4" "bounces 1" "reference ours 64" "part 1 Rays" "check shapes 1 exact shapes" "share 0.1 0.5" >"$tmp/shapes.rubric"
shapes() { "$build/assay" grade -q -o "$tmp/shapes" "$tmp/shapes.rubric" "$tmp/submissions/ada" && grep '"sha256"' "$tmp/shapes/ada/grade.json"; }
image=$(shapes)
check "the same scene, the same image" test "$(shapes)" = "$image"
sed -i 's/<radius>0.056</<radius>0.03</' "$tmp/shapes.dae"
check "another scene, another image" test "$(shapes)" != "$image"
check "and all points" grep -q '"points": 1.0' "$tmp/shapes/ada/grade.json"

check "another seed" grade -o "$tmp/other" --seed 2
check "other numbers (control)" test "$(sums "$tmp/other")" != "$(sums "$tmp/two")"
# One image for three scenes is no evidence of any; for two (control) it is judged.
{
    printf 'rubric One\ncurve srgb\ncommand {program} -f {out} {scene}\ntotal 3\n'
    for name in 12_point_plane 13_square_patch 11_furnace; do
        printf 'image %s\n  scene %s\n  size 32 32\n  spp 16\n  bounces 1\n  reference ours 16\n' $name $name
    done
    printf 'part 1 All\n'
    for name in 12_point_plane 13_square_patch 11_furnace; do printf 'check %s 1 equal %s\n  image 0.9 1e2\n  tile 0.9 1e2\n' $name $name; done
} >"$tmp/one.rubric"
mkdir "$tmp/same"
"$build/pathtracer" -q -r 32 32 -s 16 -m 1 -f "$tmp/same/12_point_plane.png" reference/scenes/12_point_plane.dae >/dev/null
one() { # POINTS
    "$build/assay" grade -q -o "$tmp/one-image" --again "$tmp/one.rubric" "$tmp/same"
    grep "^\"same\",$1," "$tmp/one-image/grades.csv"
}
cp "$tmp/same/12_point_plane.png" "$tmp/same/13_square_patch.png"
one '[0-9.]*' >/dev/null
check "one image for two scenes is judged" test "$(grep -c '"seen": "mean of the image' "$tmp/one-image/same/grade.json")" -eq 2
cp "$tmp/same/12_point_plane.png" "$tmp/same/11_furnace.png"
check "one image for three scenes has no points" one 0.00
check "and is told so" grep -q "the same image was handed in for 2 other scenes" "$tmp/one-image/same/grade.json"
expect "images alone are staff's to look at" 2 "need you" "$build/assay" grade -o "$tmp/one-image" "$tmp/one.rubric" "$tmp/same"
check "with the reason" grep -q '"flag": "images were handed in, and no program' "$tmp/one-image/same/grade.json"
check "which the student does not read" bash -c "! grep -q 'allow images' '$tmp/one-image/same/index.html' '$tmp/one-image/same/results.json'"
sed 's/^total/allow images\n&/' "$tmp/one.rubric" >"$tmp/allowed.rubric"
rm "$tmp/same/11_furnace.png" && "$build/pathtracer" -q -r 32 32 -s 16 -m 1 -f "$tmp/same/11_furnace.png" reference/scenes/11_furnace.dae >/dev/null
check "unless they are allowed" "$build/assay" grade -q -o "$tmp/allowed" "$tmp/allowed.rubric" "$tmp/same"
# Three variants of a scene, by the colour of the lamp. Images made beforehand of the second have all points there (control), and none in
# another; a right program has all in each. What was drawn stays.
for k in 1 2 3; do sed "s/10 10 10/$((4 + 3 * k)) 10 $((16 - 3 * k))/" reference/scenes/41_cornell.dae >"$tmp/walls_$k.dae"; done
printf '%s\n' "rubric Walls" "curve srgb" "command {program} -q -s {spp} -m {bounces} -r {width} {height} --seed {seed} -f {out} {scene}" "variants 3" \
    "image walls" "scene walls_{variant}.dae" "size 32 32" "spp 64" "bounces 3" "reference ours 256" \
    "part 1 Light" "check walls 1 equal walls" "image 0.02 0.08" "tile 0.06 0.2" >"$tmp/walls.rubric"
mkdir "$tmp/beforehand"
"$build/pathtracer" -q -r 32 32 -s 64 -m 3 --seed 9 -f "$tmp/beforehand/walls.png" "$tmp/walls_2.dae" >/dev/null
class() { "$build/assay" grade -q -o "$tmp/walls$1" "${@:2}" "$tmp/walls.rubric" "$tmp/submissions/ada" "$tmp/beforehand"; }
points_of() { grep -q "^\"$2\",$3," "$tmp/walls$1/grades.csv"; } # CLASS ID POINTS
check "variants: each is looked at" "$build/assay" grade --check-rubric "$tmp/walls.rubric"
for k in 1 2 3; do
    class $k --variant $k >/dev/null
    check "variant $k: ada has all points" points_of $k ada 1.00
    check "variant $k: images of variant 2" points_of $k beforehand "$([ $k = 2 ] && echo 1.00 || echo 0.00)"
    check "variant $k is recorded" grep -q "\"variant\": $k" "$tmp/walls$k/ada/grade.json"
done
for n in a b c d; do "$build/assay" grade -q --prepare -o "$tmp/walls-$n" "$tmp/walls.rubric" && cat "$tmp/walls-$n/.references/variant"; done >"$tmp/drawn"
check "one of three is drawn" bash -c "! grep -qv '^[123]$' '$tmp/drawn' && [ \$(wc -l <'$tmp/drawn') -eq 4 ]"
check "graded again" bash -c "rm -r '$tmp/walls3/ada'; exec '$build/assay' grade -q -o '$tmp/walls3' '$tmp/walls.rubric' '$tmp/submissions/ada'"
check "by the same variant" grep -q '"variant": 3' "$tmp/walls3/ada/grade.json"
check "whose command says so" grep -q -- '--variant 3' "$tmp/walls3/ada/grade.json"
expect "another variant than was drawn" 3 "variant 3 was drawn, not 1" class 3 --variant 1
expect "a variant that there is not" 3 "has no variant 4" class 4 --variant 4
expect "a rubric without variants" 3 "has no variants" "$build/assay" grade -o "$tmp/none" --variant 1 "$rubric" "$tmp/beforehand"
rm "$tmp/walls_3.dae"
expect "a variant whose scene is missing" 3 "variant 3: .*no file 'walls_3.dae'" "$build/assay" grade --check-rubric "$tmp/walls.rubric"
[ $failures -eq 0 ]
