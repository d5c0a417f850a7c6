#!/bin/bash
# Speed-up by a hierarchy: normal shading of the course's meshes, 800 x 600, 1 sample, all threads, with
# every --accel, beside the seconds of the write-up that this project started from (8 threads). The meshes
# are not ours to distribute: ASSAY_CS184 says where they are. Brute force takes a minute or two.
set -u
pathtracer=$(realpath "${1:?usage: tests/studies/bench/bvh_table.sh BUILD}")/pathtracer
root=${ASSAY_CS184:-../shared/scenes/cs184}
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
status=0

# number BEFORE AFTER: the number between two words of the summary line.
number() { sed -nE "s/.*$1([0-9.e+]+)$2.*/\1/p" "$tmp/err"; }

printf '%-10s %-10s %8s %9s %9s %9s %12s %10s\n' mesh accel 'build s' 'render s' 'CPU s' 'boxes' \
    primitives 'write-up s'
row() { # MESH DIRECTORY WITHOUT WITH
    local file=$root/$2/$1.dae accel published
    if [ ! -f "$file" ]; then
        echo "SKIPPED: no $file (set ASSAY_CS184)"
        status=1
        return
    fi
    for accel in bruteforce centroid sah; do
        case $accel in bruteforce) published=$3 ;; centroid) published=$4 ;; *) published=- ;; esac
        if ! "$pathtracer" --integrator normals --dialect cgl --accel $accel -r 800 600 -s 1 -t 0 \
            -f "$tmp/$accel.exr" "$file" 2>"$tmp/err" >/dev/null; then
            tail -n 1 "$tmp/err"
            status=1
            return
        fi
        printf '%-10s %-10s %8s %9s %9s %9s %12s %10s\n' "$1" $accel "$(number 'built in ' ' s')" \
            "$(number 'rays in ' ' s')" "$(number '\(' ' CPU s')" "$(number 'per ray ' ' box')" \
            "$(number 'box and ' ' primitive')" "$published"
    done
}
row cow meshedit 30.5 0.028
row maxplanck meshedit 299.6 0.037
row CBbunny sky 54.3 0.042
echo 'boxes, primitives: tests per ray. One thread builds.'
exit $status
