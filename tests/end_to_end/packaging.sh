#!/bin/bash
# tests/end_to_end/packaging.sh BUILD: manual pages and completions say what --help says; what Debian packages hold runs
# outside any checkout. Prints "ok NAME", "not ok NAME: why" or "skip NAME". `make distros` installs the packages in
# fresh root directories.
set -u
build=$(realpath "${1:?usage: tests/end_to_end/packaging.sh BUILD}")
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0 what=packaging
. tests/end_to_end/expect.sh

tools/packaging/manual.sh "$build" "$tmp/manual" >"$tmp/log" 2>&1
tell "manual pages and completions are made" "$(cat "$tmp/log")"
verbs=$("$build/assay" --help | sed -nE 's/^  ([a-z-]+) .*/\1/p')
long_options() { grep -oE '^ {2,6}(-., )?--[a-z][a-z0-9-]*' | sed 's/.*--/--/' | sort -u; }
tell "each option of $(wc -l <<<"$verbs") verbs is on its page and is completed" "$(for verb in $verbs; do
    "$build/assay" "$verb" --help | long_options >"$tmp/options"
    sed -n 's/\\-/-/g; s/^\.B .*\(--[a-z0-9-]*\).*/\1/p' "$tmp/manual/man1/assay-$verb.1" | sort -u | diff "$tmp/options" - >/dev/null || echo "$verb: page"
    bash -c '. "$1"; COMP_WORDS=(assay "$2" --) COMP_CWORD=2; _assay; printf "%s\n" "${COMPREPLY[@]}"' - "$tmp/manual/bash-completion/assay" "$verb" |
        sed '/^$/d' | sort -u | diff "$tmp/options" - >/dev/null || echo "$verb: completion"
done)"
tell "control: a page without an option is seen" "$(sed '/margin/d' "$tmp/manual/man1/assay-compare.1" | sed -n 's/\\-/-/g; s/^\.B .*\(--[a-z0-9-]*\).*/\1/p' | sort -u |
    diff <("$build/assay" compare --help | long_options) - >/dev/null && echo "it is not")"
tell "a verb is completed" "$(bash -c '. "$1"; COMP_WORDS=(assay va) COMP_CWORD=1; _assay; echo "${COMPREPLY[*]}"' - "$tmp/manual/bash-completion/assay" | grep -v '^validate$')"
if command -v groff >/dev/null; then
    tell "groff finds nothing wrong with the pages" "$(groff -man -ww -Tutf8 "$tmp"/manual/man1/*.1 renderer/pathtracer/pathtracer.1 2>&1 >/dev/null | head -n 5)"
else
    echo "skip packaging: no groff"
fi
tell "the kernels of sixteen lanes compile with clang, and with flags of the user's own" "$(make BUILD="$tmp/other" CC=clang CFLAGS=-O1 \
    "$tmp"/other/renderer/{transport/integrator_simd_avx512,base/version}.c.o >"$tmp/log" 2>&1 || tail -n 3 "$tmp/log")"
expect "did you mean" 3 "did you mean validate?" "$build/assay" valdiate

# Each step of the workflow, in a repository laid out as it expects, whose renderer is right at first and then wrong.
mkdir "$tmp/repository" "$tmp/bin"
ln -s "$PWD" "$tmp/repository/assay"
printf '#!/bin/sh\n' | tee "$tmp/repository/build.sh" >"$tmp/bin/apt-get" # installs nothing here
chmod +x "$tmp/repository/build.sh" "$tmp/bin/apt-get"
cp reference/engines/mine.json "$tmp/repository"
workflow() { # its commands, one by one, to the last; what fails is told
    sed -n 's/^ *run: //p' tools/packaging/github-workflow.yml | while IFS= read -r line; do
        (cd "$tmp/repository" && PATH=$tmp/bin:$(dirname "$build/pathtracer"):$PATH bash -ec "$line" </dev/null) >"$tmp/step.out" 2>&1 ||
            echo "$line: status $?: $(tail -n 2 "$tmp/step.out" | tr '\n' ' ')"
        cat "$tmp/step.out" >>"$tmp/workflow.out"
    done
}
sed "s,^PATH=.*,PATH=$build:\$PATH," reference/engines/mine.sh >"$tmp/repository/mine.sh"
chmod +x "$tmp/repository/mine.sh"
tell "the workflow is green where the renderer is right" "$(workflow)"
sed -i 's/-m "$5"/-m 0/' "$tmp/repository/mine.sh" # it leaves out all light that was reflected
rm "$tmp/workflow.out"
tell "control: red, with an annotation, where it is wrong" "$(workflow | grep -q '^assay/build/assay validate.*status 1: .*' &&
    grep -q '^::error.*12_point_plane' "$tmp/workflow.out" || echo "it is not: $(tail -n 3 "$tmp/workflow.out")")"

if ! command -v dpkg-shlibdeps >/dev/null; then
    echo "skip packaging: Debian packages (no dpkg-dev)"
    exit $((failures > 0))
fi
DPKG_DEB_COMPRESSOR_TYPE=gzip DPKG_DEB_COMPRESSOR_LEVEL=1 tools/packaging/deb.sh "$build" 0.1 "$tmp/deb" >"$tmp/log" 2>&1
tell "four Debian packages" "$([ "$(ls "$tmp/deb" | wc -l)" -eq 4 ] || tail -n 3 "$tmp/log")"
for package in "$tmp"/deb/*.deb; do dpkg-deb -x "$package" "$tmp/root"; done
tell "they depend on libraries" "$(for p in assay libassay1; do dpkg-deb -f "$tmp/deb/${p}"_*.deb Depends | grep -q 'libc6 (>= .*libgsl' || echo "$p"; done)"
# Outside any checkout: scenes and references are found beside the program, and the library finds what reads PNG.
library=$(dirname "$(find "$tmp/root/usr/lib" -name 'libassay.so.1')")
expect "what they hold judges a scene" 0 "^result: all as it should be" \
    env -C "$tmp" LD_LIBRARY_PATH="$library" root/usr/bin/assay validate --only 12_point_plane --out report
if /usr/bin/python3 -c 'import numpy' 2>/dev/null; then
    "$build/pathtracer" -q -r 32 32 -s 4 -m 1 -f "$tmp/a.png" reference/scenes/13_square_patch.dae >/dev/null
    expect "the library among them reads a PNG" 0 "^DIFFERENT" env -C "$tmp" LD_LIBRARY_PATH="$library" \
        PYTHONPATH="$tmp/root/usr/lib/python3/dist-packages" /usr/bin/python3 -B -c "
import assay, numpy
print(assay.compare('a.png', numpy.random.default_rng(1).random((32, 32, 3)), curve='srgb').verdict)"
fi
if command -v lintian >/dev/null; then
    tell "lintian finds no error" "$(lintian --allow-root --fail-on none "$tmp"/deb/*.deb 2>&1 | grep '^E:')"
else
    echo "skip packaging: no lintian"
fi
exit $((failures > 0))
