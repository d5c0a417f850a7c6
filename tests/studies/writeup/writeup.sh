#!/bin/bash
# tests/studies/writeup/writeup.sh BUILD [SHRINK]: every figure and table of a CS184 write-up of 2019 that this project started from,
# rendered anew into one page, BUILD/writeup/index.html. Its scenes are those of ASSAY_CS184 (../shared/scenes/cs184) where they
# are there, else those of the suite that are like them. SHRINK (1): images that many times smaller each way. With Blender
# and POV-Ray, VERDICTS=1 has two of the scenes judged against both, too.
set -eu
build=$(realpath "${1:?usage: writeup.sh BUILD [SHRINK]}") shrink=${2:-1}
cd "$(dirname "$0")/../../.."
course=${ASSAY_CS184:-../shared/scenes/cs184}
out=$build/writeup page=$build/writeup/index.html
rm -rf "$out"
mkdir -p "$out"
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
width=$((480 / shrink)) height=$((360 / shrink))

# The course's file, or the scene of the suite in its place.
scene_file() { # NAME OWN
    if [ -e "$course/$1.dae" ]; then echo "$course/$1.dae"; else echo "reference/scenes/$2.dae"; fi
}
box=$(scene_file sky/CBspheres_lambertian 41_cornell) glass=$(scene_file sky/CBspheres 42_cornell_glass)
bunny=$(scene_file sky/CBbunny 44_mesh) gems=$(scene_file sky/CBgems 43_cornell_metal)
cow=$(scene_file meshedit/cow 27_smooth_normals) planck=$(scene_file meshedit/maxplanck 44_mesh)
banana=$(scene_file keenan/banana 45_many_lights)

# The course's camera cuts a window of pixels out of 800 x 600: a smaller image shows the whole of it instead.
frame_of() { # SCENE
    if [ "$shrink" != 1 ] && [ "$1" != "${1#"$course"}" ]; then echo --frame whole; fi
}
# Renders $tmp/image.png and sets seconds (CPU, without building the hierarchy), mean (the line of the mean radiance) and command.
render() { # SCENE OPTION...
    local scene=$1
    shift
    command="pathtracer $* -r ${width}x$height $(basename "$scene")"
    # shellcheck disable=SC2046
    mean=$("$build/pathtracer" "$@" $(frame_of "$scene") -r ${width}x$height -f "$tmp/image.png" -f "$tmp/image.exr" "$scene" 2>"$tmp/log") ||
        { cat "$tmp/log" >&2; exit 1; }
    seconds=$(grep -a -o '[0-9.]* wall, [0-9.]* cpu' "$tmp/image.exr" | awk '{ print $3; exit }')
}
png() { # FILE ALT
    printf '<img alt="%s" src="data:image/png;base64,%s">' "$2" "$(base64 -w 0 "$1")"
}
part() { # TITLE WHAT-TO-SEE
    [ -z "${in_part-}" ] || echo "</div></section>"
    in_part=1
    printf '<section><h2>%s</h2>\n<p>%s</p>\n<div class="figures">\n' "$1" "$2"
}
# One figure; rates: also the map of samples per pixel.
figure() { # TITLE THEIRS SCENE OPTION...
    local title=$1 theirs=$2
    shift 2
    render "$@"
    echo "$seconds  $title" >&2
    printf '<figure>'
    png "$tmp/image.png" "$title"
    if [ -e "$tmp/image_rate.png" ]; then png "$tmp/image_rate.png" "$title: samples per pixel, blue few, red many" && rm "$tmp/image_rate.png"; fi
    printf '<figcaption><b>%s</b> %s CPU s%s<br><code>%s</code></figcaption></figure>\n' "$title" "$seconds" "${theirs:+ (write-up: $theirs)}" "$command"
}
row() { # CELL...: of a table
    printf '<tr>'
    printf '<td>%s</td>' "$@"
    echo '</tr>'
}
normals() { figure "$(basename "$1" .dae)" "" "$1" --integrator normals -s 1; }

