#!/bin/bash
# tests/end_to_end/reproduce.sh BUILD: `assay reproduce` makes renders, stored references and results again, and finds
# what differs. Prints "ok NAME" or "not ok NAME: why".
set -u
build=$(realpath "${1:?usage: tests/end_to_end/reproduce.sh BUILD}")
pathtracer=$build/pathtracer assay=$build/assay scene=reference/scenes/41_cornell.dae
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0

what=reproduce
. tests/end_to_end/expect.sh
expect() { # NAME STATUS PATTERN FILE [OPTION...]
    local name=$1 status=$2 pattern=$3 got
    shift 3
    "$assay" reproduce "$@" >"$tmp/out" 2>&1
    got=$?
    tell "$name" "$({ [ $got -eq "$status" ] && grep -q -- "$pattern" "$tmp/out"; } || echo "status $got: $(head -c 1000 "$tmp/out")")"
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
# The file that is checked stays as it is, even if its name follows its option without a blank.
"$pathtracer" -qHs4 -r 16 16 -f"$tmp/together.exr" $scene >/dev/null
cp "$tmp/together.exr" "$tmp/together.was"
expect "short options together" 0 "the same bits in all" "$tmp/together.exr"
cmp -s "$tmp/together.exr" "$tmp/together.was" || { echo "not ok reproduce: short options together: the file has changed" && failures=$((failures + 1)); }
again "layers" -s 5 --aov $scene
again "a share of the samples" --samples 3:7 $scene
again "a cell" -s 5 -p 3 2 11 9 $scene
again "sobol, guiding, light samples, roulette" -s 4 --sampler sobol --guiding on -l 2 --roulette 0.7 --seed 18446744073709551615 $scene
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
if command -v idiff >/dev/null; then tell "a merge, kept" "$(idiff -q -fail 0 -warn 0 "$tmp/kept.exr" "$tmp/abc.exr" 2>&1)"; fi

again "a scene after --" -s 2 -- $scene

rm "$tmp/x.exr"
"$assay" plan --plan "$tmp/plan" --parts 1 --ranges 3 pathtracer -q -r 24 16 -s 24 --adaptive-unbiased 0.3 --pilot 4 -f "$tmp/x.exr" $scene >/dev/null &&
    "$assay" run-job "$tmp/plan" 0 1 2 >/dev/null && "$assay" gather "$tmp/plan" >/dev/null
expect "of sample ranges" 0 "the same bits in all" "$tmp/x.exr"

# A PNG has the same bytes under another name, with another number of threads, and beside other outputs.
rule=(-s 24 -a 4 0.3)
render "$tmp/p.png" "${rule[@]}" --heatmap "$tmp/heat.png" $scene
"$pathtracer" -f "$tmp/other.exr" -t3 --aov -r 24 16 "${rule[@]}" --keep-state --heatmap "$tmp/other_heat.png" -f "$tmp/another.png" $scene >/dev/null 2>&1
why=$(cmp "$tmp/p.png" "$tmp/another.png" 2>&1; cmp "$tmp/p_rate.png" "$tmp/another_rate.png" 2>&1; cmp "$tmp/heat.png" "$tmp/other_heat.png" 2>&1)
tell "PNG: the same bytes by another name, on other threads, beside other outputs" "$why"
expect "PNG" 3 "p.png: cannot read: " "$tmp/p.png"

# Files that differ, or cannot be made again.
if command -v oiiotool >/dev/null; then
    oiiotool "$tmp/a.exr" --addc 0,0,0,0,0,0,0,0,0.0001,0 -o "$tmp/other.exr" && expect "one channel was changed" 1 "384 of 3840 values DIFFER, first M3" "$tmp/other.exr"
    oiiotool "$tmp/a.exr" --sattrib assay:seed 2 -o "$tmp/other.exr" && expect "another seed is claimed" 3 "assay:seed was '2', and is '1'" "$tmp/other.exr"
    oiiotool "$tmp/a.exr" --attrib assay:command 'pathtracer $(reboot) x.dae' -o "$tmp/other.exr" && expect "a command that a shell would act on" 3 "not a plain command" "$tmp/other.exr"
    oiiotool "$tmp/a.exr" --attrib assay:command 'rm -r /' -o "$tmp/other.exr" && expect "another program's command" 3 "none of this program" "$tmp/other.exr"
    oiiotool --create 24x16 3 -d float -o "$tmp/other.exr" && expect "of another program" 3 "other.exr: does not say by what command it was made" "$tmp/other.exr"
fi
render "$tmp/x.exr" -s 2 "$tmp/it's a scene.dae"
sed -i 's/0\.8/0.7/' "$tmp/it's a scene.dae"
expect "the scene was changed" 3 "is not the file that it was made of" "$tmp/x.exr"
rm "$tmp/it's a scene.dae"
expect "the scene is gone" 3 "is not here" "$tmp/x.exr"
expect "the scene is elsewhere" 0 "the same bits" --scene $scene "$tmp/x.exr"
head -c 600 "$tmp/x.exr" >"$tmp/other.exr"
expect "cut short" 3 "other.exr: cannot read: " "$tmp/other.exr"
rm "$tmp/b.exr"
expect "a share is gone" 3 "share.*is not here" "$tmp/abc.exr"
expect "no render" 3 "cannot read" README.md
expect "no file" 3 "needs a file"
expect "two files" 3 "takes one file" README.md README.md
expect "a file that is not there" 3 "nowhere.exr: cannot read" "$tmp/nowhere.exr"
expect "a number of threads that is none" 3 "--threads" -t x README.md

# Results of a validation, a comparison and a convergence; then with a value changed.
altered() { # FILE NAME: every number of that name with another first digit
    sed -E "s/(\"$2\": -?)[0-9]/\\17/" "$1" >"$1.new" && mv "$1.new" "$1"
}
"$assay" validate -q --only 12_point_plane -o "$tmp/report" >/dev/null
expect "a validation" 0 "the same bits in all [0-9]\{3\}" --keep "$tmp/kept.json" "$tmp/report/results.json"
numbers() { grep -E '"(difference|mdb_global|log10_p)":' "$1"; }
tell "a validation, kept" "$(cmp <(numbers "$tmp/report/results.json") <(numbers "$tmp/kept.json") 2>&1; numbers "$tmp/kept.json" | grep -c . | grep '^0$')"
expect "a validation, kept where nothing can be" 3 "kept.json: not a directory" --keep "$tmp/kept.json/x.json" "$tmp/report/results.json"
altered "$tmp/report/results.json" mdb_global
expect "a validation with a value changed" 1 "values DIFFER, first claims.0..mdb_global: 7" "$tmp/report/results.json"
"$assay" validate "-qo$tmp/together" -qt2 --only 12_point_plane >/dev/null && cp "$tmp/together/results.json" "$tmp/was"
expect "a validation, short options together" 0 "the same bits in all [0-9]\{3\}" "$tmp/together/results.json"
tell "what it said is as it was" "$(cmp "$tmp/together/results.json" "$tmp/was" 2>&1)"
"$assay" validate -q --only 12_point_plane --budget 60s -o "$tmp/budget" >/dev/null
expect "a validation that was decided within its budget" 0 "the same bits in all" "$tmp/budget/results.json"
sed -i 's/--budget 60s/--budget 0.001s/' "$tmp/budget/results.json"
expect "a validation for which there is less time now" 3 "made again: its --budget was over" "$tmp/budget/results.json"
"$assay" validate -q --only 12_point_plane --budget 0.001s -o "$tmp/budget" >/dev/null
expect "a validation that ran out of time" 3 "results.json: its --budget was over before all was decided" "$tmp/budget/results.json"
"$pathtracer" -q -r 32 32 -s 16 --seed 1 -f "$tmp/one.exr" $scene >/dev/null && "$pathtracer" -q -r 32 32 -s 16 --seed 2 -f "$tmp/two.exr" $scene >/dev/null
"$assay" compare -q --margin 0.5 --margin-tile 0.9 --json "$tmp/claim.json" "$tmp/one.exr" "$tmp/two.exr" >/dev/null
expect "a comparison" 0 "the same bits in all" "$tmp/claim.json"
"$pathtracer" -q -r 32 32 -s 16 --seed 3 -f "$tmp/two.exr" $scene >/dev/null
expect "a comparison of which one side is another now" 1 "values DIFFER, first claims.0." "$tmp/claim.json"
rm "$tmp/two.exr"
expect "a comparison of which one side is gone" 3 "two.exr" "$tmp/claim.json"
"$assay" converge -q --engine pathtracer --shrink 8 -k 8 --ladder 1,4,16 --alpha 0.01 -o "$tmp/converge" 41_cornell >/dev/null 2>&1
expect "a convergence, but for its times" 0 "the same bits in all" "$tmp/converge/results.json"
expect "results and the scene of a render" 3 "are for renders" --scene $scene "$tmp/claim.json"
echo '{"assay": 1}' >"$tmp/none.json" && echo '{"command": "rm -rf x"}' >"$tmp/other.json" && echo '[]' >"$tmp/class.json"
expect "results that do not say how" 3 "does not say by what command" "$tmp/none.json"
expect "results of another program" 3 "made by no command of assay" "$tmp/other.json"
expect "grades of a class" 3 "does not say by what command" "$tmp/class.json"
echo '{"command": "assay grade x.rubric x"}' >"$tmp/other.json"
expect "a grade" 3 "made by 'assay grade', which is not made again" "$tmp/other.json"
for file in index.html junit.xml; do
    expect "a page, a table: $file" 3 "$file: cannot read: " "$tmp/report/$file"
done

# Results may come from anybody, and name programs to run.
cat >"$tmp/evil" <<END
#!/bin/sh
touch "$tmp/it_ran"
exit 1
END
chmod +x "$tmp/evil" && mkdir -p "$tmp/share/engines" && cp reference/cycles/cycles.py "$tmp/share"
foreign() { # NAME WORDS [OPTION...]: results of the validation, by a command with these words
    local name=$1 words=$2
    shift 2
    rm -f "$tmp/it_ran"
    sed "s,\"command\": \"assay [a-z]* ,&$words ," "$from" >"$tmp/other.json"
    if [ $# -gt 0 ]; then
        "$assay" reproduce "$@" "$tmp/other.json" >"$tmp/out" 2>&1
        [ -e "$tmp/it_ran" ] && why="" || why="did not run: $(cat "$tmp/out")"
    else
        expect "$name" 3 "runs a program of '.*', which is not ours: look at it, then give --run-foreign" "$tmp/other.json"
        [ ! -e "$tmp/it_ran" ] && [ "$(wc -l <"$tmp/out")" -eq 1 ] && why="" || why="it ran, or says more than a line"
    fi
    tell "$name: what ran" "$why"
}
from=$tmp/report/results.json
"$assay" validate -q --only 12_point_plane --pathtracer "$pathtracer" --share ./reference -o "$tmp/report" >/dev/null
expect "a validation by our own renderer and scripts, named" 0 "the same bits in all" "$tmp/report/results.json"
"$assay" validate -q --only 12_point_plane -o "$tmp/report" >/dev/null
foreign "results with a program" "--pathtracer $tmp/evil"
foreign "results with a program, in one word" "--pathtracer=$tmp/evil"
foreign "results with a program, in a disguise" "-qq-pathtracer $tmp/evil"
foreign "results with an engine" "--engine $tmp/evil.json"
foreign "results with scripts for Blender" "--share $tmp/share"
foreign "results with a program, which is wished" "--pathtracer $tmp/evil" --run-foreign
from=$tmp/converge/results.json
foreign "a convergence with a program" "--pathtracer $tmp/evil"
foreign "a convergence with a program, which is wished" "--pathtracer $tmp/evil" --run-foreign

# Stored references, by their engines.
mkdir -p "$tmp/golden/12_point_plane" && cp golden/12_point_plane/* "$tmp/golden/12_point_plane"
cp golden/12_point_plane/cycles.exr "$tmp/moved.exr"
expect "a reference that is not where it was stored" 3 "made again where it is stored" "$tmp/moved.exr"
if env PATH=/nowhere "$assay" reproduce golden/12_point_plane/cycles.exr >"$tmp/out" 2>&1 || ! grep -q 'blender: no such program' "$tmp/out"; then
    echo "not ok reproduce: a reference without its engine: $(cat "$tmp/out")" && failures=$((failures + 1))
else
    echo "ok reproduce: a reference without its engine"
fi
# A reference made on this machine, as Blender's bits differ between processors; made where a virtual environment is
# active, whose Python has no numpy.
if command -v blender >/dev/null; then
    /usr/bin/python3 -m venv --without-pip "$tmp/venv" && PATH=$tmp/venv/bin:$PATH "$assay" reference --only 12_point_plane --engine cycles --fresh --seed 7 -o "$tmp/made" >/dev/null 2>&1
    expect "a reference by Cycles" 0 "the same bits in all" "$tmp/made/12_point_plane/cycles.exr"
else
    echo "skip reproduce: a reference by Cycles (needs Blender)"
fi

# The command that an interrupted render prints resumes it, also with a "--" in it.
interrupted() { timeout --preserve-status -s INT 1 "$@" 2>&1 >/dev/null; }
said=$(interrupted "$pathtracer" -q -r 16 16 -s 16777216 -f "$tmp/long.exr" -- $scene)
# It is one line of words that a shell reads.
again=$(interrupted bash -c "exec $(echo "$said" | tail -n 1)")
before=$(echo "$said" | sed -n 's/.*interrupted after \([0-9]*\) .*/\1/p') after=$(echo "$again" | sed -n 's/.*interrupted after \([0-9]*\) .*/\1/p')
if [ "${before:-0}" -gt 0 ] && [ "${after:-0}" -gt "$before" ]; then echo "ok reproduce: an interrupted render says how to go on"; else
    echo "not ok reproduce: an interrupted render says how to go on: $said; $again" && failures=$((failures + 1))
fi
[ $failures -eq 0 ]
