#!/bin/bash
# Gradescope runs this once, when it makes the image in which submissions are graded: packages, and our programs.
set -eu
root=${AUTOGRADER_ROOT:-/autograder}
if [ -z "${AUTOGRADER_NO_APT:-}" ]; then
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $(cat "$root/source/packages")
fi
# The commit is part of the names under which the references lie in the zip.
make -C "$root/source/assay" BUILD="$root/source/build" COMMIT="$(cat "$root/source/commit")" all
# What every submission shares is compiled once, with this machine's compiler.
fill() {
    (cd "$root/source/assay" && "$root/source/build/assay" grade --golden golden --suite reference/scenes "$@" --fill-build-cache \
        --build-cache "$root/source/build-cache" "$root/source/rubric/$(cat "$root/source/rubric_name")" "$root/source/skeleton")
}
[ ! -d "$root/source/skeleton" ] || fill || fill --unsafe-no-sandbox
# Nobody but root may see what the right images look like.
chmod -R go-rwx "$root/source"
