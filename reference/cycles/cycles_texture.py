"""Textures of a dump: an image by nodes that fold its coordinates, as not every version mirrors and none wraps each direction in a
way of its own."""
import bpy

from cycles_blender import Vector, put_if_any

UV_LAYER = "assay"
IMAGES = {}


def load_image(path):
    if path not in IMAGES:
        image = bpy.data.images.load(path)
        image.colorspace_settings.name = "Non-Color"
        put_if_any(image, "image", use_half_precision=False)
        IMAGES[path] = image
    return IMAGES[path]


def folded(nodes, x, texture, axis):
    """Repeated by the image texture itself; else between the centres of the outermost texels, which
    is where both filters show what lies beyond."""
    if texture["wrap"][axis] == "repeat":
        return x
    size, pad = texture["size"][axis], texture["pad"][axis]
    whole = size + 2 * pad
    if texture["wrap"][axis] == "mirror":
        x = nodes.math("PINGPONG", x, 1.0)
    if pad:
        x = x * (size / whole) + pad / whole
    return x.max(0.5 / whole).min(1 - 0.5 / whole)


def textured(nodes, factor, texture):
    """factor: the whole colour where texture is None."""
    if texture is None:
        return (*factor, 1)
    place = Vector(nodes, nodes.node("UVMap", uv_map=UV_LAYER).outputs["UV"])
    u, v, _ = place.parts()
    at = nodes.combine(folded(nodes, u, texture, 0), folded(nodes, v, texture, 1), 0.0)
    node = nodes.node("TexImage", at, interpolation="Closest" if texture["nearest"] else "Linear",
                      extension="REPEAT", projection="FLAT")
    node.image = load_image(texture["file"])
    colour = Vector(nodes, node.outputs["Color"])
    return colour if all(f == 1 for f in factor) else colour.vector("MULTIPLY", tuple(factor))
