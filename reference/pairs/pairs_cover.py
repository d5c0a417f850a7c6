"""Which scene holds which pair of levels."""
import itertools

from pairs import CAMERA_LEVELS, LIGHT_LEVELS, LIGHTS, CAMERAS, DEPTHS, GEOMETRIES, MATERIALS, TRANSFORMS, WORLDS, Scene, rows

FACTORS = {"material": list(MATERIALS),
           "geometry": [*GEOMETRIES, "mosaic"],
           "transform": [*TRANSFORMS, *WORLDS[1:]],
           "light": [level for name in LIGHTS for level in LIGHT_LEVELS[name]],
           "camera": sorted({level for name in CAMERAS for level in CAMERA_LEVELS[name]}),
           "depth": [f"depth {d}" for d in DEPTHS]}
OF_OBJECTS = ("material", "geometry", "transform")


def triples(scene):
    """(material, geometry, transform) of each object; a mosaic has all materials of the scene."""
    for material, geometry, transform in scene.levels["objects"]:
        for m in scene.materials if geometry == "mosaic" else [material]:
            yield m, geometry, transform


def pairs_of(scene):
    """{(factor, level, factor, level)}"""
    objects = list(triples(scene))
    alone = {"light": LIGHT_LEVELS[scene.lights], "camera": CAMERA_LEVELS[scene.camera],
             "depth": [f"depth {scene.depth}"]}
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
    for row in rows():
        for pair in set(pairs_of(Scene(row))):
            found[pair].append(row[0])
    return found


if __name__ == "__main__":
    table = cover()
    print(len(table), "pairs,", sum(not v for v in table.values()), "in no scene:")
    for k, v in table.items():
        if not v:
            print(" ", *k)
