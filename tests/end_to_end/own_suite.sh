#!/bin/bash
# tests/end_to_end/own_suite.sh BUILD: runs the guide to a suite of your own, command by command, in an empty folder,
# with the installed program and with a renderer that is not ours; tests what else a suite.json may ask for, and the
# workflow that `assay init` writes. Prints "ok NAME", "not ok NAME: why" or "skip NAME".
set -u
build=$(realpath "${1:?usage: tests/end_to_end/own_suite.sh BUILD}")
tmp=$(mktemp -d) top=$PWD
trap 'rm -rf "$tmp"' EXIT
failures=0 what="own suite"
. tests/end_to_end/expect.sh

(umask 077 && make -s install BUILD="$build" PREFIX="$tmp/my usr") >"$tmp/install.log" 2>&1
tell "it installs" "$([ -x "$tmp/my usr/bin/assay" ] || tail -n 3 "$tmp/install.log")"
tell "for all to read, whatever the umask" "$(find "$tmp/my usr"/* ! -type l ! -perm -004 | head -n 3)"
export PATH="$tmp/once:$tmp/my usr/bin:/usr/bin:$PATH"
mkdir "$tmp/walk" "$tmp/free" "$tmp/once" "$tmp/rendered"
# The guide's tracer.py SCENE WIDTH HEIGHT SPP SEED OUT: renders OUT, or copies it if the same was rendered before.
cat >"$tmp/once/python3" <<END
#!/bin/bash
[[ \$1 == */tracer.py ]] || exec /usr/bin/python3 "\$@"
mapfile -t sums < <(exec md5sum "\$1" "\$2" - <<<"\${*:3:4}")
key=$tmp/rendered/
for sum in "\${sums[@]}"; do key+=\${sum%% *}; done
if [ ! -f "\$key" ]; then
    /usr/bin/python3 "\$@" || exit
    cp "\$7" "\$key.\$\$" && mv "\$key.\$\$" "\$key"
fi
cp "\$key" "\$7"
END
chmod +x "$tmp/once/python3"
cd "$tmp/free" || exit 1

# `assay init` makes a folder that works from any directory.
expect "init" 0 "\`assay validate --suite .*/free/begun\` is green" assay init "$tmp/free/begun"
expect "init in a folder whose name a shell would split" 0 "\`assay validate --suite 'it'.''s mine'\` is green" assay init "it's mine"
tell "so does the workflow there quote it" "$(grep -q "validate --suite 'it'.''s mine' --out" "it's mine/renders.yml" || echo "it does not")"
expect "init does not write over what is there" 3 "begun/suite.json is there already" assay init begun
# Of two scenes one crashes the renderer: the other's reference is made; a scene without one is not rendered to be told so.
mkdir -p half/scenes && cp begun/mine.json half && cp begun/scenes/cornell.dae half/scenes/bad.dae && cp begun/scenes/cornell.dae half/scenes/good.dae
printf '#!/bin/sh\necho "$1" >>"$(dirname "$0")/called"\ncase $1 in *bad*) echo "assertion failed"; exit 7; esac\nexec pathtracer -q -r "$2" "$3" -s "$4" -m "$5" --seed "$6" -f "$7" "$1"\n' >half/mine.sh
chmod +x half/mine.sh
echo '{"engine": "mine.json", "margin": 0.5, "references": {"mine": {}}, "scenes": {"bad": {"file": "scenes/bad.dae", "width": 16, "height": 16}, "good": {"file": "scenes/good.dae", "width": 16, "height": 16}}}' >half/suite.json
expect "a scene that crashes is named" 3 "bad, mine: .*exit status 7: assertion failed" env -C half assay golden render -q --engine mine.json
tell "and the reference of the other is made" "$(ls half/build/golden-candidate/good/mine.exr 2>&1 >/dev/null)"
rm half/called
expect "a reference that is not stored" 3 "no golden of mine" env -C half assay validate -q --only good
tell "is told before anything is rendered" "$(cat half/called 2>/dev/null)"
# Beside files of the user's, first where it fails.
mkdir -p beside/build && touch beside/build/precious beside/golden
expect "init that fails" 0 "^3$" sh -c 'assay init beside >out 2>&1; echo $?'
tell "leaves what was there" "$(find beside -mindepth 1 | sort | diff - <(printf 'beside/build\nbeside/build/precious\nbeside/golden\n'))"
rm beside/golden
expect "and can be tried again" 0 "is green" assay init beside
tell "beside a build folder" "$(ls beside/build/precious 2>&1 >/dev/null; find beside -name 'init-*')"
expect "it is green from another folder" 0 "result: all as it should be, 1 the same" assay validate --suite begun --out report
tell "a place that does not stand out is not named" "$(grep -o '0 x 0 pixels' report/results.json | head -n 1; grep -q '"what": "nothing stands out"' report/results.json || echo "nothing is said")"
tell "validate says where it looked" "$(grep -qx "suite $tmp/free/begun (1 scene), goldens $tmp/free/begun/golden, engine $tmp/free/begun/mine.json" "$tmp/err" || cat "$tmp/err")"
expect "goldens are current" 0 "current  cornell/mine-1.0" env -C begun assay golden status
again=$(python3 -c "import json; print(json.load(open('report/results.json'))['claims'][0]['rerun'])")
expect "the command of a claim runs as it is printed" 0 "result: all as it should be" bash -c "$again"
# Printed commands are for whoever reads the page, in whatever folder.
expect "convergence of the suite's engine" 0 "^mine *slope of RMSE .*EQUIVALENT" \
    assay converge -q --suite begun -k 8 --ladder 1,4,16 --slope-margin 0.25 --margin 0.1 -o converged cornell
