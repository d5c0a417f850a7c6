#!/bin/bash
# tests/end_to_end/source.sh BUILD: submissions of sources, which are built in the sandbox: whatever goes wrong is
# reported once, in grade.json's "state" and "wrong", and by the exit status 2. Each student's program writes the
# furnace's closed form (reference/scenes/10_furnace_one.md) or fails in its own way. Prints "ok NAME", "not ok NAME:
# why" or "skip NAME: why".
set -u
build=$(realpath "${1:?usage: tests/end_to_end/source.sh BUILD}")
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0
what=source
. tests/end_to_end/expect.sh

mkdir "$tmp/class" "$tmp/tree"
image() { printf 'image %s\n scene %s\n size 64 64\n spp %s\n bounces 1\n reference %s\n' "$@"; }
check() { printf 'check %s 2 equal %s\n image 0.001 0.01\n tile 0.001 0.01\n' "$1" "$1"; }
rubric() { # PROGRAM BUILD...: images a and b of one scene, c of another
    echo "rubric Sources"
    echo 'command {program} -s {spp} -f {out} {scene}'
    echo "output out.pfm"
    echo "program $1"
    printf 'build %s\n' "${@:2}"
    printf 'limit %s\n' "wall 4" "disk 64" "build 120" "build-memory 300"
    image a 10_furnace_one 16 truth
    image b 10_furnace_one 64 truth
    image c 12_point_plane 16 "ours 16"
    echo part 1 Light
    for i in a b c; do check $i; done
}
rubric tiny 'make' >"$tmp/make.rubric"
rubric build/tiny 'cmake -S . -B build' 'make -C build' >"$tmp/cmake.rubric"

# A program with a library of its own. TINY: what goes wrong at its start.
cat >"$tmp/tree/tiny.c" <<'END'
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
float level(int channel);
int main(int argc, char **argv)
{
    TINY
    FILE *f = fopen("out.pfm", "wb");
    fprintf(f, "PF\n64 64\n-1.0\n");
    for (int i = 0; i < 64 * 64 * 3; i++) {
        float v = level(i % 3);
        fwrite(&v, sizeof v, 1, f);
    }
    return fclose(f) != 0 || argc < 2 || argv[0] == NULL;
}
END
cat >"$tmp/tree/level.c" <<'END'
float level(int channel)
{
    static const float light[] = {1.2f * 1.3f, 0.8f * 1.6f, 0.4f * 1.9f};
    return light[channel];
}
END
cat >"$tmp/tree/Makefile" <<'END'
TINY = (void)0;
tiny: tiny.o liblevel.so
	$(CC) -o $@ tiny.o -L. -llevel -Wl,-rpath,'$$ORIGIN'
	$(AFTER)
tiny.o: tiny.c
	$(CC) '-DTINY=$(TINY)' -c tiny.c
liblevel.so: level.c
	$(CC) -shared -fPIC -o $@ level.c
