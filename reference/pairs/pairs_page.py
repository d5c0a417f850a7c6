#!/usr/bin/env python3
"""pairs_page.py [FILE]: writes reference/docs/pairs.md, or FILE, from the table, the list of runs and what knockout.py and runs.py said
(knockout.json, runs.json beside this)."""
import os
import sys

from pairs import CAMERA_LEVELS, LIGHT_LEVELS, Scene, rows
from pairs_cover import FACTORS, cover, is_seen, read
from pairs_text import MARGIN_GLOBAL, MARGIN_GLOBAL_DARK, MARGIN_TILE, wrap
from runs import FACTORS as RUN_FACTORS, SEEDS, table

HERE = os.path.dirname(os.path.abspath(__file__))

LEVELS = """
| level | what it is | without it |
|---|---|---|
| diffuse, mirror, refraction, glass, coloured_glass, ggx, beckmann | the material of an object | grey and diffuse; diffuse: a mirror |
| box | 12 triangles | gone |
| sphere | the quadric | gone |
| smooth | a torus of 112 quadrangles with interpolated normals | its flat faces |
| instances | 32768 triangles: 256 instances of instances of a ball | one ball |
| slivers | two cones of triangles 50 times as long as wide | gone |
| mosaic | 289 tiles, each a material of its own, of all kinds | one tile |
| rigid, mirrored, uneven | turned; and mirrored; and scaled by 0.75, 1.2, 0.9 along axes that the shape is not aligned with | not turned, mirrored, scaled |
| far, small, large | the whole scene 21 units from the origin, 1e-3 by a node's scale, 1e3 by the file's unit (by a scale in the assignment's dialect) | objects without it, camera and lights with it |
| sky_image, sky_constant, ambient | an environment map, a uniform sky, the assignment's hidden ambient light | dark |
| area_one_sided, area_two_sided, lamp_sphere, lamp_mesh | rectangle, quadrangle, sphere, box that glow; mirrored and uneven ones at the origin | dark |
| many | 24 more, powers 1 to 2000 | dark |
| point_constant, point_linear, point_quadratic, spot, sun | lights without area; the spot with all three parts of the falloff | dark |
| lens, wide, tall | thin lens; 4 : 3; 3 : 4, by the vertical angle | a pinhole; the angle taken for that of the other side |
| near, far_clip | a sheet before the near plane, one behind the far plane: both are met by paths that have bounced | planes that cut nothing |
| texture_nearest, texture_bilinear | 5 x 4 texels on the floor, repeated along one axis and mirrored along the other; clamped and ending | a plain floor |
| depth | parallel mirrors before a glowing sheet, in which as many reflections as paths may have are seen | one bounce less |
"""


def numbers(scenes):
    return " ".join(str(n) for n in sorted(scenes))


