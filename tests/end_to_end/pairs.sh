#!/bin/bash
# tests/end_to_end/pairs.sh BUILD: the scenes 5x and 6x are what reference/pairs/pairs.py writes and cover the pairs
# that their page lists; switching a level off changes images; other ways to the same images agree. All levels and ways:
# make pairs. Prints "ok NAME" or "not ok NAME: why".
set -u
build=$(realpath "${1:?usage: tests/end_to_end/pairs.sh BUILD}")
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0
export PYTHONDONTWRITEBYTECODE=1

what=pairs
. tests/end_to_end/expect.sh
mkdir "$tmp/scenes"
python3 reference/pairs/pairs.py "$tmp/scenes"
tell "the scenes are those of the table" "$(for f in "$tmp"/scenes/*; do cmp "$f" "reference/scenes/${f##*/}" 2>&1; done)"
python3 reference/pairs/pairs_page.py "$tmp/made.md"
tell "the page is made by its program" "$(cmp "$tmp/made.md" reference/docs/pairs.md 2>&1)"
expect "all pairs but those that cannot be" 0 "833 pairs, 13 in no scene" python3 reference/pairs/pairs_cover.py
expect "levels that are switched off are seen" 0 " 0 failed" python3 reference/pairs/knockout.py "$build" 54_many_here --levels mirrored uneven lens
expect "control: what is not switched off is not" 1 "1 failed" python3 reference/pairs/knockout.py "$build" 54_many_here --levels nothing
expect "other ways to the same images" 0 "^0 failed" python3 reference/pairs/runs.py "$build" run_01 run_04 run_09 run_11 run_19 run_20
exit $((failures > 0))
