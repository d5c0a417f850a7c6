#!/bin/bash
# tools/autograder/pack.sh BUILD RUBRIC OUT.zip COMMIT PACKAGE...: makes an autograder for Gradescope. The zip holds
# setup.sh and run_autograder, our sources (built on Gradescope, as libraries differ), the files beside the rubric, its
# catalogue of bugs, its references, which are rendered here, once, and, if $SKELETON is set, that starter code, to fill
# the compiler cache.
set -eu
build=$(realpath "$1") rubric=$2 out=$3 commit=$4
shift 4
"$build/assay" grade --check-rubric "$rubric"
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
mkdir -p "$tmp/zip/assay/golden" "$tmp/zip/rubric" "$build/autograder"
cp tools/autograder/setup.sh tools/autograder/run_autograder "$tmp/zip"
cp -R Makefile LICENSE renderer reference tools "$tmp/zip/assay"
cp -R golden "$tmp/zip/assay"
find "$(dirname "$rubric")" -maxdepth 1 -type f -exec cp {} "$tmp/zip/rubric" \;
bugs=$(awk '$1 == "bugs" { print $2 }' "$rubric")
[ -z "$bugs" ] || cp -R "$(dirname "$rubric")"/${bugs//"{variant}"/*} "$tmp/zip/rubric"
basename "$rubric" >"$tmp/zip/rubric_name"
echo "$commit" >"$tmp/zip/commit"
echo "$@" $(awk '$1 == "packages" { $1 = ""; sub(/ #.*/, ""); print }' "$rubric") >"$tmp/zip/packages"
[ -z "${SKELETON:-}" ] || (mkdir "$tmp/zip/skeleton" && cp -R "$SKELETON" "$tmp/zip/skeleton")
"$build/assay" grade --prepare -o "$build/autograder" "$rubric"
cp -R "$build/autograder/.references" "$tmp/zip/references"
rm -f "$tmp/zip/references"/*.log
case $out in /*) ;; *) out=$PWD/$out ;; esac
rm -f "$out.new"
(cd "$tmp/zip" && zip -qr -X "$out.new" .)
mv "$out.new" "$out"
echo "$out: $(du -h "$out" | cut -f 1), $(basename "$rubric")"
