"""The .json and .md of a scene."""
import json
import textwrap

# Samples of ours, replicates and samples of Cycles; declared with the margins before anything was judged.
SAMPLES = {53: 512, 54: 2048, 56: 2048, 57: 2048, 62: 2048, 63: 2048, 64: 2048}
SAMPLES_ELSE, REPLICATES, REPLICATE_SAMPLES = 1024, 32, 64
MARGIN_GLOBAL, MARGIN_GLOBAL_DARK, MARGIN_TILE, TILE = 0.01, 0.015, 0.06, 32

WORDS = {"here": "at the origin", "far": "21 units from the origin", "small": "1e-3 in size", "large": "1e3 in size"}


def margin_global(scene):
    """Where no sky shines a few caustics are much of the light, and noisy."""
    return MARGIN_GLOBAL_DARK if scene.lights in ("ambient", "points") else MARGIN_GLOBAL


def json_text(scene):
    levels = sorted({m for m, _, _ in scene.levels["objects"]} | {g for _, g, _ in scene.levels["objects"]}) + \
        ([scene.floor] if scene.floor != "plain" else [])
    out = {"title": f"Pairs of features: {scene.lights}, {scene.world}, {scene.camera}, depth {scene.depth}",
           "detects": "a bug of any of " + ", ".join(levels) + ", or of two together",
           "blind_to": f"errors below {100 * margin_global(scene):g} % of the image and {100 * MARGIN_TILE:g} % of a tile",
           **scene.settings(), "spp": SAMPLES.get(scene.number, SAMPLES_ELSE), "tile": TILE,
           "expect": "EQUIVALENT", "not_expressible": {"povray": "it has no rough metals"},
           "references": {"cycles": {"class": "limit", "margin_global": margin_global(scene), "margin_tile": MARGIN_TILE,
                                     "replicates": REPLICATES, "spp": REPLICATE_SAMPLES}}}
    return json.dumps(out, indent=2) + "\n"


def page(scene):
    from pairs import CAMERA_LEVELS, LIGHT_LEVELS
    objects = "\n".join(f"| {m} | {g} | {t} |" for m, g, t in scene.levels["objects"])
    sheet = ["the sheet of the depth meter"] if scene.depth > 1 else []
    return f"""# {scene.name}: pairs of features

""" + wrap(f"Made by `reference/pairs/pairs.py`; how, and what each level is, says [pairs of features](../docs/pairs.md). Eight "
           f"objects on a floor{'' if scene.floor == 'plain' else f' with a {scene.floor}'}, {WORDS[scene.world]}; depth {scene.depth}. Lights: "
           f"{', '.join([*LIGHT_LEVELS[scene.lights], *sheet])}. Camera: {', '.join(CAMERA_LEVELS[scene.camera])}.") + f"""

| material | geometry | transform |
|---|---|---|
{objects}

## What it detects
A wrong material, shape, transform, texture, light, camera or depth, alone or with any of the others that are here.

## What it is blind to
""" + wrap(f"Errors below {100 * margin_global(scene):g} % of the image and {100 * MARGIN_TILE:g} % of {TILE} x {TILE} pixels, wherever "
           "they are; which feature it is, if one is wrong.") + "\n"


def wrap(text):
    return textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False)
