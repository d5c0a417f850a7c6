#!/bin/bash
# tests/end_to_end/docs.sh BUILD: every relative link of every Markdown file of the repository leads to a file that
# exists, and to a heading that it has; sources that pages name exist, and pages that sources name; the commands of
# README and guides run in an empty folder; what programs write has the keys of its manual (tools/docs/formats; what
# they read: test_formats.c). Prints "ok NAME" or "not ok NAME: why".
set -u
build=$(realpath "${1:?usage: tests/end_to_end/docs.sh BUILD}")
cd "$(dirname "$0")/../.." || exit 1
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0 what=docs
. tests/end_to_end/expect.sh

# Headings of a page as the fragments that links name: lower case, blanks as -, no other punctuation.
fragments() {
    sed -n 's/^##* //p' "$1" | tr '[:upper:]' '[:lower:]' | sed 's/[^[:alnum:] _-]//g; s/ /-/g'
}
# Prints a line for each dead link of the files given. Links in code do not count.
dead_links() {
    local page dir link file
    for page in "$@"; do
        dir=$(dirname "$page")
        awk '/^```/ { code = !code } !code && !/^    /' "$page" | sed 's/`[^`]*`//g' | grep -oE '\]\([^) ]+(\)|$)' |
            sed 's/^](//; /)$/!s/$/: not closed/; s/)$//' | grep -vE '^[a-z]+:' | while read -r link; do
            file=${link%%#*}
            if [ -z "$file" ]; then file=$page; else file=$dir/$file; fi
            if [ ! -e "$file" ]; then
                echo "$page: $link"
            elif [[ $link == *#* ]] && ! fragments "$file" | grep -qxF -- "${link#*#}"; then
                echo "$page: $link: no such heading"
            fi
        done
    done
}

mapfile -t pages < <(git ls-files -co --exclude-standard -- '*.md' | while read -r f; do [ -e "$f" ] && echo "$f"; done)
tell "links of ${#pages[@]} pages" "$(dead_links "${pages[@]}")"

mkdir "$tmp/docs"
printf '# One page\n[a](../two.md#a-heading-2) [b](gone.md) [c](../two.md#gone) [d](#one-page) `[e](code.md)` [f](two.md\n' >"$tmp/docs/one.md"
printf '## A heading, 2\n' >"$tmp/two.md"
tell "control: three dead links are seen" "$(dead_links "$tmp/docs/one.md" | sed "s,^$tmp/,," |
    diff - <(printf 'docs/one.md: gone.md\ndocs/one.md: ../two.md#gone: no such heading\ndocs/one.md: two.md: not closed\n'))"

# Prints sources named in code of pages, by name or by path, that do not exist. A name with NAME in it stands for any.
declare -A exists
while read -r name; do exists[$name]=1; done < <(git ls-files -co --exclude-standard | sed 's,.*/,,')
missing_names() {
    grep -oE '`[A-Za-z0-9_/]+\.(c|h|cc|sh|mjs|js)`' "$@" /dev/null | tr -d '`' | grep -v NAME | while IFS=: read -r page name; do
        case $name in
        */*) [ -e "$name" ] || [ -e "$(dirname "$page")/$name" ] || echo "$page: $name" ;;
        *) [ -n "${exists[$name]:-}" ] || echo "$page: $name" ;;
        esac
    done
}
tell "sources that pages name" "$(missing_names "${pages[@]}")"
tell "pages that sources name" "$(git grep -oE '\b(renderer|reference|tools|tests)/[A-Za-z_/-]+\.md\b' -- '*.[ch]' '*.sh' '*.mk' '*.rubric' '*.json' |
    while IFS=: read -r source page; do [ -e "$page" ] || echo "$source: $page"; done)"
printf '`docs.sh` and `gone_for_good.c`\n' >"$tmp/three.md"
tell "control: a name that is not there is seen" "$(missing_names "$tmp/three.md" | diff - <(echo "$tmp/three.md: gone_for_good.c"))"

# From here on a directory with the checkout's names in it, which takes what examples write.
top=$PWD
cd "$tmp" || exit 1
ln -s "$build" build
ln -s "$top/tools" "$top/reference" "$top/tests" "$top/golden" .

# The commands of a page in their order: indented lines outside fences, without what programs print (judged:, result:, look:) and
# blocks behind a comment "not run: WHY". `make TARGET` is only looked up, and lines that say "minutes" are left out.
page_commands() { # PAGE
    awk '/^```/ { fence = !fence } /^<!-- not run: / { skip = 1; next } /^[^ ]/ { skip = 0 } !fence && !skip && sub(/^    /, "")' "$1" |
        grep -vE '^(judged|result|look):|^\[|^ |# .*minutes$'
}
# Runs them in one shell and prints what is wrong: a status that is not a verdict's, or a target of make that is none.
run_page() { # PAGE
    page_commands "$1" >page.sh
    grep -q . page.sh || echo "no command in $1"
    sed -n 's/^make \([a-z-]*\).*/\1/p' page.sh | while read -r target; do
        grep -qE "^[a-z -]*\b$target\b.*:" "$top/Makefile" "$top"/tools/packaging/packaging.mk "$top"/tests/*.mk "$top"/tests/*/*.mk || echo "make $target: no such target;"
    done
    # shellcheck disable=SC2016
    { echo 'trap '\''s=$?; [ $s -le 2 ] || echo "$BASH_COMMAND: $s;" >&3'\'' ERR'; grep -v '^make' page.sh; } >run.sh
    bash run.sh 3>&1 >page.out 2>&1 </dev/null
}
walk() {
    run_page tools/docs/guide-course.md
    cp page.out walk.out
    grep -q '^"ada",10.00,10,' grades/grades.csv && grep -q '^"bob",4.00,10,' grades/grades.csv || [ "$(grep -c '^"bob",7.00' grades/grades.csv)" = 1 ] || cat grades/grades.csv walk.out
}

# Names in the first cells of a page's tables of keys; keys of JSON.
page_keys() { # PAGE
    awk -F'|' '/^\|/ { if (!table) in_keys = $2 ~ /^ (key|attribute|channel)/; table = 1; if (in_keys) print $2 } !/^\|/ { table = 0 }' "$1" |
        grep -o '`[^`]*`' | tr -d '`' | sort -u
}
json_keys() { # FILE...
    cat "$@" | grep -oE '"[a-z0-9_]+" *:' | grep -oE '[a-z0-9_]+' | sort -u
}
# Prints a line for each key in the list KEYS that the page lacks, and for each key of the page that no source has.
differ() { # KEYS PAGE
    local key
    page_keys "$2" >keys.page
    comm -23 "$1" keys.page | sed "s,$, is not in ${2##*/};,"
    while read -r key; do
        grep -rqF --include='*.c' --include='*.h' "\"$key" "$top/tools" "$top/reference" "$top/renderer" || echo "$key of ${2##*/} is nowhere;"
    done < <(comm -13 "$1" keys.page)
}

formats=tools/docs/formats
walk >walk.why 2>&1
if grep -q "no sandbox" walk.out; then
    echo "skip docs: the five-minute walk ($(head -c 300 walk.out))"
else
    tell "the five-minute walk of the guide" "$(cat walk.why)"
    json_keys grades/*/grade.json grades/*/results.json >keys
    tell "keys of grades" "$(differ keys $formats/grades.md)"
fi

# JSON Schemas: they are made from the pages, and what programs write is valid.
for page in results grades suite; do
    tell "the schema of $page is its page's" "$(python3 "$top/tools/packaging/schemas.py" $formats/$page.md | diff - $formats/$page.schema.json | head -n 3)"
done
cat >valid.py <<'END'
import json, sys, jsonschema
schema = json.load(open(sys.argv[1]))
jsonschema.Draft202012Validator.check_schema(schema)
for path in sys.argv[2:]:
    for e in list(jsonschema.Draft202012Validator(schema).iter_errors(json.load(open(path))))[:3]:
        print(path, "/".join(map(str, e.absolute_path)), e.message[:200])
END
has_schemas=$(/usr/bin/python3 -c 'import jsonschema; print(jsonschema.Draft202012Validator is not None)' 2>/dev/null)
valid() { # SCHEMA FILE...: what is wrong with them
    if [ -z "$has_schemas" ]; then return; fi
    /usr/bin/python3 valid.py "$formats/$1.schema.json" "${@:2}" 2>&1
}
[ -n "$has_schemas" ] || echo "skip docs: schemas (no python3-jsonschema)"
[ ! -d grades ] || tell "grades are valid by their schema" "$(valid grades grades/*/grade.json)"

# The other guides and the commands of the README, in the same folder of links to the checkout.
cp reference/scenes/41_cornell.dae scene.dae
cp "$top/README.md" .
for page in tools/docs/guide-renderer.md tools/docs/guide-report.md README.md; do
    case $page in
    *renderer*) pattern="^result: all as it should be, 4 the same" ;;
    *) pattern="^DIFFERENT: " ;;
    esac
    case $page:$(head -c 300 walk.out) in
    README.md:*"no sandbox"*) sed -i '/assay grade -o/d' README.md ;;
    esac
    tell "commands of ${page##*/}" "$(run_page $page; grep -q "$pattern" page.out || head -c 1000 page.out)"
