#!/bin/sh
# tools/results.sh BUILD: prints tools/RESULTS.md from what `make validate` and `assay converge` left in BUILD. Without the latter
# its table stays as the page has it.
set -eu
build=$1 page=$(dirname "$0")/RESULTS.md
cat <<'END'
# Results

Made by `make results` from the last `make validate`. To read it with pictures: `build/report/index.html`.

## Our renderer against the exact answer, Cycles and POV-Ray

A cell is a comparison of image means. `+0.004 ± 0.046, 0.37` means: ours is 0.004 % brighter on average, give or take
0.046 %; an error of 0.37 % would have been noticed 19 times out of 20. Every cell is EQUIVALENT (the image and each of
its tiles lie inside the margin that the scene declares) unless it says otherwise. Empty: there is no exact answer, or
the program cannot express the scene. Scenes 9x are deliberate mistakes, which must come out DIFFERENT. The chance that
noise alone makes any cell of the table wrong is at most 0.1 %.

END
"$build/assay" report --matrix "$build/report/results.json"
cat <<'END'

The other claims are Cycles and POV-Ray against the exact answer, our other estimators, and whether renders err as much
as they state; `assay report --markdown build/report/results.json` prints all.

## Variance and convergence

How the error falls with samples, 16 replicates at 1 to 256 samples (`assay converge --shrink 2 33_sphere_light
41_cornell 45_many_lights 46_sky`). *Slope*: of the error against samples, -1/2 for independent ones. *Bias at most*:
of a pixel, at 256 samples. *Variance / Cycles'*: below 1, ours has less noise. *Efficiency*: 1/(variance x CPU time),
above 1, ours needs less time for the same noise; the machine was busy.

END
if [ -e "$build/converge/results.json" ]; then "$build/assay" report --matrix "$build/converge/results.json"; else
    sed -n '/^| scene | slope/,/^$/p' "$page" | sed '/^$/d'; fi
