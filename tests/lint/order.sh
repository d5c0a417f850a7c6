#!/bin/bash
# tests/lint/order.sh BUILD: the order of folders, by the sources here and their objects in BUILD. A file uses only its
# own folder and those before it, in what it includes and in the symbols that it links; no cycle between files; at most
# 25 C files in a folder; no file name twice; public functions begin with a word of their file's or folder's name or of
# a type's. Planted faults have to be found first.
set -euo pipefail
build=$(realpath "${1:?usage: tests/lint/order.sh BUILD}")
# The folders in their order, from the first column of the READMEs' tables.
folders=$(for top in renderer reference tools; do
    sed -nE 's/^\| (`[^|]*`) \|.*/\1/p' $top/README.md | tr -d '`,' | tr ' ' '\n' | sed "s,^,$top/,"
done)

# "FROM TO" of what the files on stdin include; within a folder TO has none.
includes() {
    xargs grep -HoE '^ *# *include "[^"]*"' | sed -E 's/: *# *include "/ /; s/"$//; s,^(.*/)([^/ ]*) ([^/]*)$,\1\2 \1\3,'
}

# "FILE SYMBOL TYPE" of the .c files on stdin; one that is compiled for several instruction sets has as many objects.
symbols() {
    sed -E 's,(.*)\.c$,\1.c.o \1_sse42.c.o \1_avx2.c.o \1_avx512.c.o \1_scalar.c.o,' | (cd "$1" && xargs -n 5 ls 2>/dev/null | xargs nm -AgP) |
        sed -E 's,(_(sse42|avx2|avx512|scalar))?\.c\.o: ,.c ,'
}

# "FROM TO" for each file that needs another's symbol, from symbols() on stdin.
links() {
    awk '$3 == "U" { users[$2] = users[$2] " " $1 } $3 ~ /[A-T]/ { home[$2] = $1 }
         END { for (s in users) if (s in home) { n = split(users[s], f); for (i = 1; i <= n; i++) if (f[i] != home[s]) print f[i], home[s] } }' |
        sort -u
}

# against_order VERB: prints the pairs "FROM TO" on stdin that violate the order, as "FROM VERB TO".
against_order() {
    awk -v verb="$1" -v folders="$folders" 'function folder(file) { sub("/[^/]*$", "", file); return file }
        BEGIN { n = split(folders, list); for (i = 1; i <= n; i++) rank[list[i]] = i }
        { to = rank[folder($2)] } !to || to > rank[folder($1)] { print $1, verb, $2 }'
}

# Functions among the symbols on stdin that begin neither with a word of their path nor with one that begins a type's name.
strangers() {
    awk -v types="$(grep -ohE '^ *(typedef )?(struct|enum|union) [a-z0-9]+' $ours | sed 's/.* //' | sort -u | tr '\n' ' ')" '
        BEGIN { split(types, t); for (i in t) is_type[t[i]] = 1 }
        $3 == "T" && $2 != "main" {
            path = $1; gsub("[/.]", "_", path)
            word = $2; sub("_.*", "", word)
            if (!is_type[word] && path !~ ("_" word "_")) print $1 ": " $2 "() begins with no word of its path or of a type"
        }'
}

# faults BUILD: a line for each fault of the tree here, and in $tmp/count what was looked at.
faults() {
    local all ours
    all=$(find renderer reference tools tests -name '*.[ch]' -o -name '*.cc' | sort)
    ours=$(grep -v '^tests/' <<<"$all")
    sed 's,/[^/]*$,,' <<<"$ours" | sort -u | grep -vxF "$folders" | sed 's/$/ is in no README/' || :
    includes <<<"$ours" >"$tmp/includes"
    against_order includes <"$tmp/includes"
    grep '\.c$' <<<"$ours" | symbols "$1" | sort -u >"$tmp/symbols"
    links <"$tmp/symbols" >"$tmp/links"
    against_order 'needs a symbol of' <"$tmp/links"
    tsort <"$tmp/links" 2>&1 >/dev/null | sed 's/^tsort: -: .*/a circle:/; s/^tsort: /  /' || :
    sed 's,/[^/]*$,,' <<<"$all" | uniq -c | awk '$1 > 25 { print $2 " has " $1 " C files" }'
    sed 's,.*/,,' <<<"$all" | sort | uniq -d | sed 's/$/ is the name of two files/'
    strangers <"$tmp/symbols"
    echo "$(sed 's,/[^/]*$,,' <<<"$ours" | sort -u | wc -l) folders, $(wc -l <<<"$all") files, $(wc -l <"$tmp/includes") includes, $(wc -l <"$tmp/links") links" >"$tmp/count"
}

# A tree with a fault of each kind.
plant() {
    mkdir -p renderer/base renderer/new reference tools/base tests/many
    echo '#include "tools/base/high.h"' >renderer/base/low.h
    echo 'int high_one(void); int low_one(void); int low_one(void) { return high_one(); }' >renderer/base/low.c
    echo 'int twin_one(void); int high_one(void); int high_one(void) { return twin_one(); }' >tools/base/high.c
    echo 'int twin_one(void); int high_one(void); int twin_one(void) { return high_one(); } int stray_one(void) { return 1; }' >tools/base/twin.c
    touch tools/base/high.h renderer/new/other.h tests/many/twin.c tests/many/{a..y}.h
    for f in renderer/base/low tools/base/high tools/base/twin; do "${CC:-cc}" -c -o $f.c.o $f.c; done
}
planted="renderer/new is in no README
renderer/base/low.h includes tools/base/high.h
renderer/base/low.c needs a symbol of tools/base/high.c
a circle:
  tools/base/high.c
  tools/base/twin.c
tests/many has 26 C files
twin.c is the name of two files
tools/base/twin.c: stray_one() begins with no word of its path or of a type"

tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
seen=$(mkdir "$tmp/planted" && cd "$tmp/planted" && plant && faults .)
[ "$seen" = "$planted" ] || { echo "error: of the planted faults only these are seen: $seen"; exit 1; }
found=$(faults "$build")
[ -z "$found" ] || { sed 's/^/error: /' <<<"$found"; exit 1; }
echo "order: $(cat "$tmp/count"), no finding; 7 planted faults seen"