done
[ -s page.html ] || tell "the page of the guide" "is not there"
printf '    false\n    bash -c "exit 3"\n    make no-such-target\n' >bad.md
tell "control: a command that fails is seen" "$(run_page bad.md | diff - <(printf 'make no-such-target: no such target;\nbash -c "exit 3": 3;\n'))"
# RESULTS.md is what the program prints: tested by the differences of two scenes, which do not depend on others. Its
# rows have to be scenes of the suite; new scenes come with the next `make results`.
tell "rows of RESULTS.md" "$(sed -n 's/^| \([0-9][0-9]_[a-z0-9_]*\) | .*/\1/p' tools/RESULTS.md | sort -u |
    comm -23 - <(cd reference/scenes && ls [0-9]*.json | sed 's/.json//' | sort))"
build/assay validate -q --only 12_point_plane --only 31_spot_plane -o suite >out 2>&1
differences() { grep -E '^\| (12_point_plane|31_spot_plane) ' | grep -oE '[-+][0-9.]+ ±|^\| [0-9a-z_]+'; }
tell "RESULTS.md is what assay report --matrix prints" "$(build/assay report --matrix suite/results.json | differences | diff - <(differences <tools/RESULTS.md))"

scene=reference/scenes/13_square_patch.dae
for seed in 1 2; do build/pathtracer -q -r 16 16 -s 16 --seed $seed -f $seed.exr $scene >out 2>&1; done
build/assay compare -q --tile 16 --margin 0.5 --json compare.json 1.exr 2.exr
build/assay validate -q --only 12_point_plane -o validated >out 2>&1
build/assay converge -q --shrink 4 -k 4 --ladder 1,4,16 --engine pathtracer --engine pathtracer-sobol -o converged 13_square_patch >out 2>&1
build/assay compare -q --same-program --accept-mdb 0.5 --json same.json 1.exr 2.exr
mkdir a b
for seed in a/1 a/2 a/3 b/4 b/5 b/6; do build/pathtracer -q -r 8 8 -s 4 --seed ${seed#*/} -f $seed.exr $scene >out 2>&1; done
build/assay compare -q --exchangeable --alpha 0.2 --json exchanged.json a b >out 2>&1
tell "results are valid by their schema" "$(valid results compare.json same.json exchanged.json validated/results.json converged/results.json)"
sed 's/"tile": [0-9]*/"tile": "16"/; s/"reason"/"raeson"/' compare.json >wrong.json
[ -z "$has_schemas" ] || tell "control: a number as text and a key that is not there are seen" "$(valid results wrong.json |
    grep -c "is not of type\|raeson\|required" | grep -vx 3)"