END
cat >"$tmp/tree/CMakeLists.txt" <<'END'
cmake_minimum_required(VERSION 3.8)
project(tiny C)
add_library(level SHARED level.c)
add_executable(tiny tiny.c)
target_compile_definitions(tiny PRIVATE "TINY=")
target_link_libraries(tiny level)
END
student() { # NAME [LINE OF ITS MAKEFILE]
    cp -R "$tmp/tree" "$tmp/class/$1"
    [ -z "${2:-}" ] || echo "$2" >>"$tmp/class/$1/Makefile"
}
student right
student not_c && echo 'int x = ;' >>"$tmp/class/not_c/tiny.c"
student usage 'TINY = fprintf(stderr, "tiny: invalid option\nUsage: tiny [options]\n"); return 1;'
student crash 'TINY = abort();'
student no_return $'TINY = abort();\nCC = cc -Wreturn-type' && echo 'int value(void) { }' >>"$tmp/class/no_return/tiny.c"
student crashes_once $'TINY = if (strstr(argv[argc - 1], "furnace")) abort();\nCC = cc -Wreturn-type' && cp "$tmp/class/no_return/tiny.c" "$tmp/class/crashes_once"
student hang $'TINY = pause();\nCC = cc -Wreturn-type' && cp "$tmp/class/no_return/tiny.c" "$tmp/class/hang"
student hangs_once 'TINY = if (strstr(argv[argc - 1], "furnace")) pause();'
student late 'TINY = atexit(abort);'
student lost 'AFTER = rm liblevel.so'
student moved 'AFTER = mkdir lib && mv liblevel.so lib'
student other 'AFTER = mv tiny other'
student hog 'AFTER = for i in 1 2 3 4; do (head -c 100M /dev/zero; sleep 20) | tail -n 1 >/dev/null & done; wait'
student network 'AFTER = ! grep -v lo: /proc/net/dev | grep :' # lo alone
student writes 'AFTER = ! (: >$$CCACHE_DIR/x) && ! (: >/cache/x)'
mkdir "$tmp/class/readme" && echo later >"$tmp/class/readme/README"
mkdir "$tmp/class/empty" "$tmp/class/two" && cp -R "$tmp/tree" "$tmp/class/two/a" && cp -R "$tmp/tree" "$tmp/class/two/b"
# As it comes from a Mac: in a folder, with what another machine built.
mkdir -p "$tmp/mac/My Homework/build/CMakeFiles" "$tmp/mac/__MACOSX" "$tmp/bomb"
cp "$tmp/tree"/* "$tmp/mac/My Homework" && : >"$tmp/mac/__MACOSX/._tiny.c"
echo 'CMAKE_HOME_DIRECTORY:INTERNAL=/Users/ada/hw' >"$tmp/mac/My Homework/build/CMakeCache.txt"
printf '\xcf\xfa\xed\xfe' >"$tmp/mac/My Homework/build/tiny"
touch -d '+9 hours' "$tmp/mac/My Homework/build/tiny" "$tmp/mac/My Homework/tiny.c"
(cd "$tmp/mac" && zip -qr "$tmp/zipped.zip" .) && tar -C "$tmp/mac" -czf "$tmp/packed.tar.gz" . && mkdir "$tmp/inside" && cp "$tmp/zipped.zip" "$tmp/inside"
head -c 200M /dev/zero >"$tmp/bomb/zeros" && (cd "$tmp/bomb" && zip -q "$tmp/class/bomb.zip" zeros)
head -c 1000 "$tmp/zipped.zip" >"$tmp/class/short.zip"
echo text >"$tmp/class/plain.tar.gz"
printf 'Rar!\x1a\x07\x01' >"$tmp/class/rar.rar"

grade() { "$build/assay" grade -j 2 -o "$tmp/$1" "${@:2}"; }
field() { sed -n "s/^ \"$3\": \(.*[^,]\),\{0,1\}$/\1/p" "$tmp/$1/$2/grade.json" | tr -d '"'; }
said() { # OUT ID STATE PATTERN: of the whole; and no check has a reason of its own
    local state wrong
    state=$(field "$1" "$2" state) wrong=$(field "$1" "$2" wrong)
    tell "$2: $3${4:+, $4}" "$([ "$state" = "$3" ] && grep -q -- "$4" <<<"$wrong" &&
        { [ "$4" = null ] || ! grep '"seen"' "$tmp/$1/$2/grade.json" | grep -vq 'see what is said of all of it'; } || echo "$state: $wrong $(grep '"seen"' "$tmp/$1/$2/grade.json")")"
}
points() { tell "$2: $3 points" "$([ "$(field "$1" "$2" points)" = "$3" ] || echo "$(field "$1" "$2" points); $(grep '"seen"' "$tmp/$1/$2/grade.json")")"; }

if ! grade probe "$tmp/make.rubric" "$tmp/class/right" >"$tmp/out" 2>&1 && grep -q "no sandbox" "$tmp/out"; then
    echo "skip source: submissions of sources ($(cat "$tmp/out"))"
    exit 0
fi
# Image c is of another scene, which none of these programs renders right.
expect "a right program needs nobody" 0 "4.00 of 6" grade right "$tmp/make.rubric" "$tmp/class/right"
said right right graded null
points right right 4.0
find "$tmp/right/.runs" -name run.json | sort >"$tmp/runs" && touch "$tmp/then"
sed 's/tile 0.001 0.01/tile 0.002 0.01/' "$tmp/make.rubric" >"$tmp/other.rubric"
expect "by other margins" 0 "4.00 of 6" grade right "$tmp/other.rubric" "$tmp/class/right"
tell "it is neither built nor run again" "$([ "$(wc -l <"$tmp/runs")" -ge 4 ] || cat "$tmp/runs"; find "$tmp/right/.runs" -name run.json -newer "$tmp/then")"
sed 's/^build make/& MORE=1/' "$tmp/make.rubric" >"$tmp/other.rubric"
expect "by another build" 0 "4.00 of 6" grade right "$tmp/other.rubric" "$tmp/class/right"
tell "it is (control)" "$([ "$(find "$tmp/right/.runs" -name run.json -newer "$tmp/then" | wc -l)" = "$(wc -l <"$tmp/runs")" ] || echo it is not)"
expect "what goes wrong is staff's to look at" 2 "the shared library" grade make "$tmp/make.rubric" "$tmp/class"/*
said make not_c not_built 'It does not build: tiny.c:[0-9:]* error: expected expression'
said make usage usage 'It prints its usage text for every image: tiny: invalid option'
said make crash not_started 'No run of it made an image: the program: killed by signal 6'
said make no_return not_started 'killed by signal 6.*; its build warned: tiny.c:.* non-void function'
said make lost not_started 'It does not start: the shared library liblevel.so is missing'
said make other not_started 'It does not start: building it made no tiny, but other'
said make hog not_built 'It does not build: .*300 MiB of memory'
said make empty not_built 'It does not build: there is no file in it'
said make readme not_built 'It does not build: there is no Makefile in it'
said make two not_built 'It does not build: more than one folder holds a .*akefile: a b'
said make bomb not_built 'It does not build: all 64 MiB of its directory are full'
said make short not_built 'It does not build: short.zip cannot be unpacked: it is damaged, or no zip archive'
said make plain not_built 'It does not build: plain.tar.gz cannot be unpacked: .*does not look like a tar archive'
said make rar not_built 'It does not build: rar.rar cannot be unpacked: such archives are not read here, but .zip'
for name in moved network writes; do said make $name graded null && points make $name 4.0; done
said make hangs_once graded null
said make late graded null && points make late 4.0
tell "a program that fails when it has written its image is told so" "$(grep -q "after the program had written 'a' it failed (killed by signal 6" "$tmp/make/late/grade.json" || echo it is not)"
said make crashes_once graded null
tell "a crash beside images is told what the build warned of" "$(grep -q "killed by signal 6 (Aborted); its build warned: tiny.c:.* non-void function" "$tmp/make/crashes_once/grade.json" || grep '"seen"' "$tmp/make/crashes_once/grade.json")"
points make hangs_once 0.0
tell "the same scene is not run again" "$(grep -q "not run, as the program did not end on this scene before (image 'a')" "$tmp/make/hangs_once/grade.json" || echo it is)"
tell "another scene is" "$(grep -q '"file": "c.pfm"' "$tmp/make/hangs_once/grade.json" || echo it is not)"
tell "hang: no image" "$(field make hang wrong | grep -q "No run of it made an image" || field make hang wrong)"
tell "hang: what its build warned of" "$(field make hang wrong | grep -q "; its build warned: tiny.c:.* non-void function" || field make hang wrong)"
tell "the class page says what is wrong" "$(grep -q 'the shared library liblevel.so is missing' "$tmp/make/index.html" || echo it does not)"
tell "a build's log is kept" "$(grep -q 'expected expression' "$tmp/make/not_c/$(field make not_c build_log)" || echo it is not)"
expect "archives" 0 "4.00 of 6" grade cmake "$tmp/cmake.rubric" "$tmp/zipped.zip" "$tmp/packed.tar.gz" "$tmp/inside" "$tmp/class/right"
for name in zipped packed inside right; do points cmake $name 4.0; done
# CMake says over several lines what is wrong; a submodule that was not handed in is an empty folder.
cp -R "$tmp/tree" "$tmp/submodule" && mkdir "$tmp/submodule/CGL" && echo 'add_subdirectory(CGL)' >>"$tmp/submodule/CMakeLists.txt"
expect "a submodule is missing" 2 "does not build" grade cmake "$tmp/cmake.rubric" "$tmp/submodule"
said cmake submodule not_built 'add_subdirectory): The source directory /box/CGL does not contain a CMakeLists.txt file.$'

# Programs handed in without sources are not built.
cp -R "$tmp/tree" "$tmp/made" && make -sC "$tmp/made" && mkdir "$tmp/built" && cp "$tmp/made"/{tiny,liblevel.so} "$tmp/built"
(cd "$tmp/built" && zip -q "$tmp/prebuilt.zip" tiny liblevel.so)
expect "programs" 0 "4.00 of 6" grade programs "$tmp/cmake.rubric" "$tmp/built" "$tmp/prebuilt.zip"
for name in built prebuilt; do points programs $name 4.0; done
# As a web form stores them: without their mode, as Windows ends lines, an archive without the ending of its name.
mkdir "$tmp/unmarked" "$tmp/unmarked/windows" && cp -R "$tmp/built" "$tmp/unmarked/lost" && chmod a-x "$tmp/unmarked/lost/tiny"
printf '#!/bin/sh\r\n./x\r\n' >"$tmp/unmarked/windows/tiny" && cp "$tmp/zipped.zip" "$tmp/unmarked/bare"
cp "$tmp/made/tiny" "$tmp/unmarked/alone" && chmod a-x "$tmp/unmarked/alone"
expect "programs that were not executable" 2 "4.00 of 6" grade modes "$tmp/cmake.rubric" "$tmp/unmarked"/*
points modes lost 4.0
said modes alone not_started 'It does not start: the shared library liblevel.so is missing'
said modes windows not_started 'It does not start: the first line of tiny ends as on Windows'
said modes bare not_started 'It does not start: bare is an archive: it is unpacked if its name ends in .zip'

# The compiler cache: filled by staff only, from the starter code.
if command -v ccache >/dev/null; then
    cache() { find "$tmp/cache" -type f -name '*[RM]' | sort | xargs sha256sum; }
    expect "a cache that was never filled" 3 "cache: No such file or directory; --fill-build-cache makes it" grade cached --build-cache "$tmp/cache" "$tmp/make.rubric" "$tmp/class/right"
    expect "the cache is filled" 0 "filled by building" "$build/assay" grade --fill-build-cache --build-cache "$tmp/cache" "$tmp/make.rubric" "$tmp/tree"
    cache >"$tmp/before"
    expect "and used" 0 "4.00 of 6" grade cached --build-cache "$tmp/cache" "$tmp/make.rubric" "$tmp/class/right" "$tmp/class/writes"
    tell "and not written" "$([ -s "$tmp/before" ] || echo it was not filled; cache | cmp - "$tmp/before" 2>&1)"
    points cached writes 4.0
    sed 's/^build make/build make CC=gcc PATH=\/usr\/bin/' "$tmp/make.rubric" >"$tmp/around.rubric"
    expect "a build that goes around it" 3 "left nothing in the cache" "$build/assay" grade --fill-build-cache --build-cache "$tmp/cache2" "$tmp/around.rubric" "$tmp/tree"
    expect "a starter code that does not build" 3 "expected expression" "$build/assay" grade --fill-build-cache --build-cache "$tmp/cache2" "$tmp/make.rubric" "$tmp/class/not_c"
else
    echo "skip source: the compiler cache: no ccache here"
fi
[ $failures -eq 0 ]