expect "which is not for ours" 3 "begun/mine.json is for a suite of its own" assay converge --suite "$top/reference/scenes" --engine begun/mine.json 13_square_patch
mkdir elsewhere
expect "in another folder, too" 0 "result: all as it should be, 1 the same" env -C elsewhere bash -c "$again"
# Same bits need no statistics; the run with other seeds is the control: there the same program is judged by them.
tell "the bits of a program that did not change are the same" "$(grep -q '"same_bits": true' report/results.json && grep -q '"reason": "the same bits as all 64 images of the reference, seed by seed"' report/results.json || echo "not said")"
expect "with other seeds it is judged by statistics" 0 "all as it should be, 1 the same within their margins" assay validate -q --suite begun --reference-seed 5 --out report
tell "which say nothing of bits" "$(grep same_bits report/results.json)"
cp -r begun bits
printf '#!/bin/sh\necho "$6" >>"$(dirname "$0")/called"\nexec pathtracer -q -r "$2" "$3" -s "$4" -m "$5" --seed "$6" -f "$7" "$1"\n' >bits/mine.sh
sed -i 's/"margin"/"margin_variance": 0.01, &/' bits/suite.json
expect "so is its noise, whatever the margin" 0 "all as it should be, 1 the same to the bit" env -C bits assay validate -q
tell "at no more images than the engine makes" "$(wc -l <bits/called | grep -vx 64)"
sed -i 's/"replicates": 64/"replicates": 8/' bits/mine.json && rm bits/called
expect "fewer images are held against as many" 0 "1 the same to the bit" env -C bits assay validate -q
tell "and no more rendered" "$(wc -l <bits/called | grep -vx 8; grep -q 'the same bits as the first 8 of 64 images' bits/build/report/results.json || echo "not said")"
# Other bits: one bounce more, +0.34 % (test_block_means.c has the statistics). Each is compared with the stored image of its
# seed; the control are images of other seeds, of which the same margins are undecided.
sed -i 's/"replicates": 8/"replicates": 64/; s/-m "$5"/-m 6/' bits/mine.json bits/mine.sh
judged_bits() { # MARGIN PAIRED CALLS ARGUMENT...: the exit code, 9 if it was not called so often or does not tell of pairs
    sed -i 's/"margin": [0-9.]*/"margin": '"$1/" bits/suite.json
    rm -f bits/called
    env -C bits assay validate -q "${@:4}"
    local status=$? told
    told=$(grep -o '"paired": [a-z]*' bits/build/report/results.json)
    [ "$(wc -l <bits/called) $told" = "$3 ${2:+"\"paired\": $2"}" ] || return 9
    return $status
}
expect "pairs say nothing of the variance" 2 "has the same mean on cornell" judged_bits 0.5 "" 65
sed -i 's/"margin_variance": 0.01, //' bits/suite.json
expect "a small change is within a small margin, seed by seed" 0 "1 the same within their margins" judged_bits 0.006 true 64
expect "control: not with other seeds" 2 "not noise, but may be within the margin" judged_bits 0.006 "" 64 --reference-seed 5
expect "and beyond a smaller one" 1 "mine is 0.[0-9]* % too bright" judged_bits 0.0025 true 64
again=$(python3 -c "import json; print(json.load(open('bits/build/report/results.json'))['claims'][0]['rerun'])")
expect "as its command says again" 1 "mine is 0.[0-9]* % too bright" env -C elsewhere bash -c "$again"
sed -i 's/-m 6/-m "$5"/; s/--seed "$6"/--seed 7$6/' bits/mine.sh
expect "other random numbers make pairs, too" 0 "1 the same within their margins" judged_bits 0.01 true 64
expect "what they leave open is judged with other seeds" 2 "too noisy to tell" judged_bits 0.0001 false 128
python3 - bits/golden/cornell/manifest.json <<'END'
import json, sys
manifest = json.load(open(sys.argv[1]))
del manifest["mine-1.0"]["blocks"]
json.dump(manifest, open(sys.argv[1], "w"))
END
expect "a reference of before pairs were stored has none" 0 "1 the same within their margins" judged_bits 0.01 "" 65
printf '#!/bin/sh\necho "$6" >>"$(dirname "$0")/called"\necho "assertion failed"\nexit 7\n' >bits/mine.sh && rm bits/called
expect "a program that crashes" 3 "cornell, mine: .*exit status 7: assertion failed" env -C bits assay validate -q
tell "is called once" "$(wc -l <bits/called | grep -vx 1)"
expect "validate in the folder itself" 0 "result: all as it should be, 1 the same" env -C begun assay validate -q --out "$tmp/free/report"
again=$(python3 -c "import json; print(json.load(open('report/results.json'))['claims'][0]['rerun'])")
expect "whose commands run in another folder, too" 0 "result: all as it should be, 1 the same" env -C elsewhere bash -c "$again"
anew=$(python3 - report/index.html <<'END'
import html, re, sys
print(html.unescape(re.search("<code>(assay golden render[^<]*)</code>", open(sys.argv[1]).read()).group(1)))
END
)
expect "so do those that make the reference anew" 0 "IDENTICAL: the same bits" env -C elsewhere bash -ec "$anew"
cp -r begun "without it" && rm -r "without it/golden"
env -C "without it" assay validate -q >/dev/null 2>elsewhere/said
expect "and those on what is missing, which is then there" 0 "1 approved" env -C elsewhere bash -ec "$(sed -n 's/.*no golden of mine-1.0: //p' elsewhere/said)"
expect "control: it is" 0 "result: all as it should be, 1 the same" assay validate -q --suite "without it" --out report
expect "outside a suite ours are looked for where they are installed" 3 "no scene 'x' in .*/share/assay/scenes" assay validate --only x

