#!/bin/bash
# tests/end_to_end/faults.sh BUILD [KILLS [PART...]]: faults of the environment. kill -9 at KILLS random moments (6)
# each of a render, a golden update, a grading batch, a report and a validation: no output is ever half written, and
# resuming ends with the bits of an uninterrupted run. Full disk, read-only directory, closed pipe, clock jumps, a
# decimal comma, what grading may lack. Prints "ok NAME" or "not ok NAME: why". PARTs: kill_renders kill_golden
# kill_grading kill_report kill_validation disk clock comma ours_to_mend (default: all these; disk uses what grading and
# validation leave); memory: tests/end_to_end/no_memory.sh with every allocation (an hour).
set -u
build=$(realpath "${1:?usage: tests/end_to_end/faults.sh BUILD [KILLS [PART...]]}") kills=${2:-6}
shift $(($# > 2 ? 2 : $#))
[ $# -gt 0 ] || set -- kill_renders kill_golden kill_grading kill_report kill_validation disk clock comma ours_to_mend
pathtracer=$build/pathtracer assay=$build/assay root=$PWD scene=$PWD/reference/scenes/41_cornell.dae
tmp=$(mktemp -d)
# What is killed here, or has no disk, keeps no counts for tests/end_to_end/coverage.sh (LLVM_PROFILE_FILE): it would spoil those of the others.
trap 'rm -rf "$tmp"' EXIT
failures=0
RANDOM=1 # the moments are the same parts of a run in every run of this script

what=""
. tests/end_to_end/expect.sh
# More tries until $kills of them met the program, at most 5 $kills + 50: it may end sooner than when it was timed.
more_kills() { [ "$hits" -lt "$kills" ] && [ "$1" -lt $((5 * kills + 50)) ]; }
too_few() { [ "$hits" -eq "$kills" ] || echo "only $hits of $1 tries met the program"; }
milliseconds() { echo $(($(date +%s%N) / 1000000)); }
# killed MOST COMMAND...: runs it for a random part of MOST milliseconds. Status 0 if it had ended by itself, else counted in hits.
hits=0
killed() {
    local part=$((1 + RANDOM * $1 / 32767)) status
    shift
    { LLVM_PROFILE_FILE=/dev/null timeout -s KILL "$(printf '%d.%03d' $((part / 1000)) $((part % 1000)))" "$@" >"$tmp/out" 2>"$tmp/err" </dev/null; } 2>/dev/null
    status=$?
    [ $status -eq 137 ] && hits=$((hits + 1))
    [ $status -ne 137 ] && [ $status -ne 0 ] && echo "status $status: $(head -c 300 "$tmp/err")" >>"$tmp/why"
    return $status
}
# Can the moments of a file be read, n of every pixel included? The harness refuses to compare a file with itself in
# these words only after reading all of it.
is_whole() {
    "$assay" compare --margin 0.9 --margin-tile 0.9 "$1" "$1" 2>&1 | grep -q 'the same observations'
}

kill_renders() {
    local dir=$tmp/render why="" k=0 before=0 most start began resume="" lost=0 now n
    mkdir -p "$dir"
    local render=("$pathtracer" -q -t 2 -r 48 32 -s 1000 --aov)
    start=$(milliseconds)
    "${render[@]}" --keep-state -f "$dir/whole.exr" "$scene" >/dev/null
    most=$((($(milliseconds) - start) / 2 + 60))
    rm -f "$tmp/why"
    while more_kills $k && [ -z "$why" ]; do
        [ -e "$dir/x.exr.state" ] && resume="--resume $dir/x.exr"
        began=$(milliseconds)
        if killed $most "${render[@]}" --keep-state --write-every 0.05 $resume -f "$dir/x.exr" "$scene"; then
            # It came to its end: again from the start.
            cmp "$dir/whole.exr.state" "$dir/x.exr.state" >/dev/null || why="other bits after $k kills"
            rm -f "$dir"/x.exr* && resume="" && before=0
        else
            # What was done since the state was written, or since the start.
            now=$(milliseconds)
            n=$(stat -c %.3Y "$dir/x.exr.state" 2>/dev/null | tr -d .)
            [ "${n:-0}" -gt "$began" ] && began=$n
            [ $((now - began)) -gt $lost ] && lost=$((now - began))
        fi
        k=$((k + 1))
        [ -e "$tmp/why" ] && why="$(cat "$tmp/why")"
        [ -e "$dir/x.exr" ] && ! is_whole "$dir/x.exr" && why="kill $k left an image that cannot be read"
        if [ -e "$dir/x.exr.state" ]; then
            # The number of samples stands behind the nine lines of the head.
            n=$(tail -c +$(($(head -n 9 "$dir/x.exr.state" | wc -c) + 1)) "$dir/x.exr.state" | od -An -tu4 -N4 | tr -d ' ')
            [ "$n" -lt "$before" ] && why="kill $k left $n samples, there had been $before"
            before=$n
        fi
    done
    [ -e "$dir/x.exr.state" ] && resume="--resume $dir/x.exr" || resume=""
    [ -z "$why" ] && "${render[@]}" --keep-state $resume -f "$dir/x.exr" "$scene" >/dev/null 2>"$tmp/err"
    [ -z "$why" ] && ! cmp "$dir/whole.exr.state" "$dir/x.exr.state" >/dev/null && why="other bits at the end: $(cat "$tmp/err")"
    tell "kill -9, $hits moments of a render ($k tries): whole images, no written sample lost (at most $lost ms of work), the same bits" "${why:-$(too_few $k)}"
}

# New references that differ in the last bits from those stored.
make_candidates() { # DIR
    local scenes="11_furnace 12_point_plane 41_cornell" exr name old new
    mkdir -p "$1"
    for name in $scenes; do
        cp -r "golden/$name" "$1"
        for exr in "$1/$name"/*.exr; do
            old=$(sha256sum "$exr" | cut -c1-64)
            oiiotool "$exr" --mulc 1.0000002,1.0000002,1.0000002,1,1,1,1,1,1,1 -o "$exr.new.exr" && mv "$exr.new.exr" "$exr"
            new=$(sha256sum "$exr" | cut -c1-64)
            sed -i "s/$old/$new/" "$1/$name/manifest.json"
        done
    done
}
hashes() { (cd "$1" && sha256sum */*.exr | sort); }

kill_golden() {
    local why="" k=0 start most store=$tmp/store
    if ! command -v oiiotool >/dev/null; then
        echo "ok oiiotool is not here: no golden update is killed"
        return
    fi
    make_candidates "$tmp/candidates"
    # What `approve` stores; images are compared, not manifests, which have dates.
    local names
    names=$(ls "$tmp/candidates")
    mkdir -p "$tmp/first" && for name in $names; do cp -r "golden/$name" "$tmp/first"; done
    cp -r "$tmp/first" "$tmp/straight"
    start=$(milliseconds)
    "$assay" golden approve --from "$tmp/candidates" --golden "$tmp/straight" $names >/dev/null 2>&1
    most=$(($(milliseconds) - start))
    hashes "$tmp/straight" >"$tmp/straight.txt"
    cmp -s "$tmp/straight.txt" <(hashes "$tmp/first") && why="nothing was updated"
    rm -f "$tmp/why"
    cp -r "$tmp/first" "$store"
    while more_kills $k && [ -z "$why" ]; do
        killed $most "$assay" golden approve --from "$tmp/candidates" --golden "$store" $names
        [ $? -eq 0 ] && rm -rf "$store" && cp -r "$tmp/first" "$store"
        k=$((k + 1))
        "$assay" golden status --golden "$store" 2>/dev/null | grep -v '/noise, ' >"$tmp/status" # noise is not what is updated
        for name in $names; do
            grep -q "damaged.*$name/\|missing.*$name/\|stale.*$name/" "$tmp/status" && why="kill $k: $(grep " $name/" "$tmp/status" | head -n 2)"
        done
        [ -e "$tmp/why" ] && why="$(cat "$tmp/why")"
    done
    "$assay" golden approve --from "$tmp/candidates" --golden "$store" $names >"$tmp/last" 2>&1
    [ -z "$why" ] && ! cmp -s "$tmp/straight.txt" <(hashes "$store") &&
        why="other images at the end: $(diff "$tmp/straight.txt" <(hashes "$store")); $(cat "$tmp/last")"
    [ -z "$why" ] && [ -n "$(find "$store" -name '*.next')" ] && why="an image is left beside its place"
    tell "kill -9, $hits moments of a golden update ($k tries): no reference is lost, the same images at the end" "${why:-$(too_few $k)}"
}

kill_grading() {
    local why="" k=0 start most i out=$tmp/grades
    sed 's/^total/allow images\n&/' tests/end_to_end/quick.rubric >"$tmp/quick.rubric"
    mkdir -p "$tmp/subs"
    for i in 1 2 3 4 5 6 7 8; do
        mkdir "$tmp/subs/s$i"
        "$pathtracer" -q -s 16 -m $((i % 3 > 0)) -r 64 64 --seed $i -f "$tmp/subs/s$i/point.png" reference/scenes/12_point_plane.dae >/dev/null 2>&1
    done
    start=$(milliseconds)
    if ! "$assay" grade -q -o "$tmp/straight_grades" "$tmp/quick.rubric" "$tmp/subs"/* >"$tmp/out" 2>&1; then
        if grep -q "no sandbox" "$tmp/out"; then echo "ok no grading is killed ($(tail -n 1 "$tmp/out"))" && return; fi
        tell "kill -9 of a grading batch" "$(tail -n 3 "$tmp/out")"
        return
    fi
    most=$(($(milliseconds) - start))
    [ "$(grep -c '"8.00"\|8\.00' "$tmp/straight_grades/grades.csv")" -gt 2 ] || why="$(cat "$tmp/straight_grades/grades.csv")"
    rm -f "$tmp/why"
    while more_kills $k && [ -z "$why" ]; do
        killed $most "$assay" grade -q -o "$out" "$tmp/quick.rubric" "$tmp/subs"/*
        [ $? -eq 0 ] && rm -rf "$out"
        k=$((k + 1))
        for i in "$out"/*/grade.json "$out"/*/results.json; do
            [ -e "$i" ] && ! "$assay_json" "$i" && why="kill $k left half of $i"
        done
        [ -e "$tmp/why" ] && why="$(cat "$tmp/why")"
    done
    "$assay" grade -q -o "$out" "$tmp/quick.rubric" "$tmp/subs"/* >/dev/null 2>&1
    [ -z "$why" ] && ! cmp -s "$tmp/straight_grades/grades.csv" "$out/grades.csv" && why="other points at the end"
    tell "kill -9, $hits moments of a grading batch ($k tries): no half of a file, the same points at the end" "${why:-$(too_few $k)}"
}
# A JSON file is taken for whole if its first and last bytes, blanks aside, are braces, as all are objects.
json_is_whole() { [ "$(tr -d ' \n' <"$1" | tail -c 1)" = "}" ] && [ "$(tr -d ' \n' <"$1" | head -c 1)" = "{" ]; }
assay_json=json_is_whole

kill_report() {
    local why="" k=0 start most dir=$tmp/report
    "$assay" validate -q --out "$dir" --only 12_point_plane >/dev/null 2>&1
    start=$(milliseconds)
    "$assay" report "$dir/results.json" >/dev/null 2>&1
    most=$(($(milliseconds) - start))
    [ -s "$dir/index.html" ] || why="no page"
    cp "$dir/index.html" "$tmp/page.html"
    rm -f "$tmp/why"
    while more_kills $k && [ -z "$why" ]; do
        [ $((k % 2)) -eq 0 ] && rm -f "$dir/index.html"
        killed $most "$assay" report "$dir/results.json"
        k=$((k + 1))
        [ -e "$dir/index.html" ] && ! cmp -s "$tmp/page.html" "$dir/index.html" && why="kill $k left another page"
        [ -e "$tmp/why" ] && why="$(cat "$tmp/why")"
    done
    tell "kill -9, $hits moments of a report ($k tries): the whole page or none" "${why:-$(too_few $k)}"
}

kill_validation() {
    local why="" k=0 start most dir=$tmp/suite
    local validate=("$assay" validate -q -t 2 --only 12_point_plane)
    start=$(milliseconds)
    "${validate[@]}" --out "$tmp/straight_suite" >/dev/null 2>&1
    most=$(($(milliseconds) - start))
    rm -f "$tmp/why"
    while more_kills $k && [ -z "$why" ]; do
        killed $most "${validate[@]}" --out "$dir"
        [ $? -eq 0 ] && rm -rf "$dir"
        k=$((k + 1))
        [ -e "$dir/results.json" ] && ! json_is_whole "$dir/results.json" && why="kill $k left half a results.json"
        [ -e "$tmp/why" ] && why="$(cat "$tmp/why")"
    done
    "${validate[@]}" --out "$dir" >/dev/null 2>&1
    for file in $(cd "$tmp/straight_suite" && find . -name '*.png'); do
        cmp -s "$tmp/straight_suite/$file" "$dir/$file" || why="$file has other bits at the end"
    done
    # Without the efficiency in the table of noise, which depends on CPU time.
    "$assay" report --markdown "$tmp/straight_suite/results.json" | awk -F"|" 'NF == 10 { $8 = "" } 1' >"$tmp/a.md"
    "$assay" report --markdown "$dir/results.json" | awk -F"|" 'NF == 10 { $8 = "" } 1' >"$tmp/b.md"
    cmp -s "$tmp/a.md" "$tmp/b.md" || why="${why:-other verdicts at the end: $(diff "$tmp/a.md" "$tmp/b.md" | head -n 5)}"
    tell "kill -9, $hits moments of a validation ($k tries): whole results or none, the same verdicts at the end" "${why:-$(too_few $k)}"
}

# refused NAME PATTERN DIR COMMAND...: exit 3, one line with the pattern, and DIR as it was.
refused() {
    local name=$1 pattern=$2 dir=$3 why="" status
    shift 3
    (cd "$dir" && find . -type f -exec sha256sum {} + | sort) >"$tmp/before"
    timeout -s KILL 60 "$@" >"$tmp/out" 2>"$tmp/err" </dev/null
    status=$?
    (cd "$dir" && find . -type f -exec sha256sum {} + | sort) >"$tmp/after"
    if [ $status -ne 3 ]; then why="status $status: $(head -c 300 "$tmp/err")"
    elif [ "$(wc -l <"$tmp/err")" -ne 1 ]; then why="$(wc -l <"$tmp/err") lines: $(head -c 500 "$tmp/err")"
    elif ! grep -q -- "$pattern" "$tmp/err"; then why="no '$pattern' in: $(cat "$tmp/err")"
    elif ! cmp -s "$tmp/before" "$tmp/after"; then why="files changed: $(diff "$tmp/before" "$tmp/after" | head -n 3)"; fi
    tell "$name" "$why"
}
# limited LIMIT COMMAND...: no file can grow beyond LIMIT KiB, which to a program is a full disk with another error
# message.
cat >"$tmp/limited" <<'END'
#!/bin/bash
trap '' XFSZ
ulimit -f "$1"
shift
export LLVM_PROFILE_FILE=/dev/null
exec "$@"
END
chmod +x "$tmp/limited"

render_shares() {
    "$pathtracer" -q -r 64 64 --samples 4:8 -f "$tmp/share1.exr" "$scene" >/dev/null
    "$pathtracer" -q -r 64 64 --samples 0:4 -f "$tmp/share0.exr" "$scene" >/dev/null
}

disk() {
    local dir=$tmp/disk small
    mkdir -p "$dir"
    "$pathtracer" -q -r 64 64 -s 4 -f "$dir/x.exr" -f "$dir/x.png" "$scene" >/dev/null
    render_shares
    refused "disk full: an image; the one before stays" "x.exr: cannot write: File too large" "$dir" \
        "$tmp/limited" 16 "$pathtracer" -q -r 64 64 -s 8 -f "$dir/x.exr" "$scene"
    refused "disk full: a PNG image" "x.png: cannot write" "$dir" \
        "$tmp/limited" 4 "$pathtracer" -q -r 64 64 -s 8 -f "$dir/x.png" "$scene"
    refused "disk full: the state of a render" "state: cannot write: File too large" "$dir" \
        "$tmp/limited" 200 "$pathtracer" -q -r 64 64 -s 8 --keep-state -f "$tmp/y.png" "$scene"
    ls "$tmp" | grep -q 'y.png.' && tell "disk full: nothing of a state is left" "$(ls "$tmp" | grep 'y.png.')"
    refused "disk full: merge" "m.exr: cannot write: File too large" "$dir" \
        "$tmp/limited" 16 "$assay" merge "$dir/m.exr" "$tmp/share0.exr" "$tmp/share1.exr"
    refused "disk full: export" "cannot write.*: File too large" "$dir" "$tmp/limited" 1 "$assay" export -o "$dir/s.pov" "$scene"
    refused "disk full: a comparison" "c.json.z.exr: cannot write: File too large" "$dir" \
        "$tmp/limited" 4 "$assay" compare -q --margin 0.9 --margin-tile 0.9 --json "$dir/c.json" "$tmp/share0.exr" "$tmp/share1.exr"
    refused "disk full: a validation" "cannot write: File too large" "$dir" \
        "$tmp/limited" 16 "$assay" validate -q --only 12_point_plane --out "$tmp/full_suite"
    [ -e "$tmp/full_suite/index.html" ] && tell "disk full: no page of a validation" "there is one"
    refused "disk full: the page" "index.html: cannot write: File too large" "$tmp/straight_suite" \
        "$tmp/limited" 16 "$assay" report "$tmp/straight_suite/results.json"
    if [ -d "$tmp/candidates" ]; then
        refused "disk full: a golden update; the reference before stays" "cannot write: File too large" "$tmp/first" \
            "$tmp/limited" 16 "$assay" golden approve --from "$tmp/candidates" --golden "$tmp/first" 41_cornell/cycles
    fi
    for small in "$pathtracer --help" "$assay --help" "$pathtracer -q -r 8 8 -s 1 -f $tmp/z.exr $scene" \
        "$assay merge $tmp/z.exr $tmp/share0.exr $tmp/share1.exr" "$assay golden status"; do
        # shellcheck disable=SC2086
        $small >/dev/full 2>"$tmp/err"
        if [ $? -eq 3 ] && [ "$(cat "$tmp/err" | wc -l)" -eq 1 ] && grep -q "cannot write to standard output" "$tmp/err"; then
            tell "disk full: what ${small##*/} prints" ""
        else tell "disk full: what ${small##*/} prints" "$(head -c 300 "$tmp/err")"; fi
    done
    if bwrap --ro-bind / / --dev /dev true 2>/dev/null; then
        local ro=(env LLVM_PROFILE_FILE=/dev/null bwrap --ro-bind / / --dev /dev)
        refused "read-only directory: an image" "n.exr: cannot write: Read-only" "$dir" "${ro[@]}" "$pathtracer" -q -r 8 8 -f "$dir/n.exr" "$scene"
        refused "read-only directory: merge" "m.exr: cannot write: Read-only" "$dir" "${ro[@]}" "$assay" merge "$dir/m.exr" "$tmp/share0.exr" "$tmp/share1.exr"
        refused "read-only directory: a validation" "Read-only" "$dir" "${ro[@]}" "$assay" validate -q --only 12_point_plane --out "$dir/v"
        refused "read-only directory: export" "s.pov: cannot write: Read-only" "$dir" "${ro[@]}" "$assay" export -o "$dir/s.pov" "$scene"
        refused "read-only directory: the page" "index.html: cannot write: Read-only" "$tmp/straight_suite" "${ro[@]}" "$assay" report "$tmp/straight_suite/results.json"
        if [ -d "$tmp/candidates" ]; then
            refused "read-only directory: a golden update" "Read-only" "$tmp/first" \
                "${ro[@]}" "$assay" golden approve --from "$tmp/candidates" --golden "$tmp/first" 41_cornell/cycles
        fi
        refused "read-only directory: grading" "no temporary directory\|Read-only" "$dir" "${ro[@]}" "$assay" grade -q -o "$dir/g" "$tmp/quick.rubric" "$tmp/subs/s1"
    else
        echo "ok bubblewrap is not here: no read-only directory"
    fi
    # A reader that goes away: the image is whole, whether the signal ends the program or is ignored.
    "$pathtracer" -q -r 16 16 -s 4 -f "$tmp/p1.exr" "$scene" 2>/dev/null | true
    (trap '' PIPE; "$pathtracer" -q -r 16 16 -s 4 -f "$tmp/p2.exr" "$scene" 2>"$tmp/err"; echo $? >"$tmp/status") | true
    if is_whole "$tmp/p1.exr" && is_whole "$tmp/p2.exr"; then tell "closed pipe: whole images" ""; else tell "closed pipe: whole images" "no"; fi
}

# Whole commands while memory runs out.
memory() {
    tests/end_to_end/no_memory.sh --all "$build" || failures=$((failures + 1))
}

# --time, --write-every and Ctrl-C rely on a clock that nobody can set.
clock() {
    local so=$tmp/clock.so why="" start took
    gcc -O1 -shared -fPIC -o "$so" tests/end_to_end/clock.c -ldl || why="cannot build it"
    [ "$(LD_PRELOAD="$so" date +%s)" -gt "$(($(date +%s) + 3000))" ] || why="the clock does not jump"
    start=$(milliseconds)
    timeout -s KILL 60 env LD_PRELOAD="$so" "$pathtracer" -q -r 32 32 --time 0.5s --write-every 0.1 -f "$tmp/clock.exr" "$scene" >/dev/null 2>"$tmp/err" ||
        why="status $?: $(cat "$tmp/err")"
    took=$(($(milliseconds) - start))
    [ $took -ge 500 ] || why="${why:-it ended after $took ms of 500}"
    [ -z "$why" ] && ! "$assay" reproduce "$tmp/clock.exr" >"$tmp/out" 2>&1 && why="other bits: $(cat "$tmp/out")"
    timeout --preserve-status -k 60 -s INT 2 env LD_PRELOAD="$so" "$pathtracer" -q -r 32 32 -s 16000000 -f "$tmp/clock.exr" "$scene" >/dev/null 2>&1
    [ $? -eq 130 ] || why="${why:-an interrupted render ended otherwise}"
    tell "clock jumps of an hour: --time, --write-every and Ctrl-C" "$why"
}

# A locale with a decimal comma: every file and table is the same. Control: the system's printf writes a comma in it.
comma() {
    local why="" at
    export LOCPATH=$tmp/locale
    mkdir -p "$LOCPATH"
    if ! localedef -i de_DE -f UTF-8 "$LOCPATH/de_DE.UTF-8" 2>"$tmp/err"; then
        unset LOCPATH
        echo "skip a decimal comma: $(head -n 1 "$tmp/err")"
        return
    fi
    [ "$(LC_ALL=de_DE.UTF-8 /usr/bin/printf %.1f 0,5)" = 0,5 ] || why="no comma in that country"
    for at in C de_DE.UTF-8; do
        mkdir -p "$tmp/comma/$at/right"
        (cd "$tmp/comma/$at" && export LC_ALL=$at
            "$pathtracer" -q -s 16 -r 32 32 --seed 1 -b 0.05 -d 2.5 --keep-state -f a.exr -f a.png "$scene" && "$pathtracer" -q -s 16 -r 32 32 --seed 2 -f b.exr "$scene"
            "$assay" export -o a.pov "$scene" && "$assay" compare --margin 0.01 a.exr b.exr
            "$pathtracer" -q -s 16 -m 1 -r 64 64 -f right/point.png "$root/reference/scenes/12_point_plane.dae"
            "$assay" grade -q -o grades "$root/tests/end_to_end/quick.rubric" right; cat grades/grades.csv
            "$assay" validate -q --only 12_point_plane -o suite | sed -E 's/[0-9.]+e\+0[0-9]( \[[^]]*\])?/TIMED/; s/  +/ /g') >"$tmp/comma/$at.out" 2>&1
    done
    unset LOCPATH
    for at in a.exr.state a.png a.pov; do cmp "$tmp/comma/C/$at" "$tmp/comma/de_DE.UTF-8/$at" >>"$tmp/comma/why" 2>&1 || why="${why:-$at: $(cat "$tmp/comma/why")}"; done
    grep -q 8.00,8, "$tmp/comma/C.out" || why="${why:-$(cat "$tmp/comma/C.out")}"
    tell "a decimal comma: the same files and tables" "${why:-$(diff "$tmp/comma/C.out" "$tmp/comma/de_DE.UTF-8.out")}"
}

# A right program, while grading lacks something: it gets all points, or no grade and exit 3 with a line; never fewer
# points. Control: a wrong program while nothing is lacking. With the sandbox, where there is one, and without.
ours_to_mend() {
    local mode n dir=$tmp/ours rubric=$tmp/ours/quick.rubric pid bare=--unsafe-no-sandbox
    chmod 711 "$tmp"
    mkdir -p "$dir/right" "$dir/wrong" "$dir/temp" "$dir/bin" "$dir/few"
    cp "$pathtracer" "$dir/right/ours" && cp "$assay" "$pathtracer" "$dir/few"
    printf 'pathtracer:\n\tcp ours pathtracer\n' >"$dir/right/Makefile"
    printf 'pathtracer:\n\tprintf "\043!/bin/sh\\nexit 1\\n" >pathtracer; chmod +x pathtracer\n' >"$dir/wrong/Makefile"
    sed 's/^command/build make\ncommand/' tests/end_to_end/quick.rubric >"$rubric"
    chmod -R a+rX "$dir"
    judge() { # NAME COMMAND...: as above; status 0 if it got to the points
        local name=$1 why="" status
        shift
        rm -rf "$dir/grades"
        LLVM_PROFILE_FILE=/dev/null "$@" >"$tmp/out" 2>"$tmp/err" </dev/null
        status=$?
        if [ $status -eq 0 ]; then grep -q " 8.00 of 8" "$tmp/out" || why="status 0: $(cat "$tmp/out")"
        elif [ $status -ne 3 ] || [ "$(wc -l <"$tmp/err")" -ne 1 ]; then why="status $status: $(head -c 600 "$tmp/out" "$tmp/err")"
        elif [ -e "$dir/grades/right/grade.json" ]; then why="it is kept: $(head -c 600 "$tmp/err")"; fi
        [ -z "$why" ] || tell "$name" "$why"
        return $status
    }
    for mode in "" $bare; do
        local grade=("$assay" grade -o "$dir/grades" $mode "$rubric" "$dir/right")
        if ! judge "nothing is missing${mode:+, $mode}" "${grade[@]}"; then
            grep -q "no sandbox" "$tmp/err" && echo "skip what is ours to mend: $(head -c 200 "$tmp/err")" && continue
            tell "nothing is missing${mode:+, $mode}" "$(cat "$tmp/err")"
        fi
        "$assay" grade -o "$dir/grades" $mode "$rubric" "$dir/wrong" >"$tmp/out" 2>&1
        grep -q " 0.00 of 8" "$tmp/out" || tell "a wrong program${mode:+, $mode}" "$(cat "$tmp/out")"
        n=0
        if [ "$(id -u)" = 0 ] && mount -t tmpfs -o size=1m none "$dir/temp" 2>/dev/null; then
            for size in 1 3 5 7 9 11 13; do
                mount -o remount,size=${size}m "$dir/temp"
                TMPDIR=$dir/temp judge "TMPDIR of $size MB${mode:+, $mode}" "${grade[@]}" && n=$((n + 1))
            done
            umount "$dir/temp"
            tell "TMPDIR of 1 to 13 MB takes no points${mode:+, $mode}" "$([ $n -lt 7 ] || echo 'there was room every time')"
        else echo "skip TMPDIR of 1 to 13 MB: cannot mount one"; fi
        # Only with the sandbox: without it there is no supervisor to kill, and a killed program may have killed itself.
        for k in $([ -n "$mode" ] || echo 1 2 3 4 5 6); do
            "${grade[@]}" >/dev/null 2>&1 &
            pid=$! && sleep 0.$k
            while kill -0 $pid 2>/dev/null; do
                pkill -KILL -P $pid 2>/dev/null
                sleep 0.3
            done
            wait $pid
            n=$?
            [ $n -eq 3 ] || { [ $n -eq 0 ] && grep -q ',8.00,' "$dir/grades/grades.csv"; } ||
                tell "a killed supervisor${mode:+, $mode}" "status $n: $(cat "$dir/grades/grades.csv")"
            rm -rf "$dir/grades"
        done
        [ -n "$mode" ] || tell "6 killed supervisors take no points" ""
        for k in 8 12 16 20 24 32; do
            judge "$k descriptors${mode:+, $mode}" bash -c 'ulimit -n '$k'; exec "$@"' bash "${grade[@]}"
        done
        tell "8 to 32 descriptors take no points${mode:+, $mode}" ""
        sed 's/^build make/build no-such-tool/' "$rubric" >"$dir/tool.rubric"
        judge "the build's tool is missing" "$assay" grade -o "$dir/grades" $mode "$dir/tool.rubric" "$dir/right"
        tell "a missing tool of the build takes no points${mode:+, $mode}" "$([ $? -eq 3 ] && grep -q no-such-tool "$tmp/err" || cat "$tmp/err")"
        judge "oiio.so is missing" "$dir/few/assay" grade -o "$dir/grades" $mode "$rubric" "$dir/right"
        tell "a missing oiio.so takes no points${mode:+, $mode}" "$([ $? -eq 3 ] && grep -q oiio.so "$tmp/err" || cat "$tmp/err")"
    done
}

for part in "$@"; do
    hits=0
    $part
done
[ $failures -eq 0 ]