def main():
    knocked, ran = read("knockout.json", {"levels": []}), read("runs.json", {"runs": []})
    scenes = [Scene(row) for row in rows()]
    pairs = cover()
    missing = [k for k, v in pairs.items() if not v]
    effect = {(k["scene"], k["level"]): k["effect"] for k in knocked["levels"]}
    out = ["# Pairs of features", ""]
    out += ["Scenes 50 to 65 hold all pairs of levels of seven factors: material, geometry and transform of an object, light, camera,",
            "depth, texture of the floor. Bugs that need two features together, which scenes of one feature each do not meet, show here. Written by",
            "`reference/pairs/pairs_page.py`; do not edit.", "",
            "    python3 reference/pairs/pairs.py reference/scenes    # the scenes again, from the table in pairs.py",
            "    make pairs                                           # each level switched off, and the runs; this page",
            "", "## The array", "",
            "Sixteen scenes are an orthogonal array: lights, world, camera and depth, four of each, in all combinations of two; a fifth",
            "column says which four have a mosaic, and what texture the floor has. Materials and geometries go round the eight objects of a scene, and so do",
            "transforms in the world at the origin. A pair of two of an object's factors counts where one object has both.", "",
            "| scene | lights | world | camera | pixels | depth | mosaic | floor |", "|---|---|---|---|---|--:|---|---|"]
    for s in scenes:
        size = s.settings()
        out.append(f"| {s.name} | {', '.join(LIGHT_LEVELS[s.lights])} | {s.world} | {', '.join(CAMERA_LEVELS[s.camera])} | "
                   f"{size['width']} x {size['height']} | {s.depth} | {'yes' if s.mosaic else ''} | {s.floor} |")
    out += ["", "## What each level is"] + LEVELS.rstrip().split("\n")
    out += ["", f"Truth: Cycles, {100 * MARGIN_GLOBAL:g} % of the image ({100 * MARGIN_GLOBAL_DARK:g} % where no sky shines), {100 * MARGIN_TILE:g} % of a tile. POV-Ray has no rough metals, and each scene has one.",
            "The mirrors of the depth meter reflect all light: no path ends by roulette there, so that a pixel has no noise.",
            "Not in the array: 1e6 triangles, whose dump for Cycles alone is 100 MB.",
            "", f"## Which scene holds which pair: {len(pairs) - len(missing)} of {len(pairs)}", ""]
    out += ["In no scene: " + "; ".join(f"{a} with {b}" for _, a, _, b in missing) + ".",
            "A sphere scaled unevenly is no sphere, and refused. Cycles cannot light its random facets, of which Beckmann's are made,",
            "by lights without area or by the hidden ambient one ([why](../cycles/README.md)). The others a scene has, but does not see:",
            "what is in brackets below does not count. Mostly it is the normals of a torus a few pixels wide.", ""]
    out += ["The numbers of the scenes; of each pair of factors a table.", ""]
    for f, g in dict.fromkeys((k[0], k[2]) for k in pairs):
        out += [f"### {f} and {g}", "", "| | " + " | ".join(FACTORS[g]) + " |", "|---|" + "---|" * len(FACTORS[g])]
        out += [f"| {a} | " + " | ".join(numbers(pairs[f, a, g, b]) for b in FACTORS[g]) + " |" for a in FACTORS[f]]
        out.append("")
    if knocked["levels"]:
        out += ["## What each scene sees", "",
                f"How far the image moves when the level is switched off, in MDBs: of the region that moves most, over the smallest",
                f"difference that would have been found there with 95 %. In brackets: not seen, and not counted above. Measured",
                f"{knocked['date']}.", ""]
        mark = {(k["scene"], k["level"]): "{:.3g}" if is_seen(k) else "({:.3g})" for k in knocked["levels"]}
        columns = list(dict.fromkeys(k["level"] for k in knocked["levels"]))
        out += ["| level | " + " | ".join(str(s.number) for s in scenes) + " |", "|---|" + "--:|" * len(scenes)]
        for level in columns:
            out.append(f"| {level} | " + " | ".join(
                mark[s.name, level].format(effect[s.name, level]) if (s.name, level) in effect else "" for s in scenes) + " |")
    if ran["runs"]:
        out += ["", f"## Other ways to the same images: {len(table())} runs", "",
                f"All pairs of {', '.join(RUN_FACTORS)}, that can be (adaptive sampling needs independent samples, shares",
                f"that stopped by themselves do not add up, and to a pilot no samples can be added), over scenes by turns, with their samples ({SEEDS} images of seeds of their own with Sobol's), against the same references. Shares are of three ranges of sample",
                "numbers, cells four rectangles of odd sizes (`-p`); both are merged. A PNG has to show the means of the EXR beside it,",
                "within rounding. The last run is one more: each of its light samples has to choose among many lamps.", f"Measured {ran['date']}.", "",
                "| run | scene | " + " | ".join(RUN_FACTORS) + " | verdict | difference % |", "|---|---|" + "---|" * len(RUN_FACTORS) + "---|--:|"]
        for run in ran["runs"]:
            out.append(f"| {run['name'][4:]} | {run['scene']} | " + " | ".join(str(run[f]) for f in RUN_FACTORS) +
                       f" | {run['verdict']} | {100 * run['difference']:+.2f} |")
    out = [line if line.startswith(("|", "    ", "#")) else wrap(line) for line in out]
    with open(sys.argv[1] if len(sys.argv) > 1 else os.path.join(HERE, "../docs/pairs.md"), "w", encoding="utf-8") as f:
        f.write("\n".join(out) + "\n")


if __name__ == "__main__":
    main()
