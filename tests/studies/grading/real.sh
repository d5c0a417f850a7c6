#!/bin/bash
# tests/studies/grading/real.sh PEERS OUT [NAME...]: makes the programs of real_programs.txt of the submissions under PEERS (as they came,
# built or not; nothing there is changed), grades them by their rubrics, and writes OUT/table.md. NAME: a program, a pair
# (A+B), a shell pattern; none: all. What is there already is not done again. --table in place of names: the table alone.
# ASSAY: the program that grades (build/assay).
set -u
here=tests/studies/grading
if [ $# -lt 2 ]; then sed -n 2,5p "$0" >&2; exit 3; fi
mkdir -p "$2"
peers=$(realpath "$1") out=$(realpath "$2")
shift 2
assay=${ASSAY:-build/assay}
table=$here/real_programs.txt
if ! command -v cmake >/dev/null || ! perl -MJSON::PP -e 1 2>/dev/null; then echo "real.sh: needs cmake and Perl" >&2; exit 3; fi

edits() { awk -v name="$1" '/^[^ #]/ { on = $2 == name } /^  / && on' "$table"; }
field() { awk -v name="$1" -v k="$2" '/^(base|right|bug|held) / && $2 == name { print $k; exit }' "$table"; }

# apply TREE NAME: the edits of a program; the file as it was is kept beside it
apply() {
    local file edit
    while read -r file edit; do
        [ -e "$1/$file.kept" ] || cp -p "$1/$file" "$1/$file.kept"
        cp "$1/$file" "$1/before"
        if ! perl -0777 -pi -e "$edit" "$1/$file" || cmp -s "$1/$file" "$1/before"; then
            echo "$2: changes nothing: $file $edit" >&2
            return 1
        fi
    done < <(edits "$2")
}
undo() { find "$1" -name '*.kept' | while read -r kept; do mv "$kept" "${kept%.kept}" && touch "${kept%.kept}"; done; }

# tree SUBMISSION: a copy of it, mended and built
tree() {
    local tree=$out/trees/$1
    # Not a copy of another OUT: it would be built there.
    [ -e "$tree/mended" ] && grep -qx "CMAKE_HOME_DIRECTORY:INTERNAL=$tree" "$tree/build/CMakeCache.txt" && { undo "$tree"; return 0; }
    rm -rf "$tree" && mkdir -p "$tree/build" && tar -C "$peers/$1" --exclude=./build -cf - . | tar -C "$tree" -xf - && apply "$tree" "$1" || return 1
    find "$tree" -name '*.kept' -delete
    if ! (cd "$tree/build" && cmake -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache "-DCMAKE_BUILD_RPATH=\$ORIGIN" .. && make) \
        >"$tree.log" 2>&1; then
        echo "$1 does not build: see $tree.log" >&2
        return 1
    fi
    cp "$tree/build/pathtracer" "$tree/mended"
}

# program NAME SUBMISSION PART...: OUT/programs/NAME, of the edits of PART...
program() {
    local name=$1 base=$2 to=$out/programs/$1 part ok=1
    shift 2
    for part in "$base" "$@"; do edits "$part"; done >"$out/edits.$$"
    cmp -s "$out/edits.$$" "$out/edits/$name" && rm "$out/edits.$$" && return 0
    tree "$base" || return 1
    for part; do apply "$out/trees/$base" "$part" || ok=; done
    if [ -n "$ok" ] && ! make -C "$out/trees/$base/build" </dev/null >"$out/trees/$base.log" 2>&1; then
        ok=
        echo "$name does not build: see $out/trees/$base.log" >&2
    elif [ -n "$ok" ] && [ -n "$(edits "$1")" ] && cmp -s "$out/trees/$base/build/pathtracer" "$out/trees/$base/mended"; then
        ok=
        echo "$name is the same program as without its edits" >&2
    fi
    [ -n "$ok" ] && mkdir -p "$to" "$out/edits" && cp "$out/trees/$base/build/pathtracer" "$to" && { [ ! -e "$out/trees/$base/libs/x64_linux/libpt31.so" ] || cp "$out/trees/$base/libs/x64_linux/libpt31.so" "$to"; } && strip "$to/pathtracer" && mv "$out/edits.$$" "$out/edits/$name"
    undo "$out/trees/$base"
    [ -n "$ok" ]
}

one() { # NAME SUBMISSION PART...
    program "$@" || return 1
    local started=$SECONDS
    "$assay" grade -q -o "$out/grades" --references "${REFERENCES:-$out/references}" "tools/rubrics/$(field "$2" 3)" "$out/programs/$1" </dev/null >"$out/log.$1" 2>&1
    case $? in
    0 | 2) rm -f "$out/log.$1" ;;
    *) echo "$1: $(head -1 "$out/log.$1")" >&2 && return 1 ;;
    esac
    echo "$(date +%T) $1 $((SECONDS - started)) s" >&2
}

if [ "${1:-}" != --table ]; then
    [ $# -gt 0 ] || set -- '*'
    while read -r kind a b rest; do
        for only; do
            # shellcheck disable=SC2254 # a pattern
            case $kind in
            right | bug | held) case $a in $only) one "$a" "$b" "$a"; break ;; esac ;;
            pair | drawn) case $a+$b in $only) one "$a+$b" "$(field "$a" 3)" "$a" "$b"; break ;; esac ;;
            esac
        done
    done <"$table"
fi
perl "$here/real_table.pl" "$table" "$out/grades" >"$out/table.md.$$"
status=$?
mv "$out/table.md.$$" "$out/table.md"
exit $status
