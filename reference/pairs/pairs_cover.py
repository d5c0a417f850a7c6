#!/usr/bin/env python3
"""pairs_cover.py: how many pairs of levels there are, and which no scene holds. A level that a scene does not see
(knockout.json) does not count there."""
import itertools
import json
import os

from pairs import CAMERA_LEVELS, LIGHT_LEVELS, LIGHTS, CAMERAS, DEPTHS, FLOORS, GEOMETRIES, MATERIALS, TRANSFORMS, WORLDS, Scene, rows

FACTORS = {"material": list(MATERIALS),
           "geometry": [*GEOMETRIES, "mosaic"],
           "transform": [*TRANSFORMS, *WORLDS[1:]],
           "light": [level for name in LIGHTS for level in LIGHT_LEVELS[name]],
           "camera": sorted({level for name in CAMERAS for level in CAMERA_LEVELS[name]}),
           "depth": [f"depth {d}" for d in DEPTHS],
           "floor": list(FLOORS[1:])}
OF_OBJECTS = ("material", "geometry", "transform")


def triples(scene):
    """(material, geometry, transform) of each object; a mosaic has all materials of the scene."""
    for material, geometry, transform in scene.levels["objects"]:
        for m in scene.materials if geometry == "mosaic" else [material]:
            yield m, geometry, transform


def read(name, otherwise):
    """What was measured, from beside this; `otherwise` where nothing was."""
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), name)
    if not os.path.exists(path):
        return otherwise
    with open(path, encoding="utf-8") as f:
        return json.load(f)


def is_seen(knocked):
    """A level was switched off: is the image DIFFERENT, by more than the smallest bias that could have been missed?"""
    return knocked["verdict"] == "DIFFERENT" and knocked["effect"] > 1


def unseen():
    """{(scene, level)}"""
    return {(k["scene"], k["level"].replace("depth", f"depth {k.get('depth')}")) for k in
            read("knockout.json", {"levels": []})["levels"] if not is_seen(k)}


def pairs_of(scene):
    """{(factor, level, factor, level)}"""
    objects = list(triples(scene))
    alone = {"light": LIGHT_LEVELS[scene.lights], "camera": CAMERA_LEVELS[scene.camera],
             "depth": [f"depth {scene.depth}"], "floor": [scene.floor] if scene.floor != "plain" else []}
    levels = {f: {o[i] for o in objects} for i, f in enumerate(OF_OBJECTS)} | alone
    for f, g in itertools.combinations(FACTORS, 2):
        if g in OF_OBJECTS:
            i, j = OF_OBJECTS.index(f), OF_OBJECTS.index(g)
            both = {(o[i], o[j]) for o in objects}
        else:
            both = itertools.product(levels[f], levels[g])
        yield from ((f, a, g, b) for a, b in both)


def cover():
    """{pair: [numbers of scenes]}, with all pairs that could be."""
    found = {(f, a, g, b): [] for f, g in itertools.combinations(FACTORS, 2) for a in FACTORS[f] for b in FACTORS[g]}
    without = unseen()
    for row in rows():
        scene = Scene(row)
        for pair in set(pairs_of(scene)):
            if not {(scene.name, pair[1]), (scene.name, pair[3])} & without:
                found[pair].append(row[0])
    return found


if __name__ == "__main__":
    table = cover()
    print(len(table), "pairs,", sum(not v for v in table.values()), "in no scene:")
    for k, v in table.items():
        if not v:
            print(" ", *k)