expect "an engine that reads scenes of its own is not given ours" 3 'mine.json is for a suite of its own.*: give --suite DIR' assay validate -q --engine begun/mine.json

# References of any kind: another engine's name, ours, a closed form that a program writes, one that must come out different.
cp -r begun many
sed -i 's/"replicates": 64/"replicates": 16/' many/mine.json
cat >many/closed.sh <<'END'
#!/bin/sh
# SCENE OUT: a furnace: emission (1 + albedo), as it is seen with one bounce
printf 'PF\n16 16\n-1.0\n' >"$2"
python3 -c 'import array, sys; sys.stdout.buffer.write(array.array("f", [1.2 * 1.3, 0.8 * 1.6, 0.4 * 1.9] * 256).tobytes())' >>"$2"
END
chmod +x many/closed.sh
echo '{"name": "closed", "format": "file", "command": ["./closed.sh", "{scene}", "{out}"], "output": "exact", "image": "pfm"}' >many/closed.json
echo '{"name": "dae", "format": "dae", "command": ["./mine.sh", "{scene}", "{width}", "{height}", "{spp}", "{depth}", "{seed}", "{out}"], "output": "mean", "expresses": ["diffuse"], "replicates": 8}' >many/dae.json
cp "$top/reference/scenes/10_furnace_one.dae" many/scenes/furnace.dae
cat >many/suite.json <<'END'
{
  "engine": "mine.json", "margin": 0.02,
  "scenes": {
    "furnace": { "file": "scenes/furnace.dae", "width": 16, "height": 16, "depth": 1, "references": { "closed": {}, "pathtracer": {"spp": 16} } },
    "cut": { "file": "scenes/cornell.dae", "width": 64, "height": 64, "depth": 1, "expect": "DIFFERENT", "references_of": "cornell" },
    "cornell": { "file": "scenes/cornell.dae", "width": 64, "height": 64, "references": { "mine-1.0": {"replicates": 64} } }
  }
}
END
cd many || exit 1
expect "golden render has its name in its help" 0 "usage: assay golden render" assay golden render --help
expect "a reference that is missing is named, with what makes it" 3 "no golden of closed: render it with the file that describes what makes it (golden render --engine FILE --as closed)" assay validate -q --only furnace
expect "a closed form is stored" 0 "furnace/closed.exr: 16 x 16 pixels, 1 x exact" assay golden render --engine closed.json
sed -i 's/"comment": "/&and /' mine.json
assay golden render --engine mine.json --as mine-1.0 --only cornell >/dev/null 2>&1
expect "and approved, without what is no longer new" 0 "^1 approved, 0 unchanged" assay golden approve --new
expect "--all is for that, too" 0 "approved, in place of what was stored" assay golden approve --all
expect "all of these are as expected" 0 "all as it should be, 3 the same within their margins (1 of them to the bit), 1 deliberate mistake" assay validate -q
expect "an engine that is no reference" 3 "dae: is it one of .*mine-1.0.*give --as NAME" assay golden render --engine dae.json
expect "what an engine cannot express is said" 0 "dae cannot express cornell: the description does not list: area" assay golden render --engine dae.json --as mine-1.0
expect "--live is for our scenes" 3 "references of ./suite.json are stored" assay validate -q --live
sed -i 's/"replicates": 64}/"replicates": 65}/' suite.json
expect "a reference that was made otherwise is stale" 3 "golden has replicates 64, the suite wants 65" assay validate -q --only cornell
sed -i 's/"margin": 0.02/"margins": 0.02/' suite.json
expect "a mistake in suite.json" 3 "suite.json: unknown key 'margins'" assay validate -q
tell "and in one that a schema sees" "$(/usr/bin/python3 - "$top/tools/docs/formats/suite.schema.json" ../begun/suite.json suite.json <<'END' 2>&1
import json, sys
try:
    import jsonschema
