#!/bin/bash
# tests/end_to_end/peers.sh: loads each scene of tools/rubrics/ in each of the course's programs
# $PEERS/*/build/pathtracer, which have to write an image within a time limit. Prints "ok NAME", "not ok NAME: why" or
# "skip NAME: why".
set -u
shopt -s nullglob
programs=()
for p in ${PEERS:+"$PEERS"/*/build/pathtracer}; do [ -x "$p" ] && programs+=("$(realpath "$p")"); done
if [ ${#programs[@]} -eq 0 ]; then
    echo "skip peers: no program of the course in PEERS=${PEERS:-}: no scene of the rubrics was loaded by one"
    exit 0
fi
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
seconds=30
for p in "${programs[@]}"; do
    home=$(dirname "$(dirname "$p")")
    wrong=
    for scene in "$PWD"/tools/rubrics/*.dae; do
        name=$(basename "$scene" .dae)
        # Its triangles have one centre, on which not every program's hierarchy ends: that is what it tests
        # (course-skeleton.md).
        [ "$name" = stack ] && continue
        rm -f "$tmp/out.png"
        # A library that staff prebuilt, where the course gives one.
        (cd "$tmp" && LD_LIBRARY_PATH=$home/libs/x64_linux timeout $seconds "$p" -t 1 -s 1 -l 1 -m 1 -r 64 48 -f out.png "$scene") >"$tmp/log" 2>&1
        status=$?
        [ "$(head -c 4 "$tmp/out.png" 2>/dev/null | tail -c 3)" = PNG ] ||
            wrong+="$name: status $status, $(tail -c 100 "$tmp/log" | tr '\r\n' '  '); "
    done
    if [ -z "$wrong" ]; then echo "ok peers: $(basename "$home") loads every scene"; else echo "not ok peers: $(basename "$home"): $wrong"; fi
done
# Control: a scene that the starter code cannot read does not count as loaded.
sed 's/<geometry id="floor-mesh" name="floor">/<geometry id="floor-mesh">/' tools/rubrics/matt.dae >"$tmp/nameless.dae"
{ (cd "$tmp" && timeout $seconds "${programs[0]}" -t 1 -s 1 -r 64 48 -f nameless.png nameless.dae) >/dev/null; } 2>/dev/null # hides the shell's message of a crash
if [ -e "$tmp/nameless.png" ]; then echo "not ok peers: a geometry without a name was loaded"; else echo "ok peers: a geometry without a name is not loaded"; fi