json_keys compare.json exchanged.json validated/results.json converged/results.json >keys
tell "keys of results" "$(differ keys $formats/results.md)"

build/assay plan --parts 2 pathtracer -s 4 -r 32 32 -f cells.exr $scene >out 2>&1
build/assay run-job cells.exr.plan 0 1 >out 2>&1 || cat out
json_keys cells.exr.plan/plan.jsonl cells.exr.plan/jobs/*/job.json >keys
tell "keys of plans" "$(differ keys $formats/plan.md)"
tell "control: a key too few and one too many are seen" "$( (grep -v '^key$' keys; echo no_such_key) | sort >keys.control
    grep -v '^| `host`' $formats/plan.md | sed 's/^| `cwd`/| `cwd`, `other_such_key`/' >plan.md
    differ keys.control plan.md | diff - <(printf '%s is not in plan.md;\n' host no_such_key; echo "other_such_key of plan.md is nowhere;"))"

# The example of the EXR is a session: its commands, and names before a colon.
example() { awk '/^```text/ { on = 1; next } /^```/ { on = 0 } on' $formats/moments-exr.md; }
example | sed -n 's/^\$ //p' >session.sh
bash -e session.sh >session.out 2>&1
names() { grep -oE '^ +[A-Za-z:]+( list: .*|:)' | sort; }
tell "the example of a moments EXR" "$(example | names | diff - <(grep -v oiio: session.out | names) | head -5)"
names <session.out | sed -n 's/^ *\(assay:.*\):$/\1/p; s/.*channel list: //p' | tr -d ' ' | tr , '\n' | sort >keys
tell "attributes and channels of a moments EXR" "$(differ keys $formats/moments-exr.md)"
[ $failures -eq 0 ]