except ImportError:
    sys.exit()
check = jsonschema.Draft202012Validator(json.load(open(sys.argv[1])))
check.check_schema(check.schema)
for path, wanted in zip(sys.argv[2:], (0, 1)):
    errors = list(check.iter_errors(json.load(open(path))))
    if len(errors) != wanted:
        print(path, errors)
END
)"
cd ..
# Pixels that share samples: every image is blurred.
cp -r begun blurred
cat >blurred/mine.sh <<'END'
#!/bin/sh
exec python3 - "$2" "$3" "$6" "$7" <<'PY'
import random, array, sys
w, h, seed = map(int, sys.argv[1:4])
r = random.Random(seed)
x = [[r.random() for _ in range(w + 1)] for _ in range(h + 1)]
px = array.array("f", [(x[j][i] + x[j + 1][i] + x[j][i + 1] + x[j + 1][i + 1]) / 4 for j in range(h) for i in range(w) for _ in range(3)])
open(sys.argv[4], "wb").write(b"PF\n%d %d\n-1.0\n" % (w, h) + px.tobytes())
PY
END
sed -i 's/"exr"/"pfm"/; s/64/16/' blurred/mine.json
tell "replicates whose pixels share noise make no reference" "$(env -C blurred assay golden render --engine mine.json 2>&1 | grep -q 'cornell, mine: pixels share their noise' ||
    echo "no such line")"
expect "nor are they judged against one" 3 "cornell, mine: pixels share their noise" env -C blurred assay validate -q