write_page() {
    part "Part 1: rays and intersections" "Colours are directions of normals. Smooth surfaces have smooth colours; no pixel is missing at an edge between triangles."
    for scene in "$glass" "$gems" "$cow" "$banana" "$planck" "$bunny"; do normals "$scene"; done
    echo "</div></section>"
    in_part=

    cat <<'END'
<section><h2>Part 2: the hierarchy</h2>
<p>The same image with and without a bounding volume hierarchy. Without, a ray is tested against every triangle, so the time
grows with their number; with it, hardly.</p>
<div class="wide"><table><thead><tr><th>Scene</th><th>without, CPU s</th><th>with, CPU s</th><th>times faster</th></tr></thead><tbody>
END
    for scene in "$cow" "$bunny" "$planck"; do
        render "$scene" --integrator normals -s 1 --accel bruteforce
        without=$seconds mean_without=$mean
        render "$scene" --integrator normals -s 1
        [ "$mean" = "$mean_without" ] && same="" || same=" (images differ: $mean_without)"
        row "$(basename "$scene" .dae)$same" "$without" "$seconds" "$(awk "BEGIN { s = $seconds; print (s > 0 ? int($without / s) : \"more than can be timed\") }")"
    done
    cat <<'END'
</tbody></table></div>
<p class="caption">The write-up, three meshes, 8 threads in 2019: 30.5, 299.6 and 54.3 s without, 0.028, 0.037 and 0.042 s with it.</p></section>
END
    part "Part 3: direct light" "Directions over the hemisphere rarely find the lamp: grain. Points on the lamp always do: what is left is in soft shadows."
    figure "hemisphere, box" "200 s" "$box" -s 64 -l 32 -m 1 -H
    figure "light sampling, box" "" "$box" -s 64 -l 32 -m 1 --direct light
    figure "hemisphere, bunny" "453 s" "$bunny" -s 64 -l 32 -m 1 -H
    figure "light sampling, bunny" "" "$bunny" -s 64 -l 32 -m 1 --direct light
    part "Part 3: light samples" "One sample of each pixel, more and more of the lamp: only the soft shadows get smoother, the noise falling as the root."
    for l in 1 4 16 64; do figure "$l light samples" "" "$bunny" -s 1 -l $l -m 1 --direct light; done
    part "Part 4: global, direct, indirect" "Direct light leaves the ceiling black; indirect light brings the walls' colours to the spheres. The two add up to the first."
    figure "global" "" "$box" -s 1024 -l 4 -m 5
    figure "direct only" "" "$box" -s 1024 -l 4 -m 5 --only direct
    figure "indirect only" "" "$box" -s 1024 -l 4 -m 5 --only indirect
    part "Part 4: greatest depth" "Each bounce adds less: from 3 to 100 hardly anything changes, which is what Russian roulette relies on."
    for m in 0 1 2 3 100; do figure "-m $m" "" "$bunny" -s 1024 -l 4 -m $m; done
    part "Part 4: samples per pixel" "Four times the samples, half the noise."
    for s in 1 2 4 8 16; do figure "$s samples" "$([ $s = 1 ] && echo 0.35 s)" "$box" -s $s -l 4 -m 5; done
    figure "1024 samples" "422 s" "$box" -s 1024 -l 4 -m 5
    part "Part 5: adaptive sampling" "Up to 2048 samples. Red pixels took most: soft shadows and corners. Blue ones stopped early: the lamp, and walls in even light."
    figure "bunny" "" "$bunny" -s 2048 -l 1 -m 5 -a 64 0.05
    figure "box" "" "$box" -s 2048 -l 1 -m 5 -a 64 0.05
    echo "</div></section>"
    [ "${VERDICTS-}" != 1 ] || verdicts
}

# The box and the bunny as scenes of a suite of their own, judged against references that are rendered now.
verdicts() {
    mkdir "$tmp/suite"
    local n=41
    for scene in "$box" "$bunny"; do
        cp "$scene" "$tmp/suite/${n}_figure.dae"
        sed "s/\"width\": [0-9]*/\"width\": 64/; s/\"height\": [0-9]*/\"height\": 48/; s/\"replicates\": 256/\"replicates\": 24/; s/\"margin_global\": 0.00[0-9]*/\"margin_global\": 0.02/; s/\"margin_tile\": 0.02/\"margin_tile\": 0.1/; /consistency/d" reference/scenes/41_cornell.json >"$tmp/suite/${n}_figure.json"
        printf '# A figure\n' >"$tmp/suite/${n}_figure.md"
        n=$((n + 1))
    done
    # 2 % of the image and 10 % of a tile: an hour of POV-Ray would be needed for less.
    "$build/assay" validate -q --live --suite "$tmp/suite" -o "$out/verdicts" >"$tmp/verdicts" 2>&1 || true
    printf '<section><h2>Against Blender Cycles and POV-Ray</h2>\n<p>The box (41) and the bunny (42), a window of their middle, rendered by all three.</p>\n<pre tabindex="0">'
    grep -E '^(scene|4[12]_|result)' "$tmp/verdicts" | sed 's/&/\&amp;/g; s/</\&lt;/g' || head -c 500 "$tmp/verdicts"
    echo '</pre></section>'
}

{
    printf '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">\n'
    printf '<meta name="color-scheme" content="light dark"><title>The write-up, made again</title><style>\n'
    cat tools/html/page_plot.css tools/html/page.css
    cat <<'END'
.figures { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(20rem, 100%), 1fr)); gap: 1.6rem; }
.figures img { width: 100%; image-rendering: auto; border-radius: 4px; margin-bottom: 0.3rem; }
.figures code { overflow-wrap: anywhere; }
</style></head><body><main><header><p class="kicker">Assay gallery</p><h1>The CS184 write-up, made again</h1>
END
    printf '<p class="lede">Every figure and table of a write-up of Assignment 3 from 2019, by <code>make writeup</code>: image, command, CPU seconds of all threads together; its own figure where it gives one (wall time on 8 threads).</p>\n'
    printf '<p class="lede">%s x %s pixels, %s, scenes: %s.</p></header>\n' $width $height "$("$build/pathtracer" --version | cut -d, -f1)" \
        "$([ -e "$course/sky/CBbunny.dae" ] && echo "the course's" || echo "the suite's, in place of the course's")"
    write_page
    echo '</main></body></html>'
} >"$out/page"
mv "$out/page" "$page"
echo "$page"
