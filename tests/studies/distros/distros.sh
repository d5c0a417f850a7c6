#!/bin/bash
# tests/studies/distros/distros.sh WORK [STEP...]: what is committed, in new minimal roots of Debian 12 and 13 (as root, with mmdebstrap and the
# network): nothing is there but make, git and certificates, so that what our own files do not install is missed. STEPs: build, validate, live (four
# scenes with Blender and POV-Ray of that system), drift (references by its Blender against the stored ones), check (all tests: half an hour); all
# of them if none is named. A root that is there is used again, SUITES="trixie" takes one of the two. Writes README.md beside this file: a table
# of the last result of each step in WORK; logs are WORK/SUITE.STEP.log. Status 1 if a step failed.
set -u
work=${1:?usage: tests/studies/distros/distros.sh WORK [STEP...]}
shift
suites=${SUITES:-bookworm trixie}
here=$(dirname "$(realpath "$0")")
[ $# -gt 0 ] || set -- build validate live drift check
[ "$(id -u)" = 0 ] && command -v mmdebstrap >/dev/null || { echo "distros.sh: needs root and mmdebstrap (Debian package)" >&2 && exit 3; }
mkdir -p "$work" && work=$(realpath "$work")

# Enters a root so that namespaces can be made in it, which chroot(2) forbids.
inside() { # ROOT COMMAND
    cp /etc/resolv.conf "$1/etc/resolv.conf"
    # shellcheck disable=SC2016
    unshare -m -p -f --propagation private bash -c 'mount --bind "$1" "$1" && mkdir -p "$1/.old" && mount --rbind /dev "$1/dev" && mount --rbind /sys "$1/sys" &&
        cd "$1" && pivot_root . .old && mount -t proc proc /proc && umount -l /.old && cd /assay && DEBIAN_FRONTEND=noninteractive exec sh -c "$2"' sh "$1" "$2"
}
scenes="--only 12_point_plane --only 23_ggx_furnace --only 25_ggx_metal --only 34_sky_constant"
declare -A run=(
    [build]="make -j2 all"
    [validate]="make validate"
    [live]="make -j2 all build/deps-live && build/assay validate -q --live $scenes -o build/live"
    [drift]="make -j2 all build/deps-live && build/assay golden render --engine cycles $scenes --seed 20261123 --fresh --golden /nowhere && build/assay golden compare"
    [check]="make deps-live && make check" # as CI does: what asks the engines is skipped where there are none
)
# The line that a reader wants of a log.
result() { # STEP LOG
    case $1 in
    build) echo built ;;
    check) grep -E '^[0-9]+ passed, [0-9]+ failed' "$2" | tail -n 1 ;;
    drift) awk '/^scene  /{ on = 1; next } on && /EQUIVALENT|DIFFERENT|INCONCLUSIVE|not compared/ { n[$NF == "EQUIVALENT" ? "EQUIVALENT" : /DIFFERENT/ ? "DIFFERENT" : "other"]++ }
        END { for (k in n) printf "%d %s ", n[k], k }' "$2" ;;
    *) sed -n 's/^result: //p' "$2" | tail -n 1 ;;
    esac
}
version() { inside "$work/$1" "$2 2>/dev/null | head -n 1" 2>/dev/null | grep -oE '[0-9]+\.[0-9.]+' | head -n 1; }

failed=0 systems=""
for suite in $suites; do
    root=$work/$suite
    [ -d "$root/assay" ] || mmdebstrap --variant=minbase --include=make,git,ca-certificates "$suite" "$root" http://deb.debian.org/debian >"$work/$suite.root.log" 2>&1 ||
        { echo "distros.sh: $suite: $(tail -n 1 "$work/$suite.root.log")" >&2 && exit 3; }
    git init -q "$root/assay" && git -C "$root/assay" fetch -q --depth 1 "file://$(git rev-parse --show-toplevel)" HEAD &&
        git -C "$root/assay" checkout -qf FETCH_HEAD || exit 3
    inside "$root" "apt-get -qq update" >>"$work/$suite.root.log" 2>&1
    for step in "$@"; do
        start=$(date +%s)
        inside "$root" "${run[$step]}" >"$work/$suite.$step.log" 2>&1
        status=$?
        [ $status -eq 0 ] || failed=1
        echo "| $suite | $step | $([ $status -eq 0 ] && echo yes || echo "**no**, status $status") | $(result "$step" "$work/$suite.$step.log" | sed 's/ *$//') |" \
            "$((($(date +%s) - start + 30) / 60)) | $(date -u +%F), $(git rev-parse --short HEAD) |" | tee "$work/$suite.$step.row" >&2
    done
done
for suite in bookworm trixie; do
    root=$work/$suite
    [ -d "$root/assay" ] || continue
    systems+="| $suite | $(cat "$root/etc/debian_version") | $(version $suite 'gcc --version') | $(version $suite 'clang --version') | $(version $suite 'blender --version') | $(ls -d "$root"/usr/include/embree* 2>/dev/null | grep -o '[34]$') |"$'\n'
done
{
    cat <<'TEXT'
# On which systems

What is committed, in new minimal roots of Debian 12 (bookworm) and 13 (trixie) in which nothing is but make, git and
certificates. `make distros` makes this page; do not edit.

TEXT
    printf '| system | version | gcc | clang | Blender | Embree |\n|---|---|---|---|---|---|\n%s\n' "$systems"
    printf '| system | step | passes | result | minutes | made, at commit |\n|---|---|---|---|--:|---|\n'
    for suite in bookworm trixie; do
        for step in build validate live drift check; do cat "$work/$suite.$step.row" 2>/dev/null; done
    done
} | tee "$here/README.md"
exit $failed
