#!/bin/sh
# blender.sh SCENE SPP SEED THREADS OUT: one image by Blender's Cycles, of a scene as `assay export --engine cycles` writes it. In
# the place of cycles.py stands your own script of a build or an add-on of yours; the Blender of your PATH is the one that is tried.
set -e
script=$(realpath "$(dirname "$0")/../cycles/cycles.py")
scene=$(realpath "$1")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
echo "[$3]" >seeds.json
# Otherwise a distribution's Blender looks for numpy in the virtual environment that is active.
case $(realpath "$(command -v blender)") in /usr/bin/*) python="--env-system-python /usr" ;; *) python= ;; esac
# shellcheck disable=SC2086
blender $python -b --factory-startup -noaudio --python-exit-code 3 -P "$script" -- --scene "$scene" --spp "$2" --threads "$4" --seeds seeds.json
mv replicate_0000.exr "$5"
