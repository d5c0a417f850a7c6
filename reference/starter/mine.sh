#!/bin/sh
# mine.sh SCENE WIDTH HEIGHT SPP DEPTH SEED OUT: one image of linear radiance, with noise that the seed decides. Write your own
# command in place of the last two lines, which let Assay's path tracer stand for your renderer.
PATH=$PATH:@BIN@
exec pathtracer -q -r "$2" "$3" -s "$4" -m "$5" --seed "$6" -f "$7" "$1"
