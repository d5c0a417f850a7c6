#!/bin/sh
# mine.sh SCENE WIDTH HEIGHT SPP DEPTH SEED OUT: one image of linear radiance. Write your own command in place of the last two
# lines, which let our renderer stand for yours.
PATH=$(dirname "$0")/build:$(dirname "$0")/../../build:$PATH
exec pathtracer -q -r "$2" "$3" -s "$4" -m "$5" --seed "$6" -f "$7" "$1"