# A pixel filter: a reference that was rendered under it is compared under it.
cp -r begun tent && rm -r tent/golden
sed -i 's/"format"/"filter": "tent:1", "format"/' tent/mine.json
sed -i 's/0.01/0.1/' tent/suite.json
env -C tent assay golden render --engine mine.json >/dev/null 2>&1
expect "a reference under the engine's own filter" 0 "1 approved" env -C tent assay golden approve --new
expect "is what it is compared with" 0 "all as it should be, 1 the same" env -C tent assay validate -q
sed -i 's/tent:1/tent:2/' tent/mine.json
expect "but not under another" 3 "stored with the pixel filter tent:1, not tent:2" env -C tent assay validate -q

# A margin of the variance: three quarters of the samples, 4/3 of the variance, change no mean, and are found; without
# that margin they are not (control).
cp -r begun noisier
sed -i 's/-s "$4"/-s $(($4 * 3 \/ 4))/' noisier/mine.sh
expect "without one, more noise passes" 0 "all as it should be, 1 the same" env -C noisier assay validate -q
sed -i 's/"margin"/"margin_variance": 0.2, &/' noisier/suite.json
expect "with one it does not" 1 "mine is more noisy, 1.[23][0-9]* times the variance on cornell" env -C noisier assay validate -q
cp begun/mine.sh noisier
expect "and what is as noisy as before passes" 0 "all as it should be, 1 the same within their margins" env -C noisier assay validate -q --reference-seed 0

# A version: the page of many runs names it.
cp -r begun versioned
sed -i 's/"format"/"version": ["echo", "mine 1.4-7"], "format"/' versioned/mine.json
expect "an engine that states its version" 0 "all as it should be" env -C versioned assay validate -q
expect "is named by it in a history" 0 "" assay report --history versioned/build
tell "and not by ours" "$(grep -q '<td>mine 1.4-7</td>' versioned/build/history.html && ! grep -q nan versioned/build/history.html || grep '<td>' versioned/build/history.html)"

# A margin of the engine's own, with its reason: a difference of 2.5 %, beyond the suite's margin of 1 %, is within it, and the page says so.
cp -r begun wide
sed -i 's/"spp": 32/"margin": {"global": 0.3, "tile": 0.9, "reason": "its paths are <short>"}, "spp": 32/' wide/mine.json
sed -i 's/-m "$5"/-m 3/' wide/mine.sh
expect "an engine's own margin widens those of the scenes" 0 "^mine declares margins of its own, 30 % of an image and 90 % of a tile: its paths are <short>" \
    env -C wide assay validate -q
tell "the page says so" "$(grep -q 'mine declares margins of its own, 30 % of an image and 90 % of a tile.*: its paths are &lt;short&gt;' wide/build/report/index.html || echo "it does not")"

# A renderer without seeds is judged by one long render: it has the same bits as its former release; a bug (16 % too
# dark) stands out of the noise that the difference itself shows. H0: the images are the same; alpha 1e-3 for the run,
# fixed seeds.
cp -r begun quiet
echo '{"name": "mine", "format": "file", "output": "noisy", "spp": 1024, "command": ["./mine.sh", "{scene}", "{width}", "{height}", "{spp}", "{depth}", "1", "{out}"]}' >quiet/mine.json
sed -i 's/0.01/0.03/; s/"mine-1.0": {}/"mine-2.0": {}/; s/"width": 64, "height": 64/"width": 192, "height": 192/' quiet/suite.json
expect "a noisy image is stored" 0 "mine-2.0.exr: 192 x 192 pixels, 3 x picture" env -C quiet assay golden render --engine mine.json --as mine-2.0
expect "and approved" 0 "1 approved" env -C quiet assay golden approve --new cornell/mine-2.0
expect "without seeds: the bits of its former release" 0 "all as it should be, 1 the same" env -C quiet assay validate -q
tell "of the same bits the difference is 0" "$(python3 -c "
import json
print(*[c['difference'] for c in json.load(open('quiet/build/report/results.json'))['claims'] if c['difference']])")"
sed -i 's/-m "$5"/-m 1/' quiet/mine.sh
expect "without seeds: a bug is DIFFERENT" 1 "1 of 1 not as it should be: mine is .* too dark" env -C quiet assay validate -q

if ! python3 -c 'import numpy' 2>/dev/null; then
    echo "skip own suite: the guide (no python3-numpy)"
    exit $((failures > 0))
fi
# The guide's commands: its indented lines, without what programs print.
cd "$tmp/walk" || exit 1
cp "$top/tests/end_to_end/tracer.py" .
echo '{"floor": [0.5, 0.5, 0.5], "lamp": {"height": 3, "size": 1, "radiance": 20}, "balls": [{"at": [0, 0.5, 0], "radius": 0.5, "albedo": [0.7, 0.3, 0.2]}]}' >ball.json
echo '{"floor": [0.6, 0.6, 0.6], "lamp": {"height": 3, "size": 2, "radiance": 5}, "balls": [{"at": [-0.6, 0.5, 0], "radius": 0.5, "albedo": [0.2, 0.6, 0.3]}, {"at": [0.5, 0.4, 0.4], "radius": 0.4, "albedo": [0.8, 0.8, 0.8]}]}' >two.json
# 16 images in place of 64 are enough for that tracer, and take a quarter of the time.
guide() { sed -n 's/^    //p' "$top/tools/docs/guide-own-suite.md" | grep -v '^result:' | sed '/"pfm"/s/$/; sed -i s,64,16, mine.json/'; }
guide | sed '/^cd \.\.$/,$d' >first.sh
guide | sed -n '/^cd \.\.$/,$p' | sed 1d >second.sh
bash -c 'trap '\''s=$?; echo "status $s: $BASH_COMMAND"; [ $s -le 1 ] || exit'\'' ERR; . ./first.sh' >first.out 2>&1 </dev/null
tell "the guide: green, red, green" "$(grep -oE '^result: (all as it should be, [0-9]+|2 of 2 not as it should be: mine is [0-9.]+ % too dark)|^status .*' first.out | sed 's/[0-9.]* % too dark/dark/' |
    diff - <(printf '%s\n' 'result: all as it should be, 1' 'result: all as it should be, 2' 'result: all as it should be, 2' 'result: 2 of 2 not as it should be: mine is dark' \
        'status 1: assay validate' 'result: all as it should be, 2') || tail -n 5 first.out)"
tell "CI has the line where it is wrong" "$(grep -q '^::error title=ball.*DIFFERENT, expected EQUIVALENT' first.out || grep '^::' first.out)"
tell "control: no other line of the guide fails" "$(grep -c '^status' first.out | grep -vx 1)"

# Each step of the workflow, in a repository laid out as it expects.
mkdir "$tmp/bin"
ln -s "$top" assay
printf '#!/bin/sh\n' | tee build.sh >"$tmp/bin/apt-get"
chmod +x build.sh "$tmp/bin/apt-get"
workflow() {
    sed -n 's/^ *run: //p' renders/renders.yml | while IFS= read -r line; do
        PATH=$tmp/bin:$PATH bash -ec "$line" </dev/null >step.out 2>&1 || echo "$line: status $?"
        cat step.out >>workflow.out
    done
}
tell "the workflow is green" "$(workflow)"
sed -i 's/bounce in range(2)/bounce in range(1)/' tracer.py
rm workflow.out
tell "and red where the renderer is wrong" "$(workflow | diff - <(echo 'assay/build/assay validate --suite renders --out report: status 1') && grep -q '^::error title=two' workflow.out ||
    tail -n 3 workflow.out)"
sed -i 's/bounce in range(1)/bounce in range(2)/' tracer.py

if ! python3 -c 'import pytest' 2>/dev/null; then
    echo "skip own suite: the guide in Python alone (no python3-pytest)"
    exit $((failures > 0))
fi
export PYTHONPATH=$top/tools/python ASSAY_LIBRARY="$tmp/my usr/lib/libassay.so.1" PYTHONDONTWRITEBYTECODE=1
bash ./second.sh >second.out 2>&1 </dev/null
tell "the guide in Python alone: green, red, green" "$(grep -oE '^[0-9]+ (passed|failed)' second.out | diff - <(printf '2 passed\n2 failed\n2 passed\n') || tail -n 5 second.out)"
tell "pytest says the verdict, the place and the page" "$(grep -q 'AssertionError: DIFFERENT: ' second.out && grep -q 'worst: ' second.out && grep -q 'page: assay-reports/' second.out ||
    grep '^E' second.out | head -n 5)"
exit $((failures > 0))
