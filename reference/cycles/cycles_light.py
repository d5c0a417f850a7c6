"""Lamps and environments of a dump."""
import math

import bpy
import numpy as np

from cycles_blender import Nodes, Number, Vector, add_object, put


def add_lamp(name, kind, matrix, power, color, **values):
    """color is scaled to a largest component of 1."""
    top = max(color)
    lamp = bpy.data.lights.new(name, kind)
    put(lamp, name, energy=power * top, **values)
    lamp.color = [c / top for c in color]
    if hasattr(lamp, "use_soft_falloff"):
        lamp.use_soft_falloff = False
    lamp.cycles.cast_shadow = True
    lamp.cycles.max_bounces = 1024
    add_object(name, lamp, matrix)
    return lamp


def shape_lamp(lamp, light):
    """Strength relative to a point light of W/sr: another fall-off, a cone. On a lamp, Incoming
    points from it to the lit place."""
    nodes = Nodes(lamp)
    falloff = nodes.node("LightFalloff", 1.0, 0.0)
    d, d2 = (Number(nodes, falloff.outputs[name]) for name in ("Linear", "Constant"))
    a = light["attenuation"]
    strength = d2 / (a[0] + a[1] * d + a[2] * d2)
    if light["kind"] == "spot":
        c = nodes.geometry("Incoming").dot(tuple(light["axis"]))
        strength = strength * (c > light["cos_cutoff"]) * c.max(0.0) ** light["exponent"]
    emission = nodes.node("Emission", (1, 1, 1, 1), strength)
    nodes.node("OutputLight", emission.outputs[0])


def add_light(i, light):
    name, matrix = f"light_{i}", np.eye(4)
    if light["kind"] in ("point", "spot"):
        if not any(light["value"]):
            return
        matrix[:3, 3] = light["position"]
        a = light["attenuation"]
        plain = light["kind"] == "point" and a[0] == 0 and a[1] == 0
        power = 4 * math.pi / (a[2] if plain else 1)
        lamp = add_lamp(name, "POINT", matrix, power, light["value"], shadow_soft_size=0.0)
        if not plain:
            shape_lamp(lamp, light)
    elif light["kind"] == "directional":
        if not any(light["irradiance"]):
            return
        z = np.array(light["to_light"])
        x = np.cross(np.eye(3)[np.argmin(abs(z))], z)
        x /= np.linalg.norm(x)
        matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = x, np.cross(z, x), z
        add_lamp(name, "SUN", matrix, 1.0, light["irradiance"], angle=0.0)
    else:
        raise ValueError(f"unknown light {light['kind']!r}")


def padded_image(path):
    """The map with its first column behind its last and the last before the first: an image texture
    that ends at its edges is then periodic in longitude, and constant beyond the first and last
    row's middles, where Blender's own environment texture goes on behind the pole."""
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    if len(image.pixels) != len(pixels):
        raise ValueError(f"{path}: {image.channels} channels")
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, 4)
    pixels = np.concatenate([pixels[:, -1:], pixels, pixels[:, :1]], axis=1)
    padded = bpy.data.images.new("environment", width + 2, height, float_buffer=True, alpha=False)
    padded.colorspace_settings.name = "Non-Color"
    padded.pixels.foreach_set(np.ascontiguousarray(pixels).ravel())
    padded.pack()
    return padded


def image_color(nodes, direction, path):
    x, y, z = direction.parts()
    theta = nodes.math("ARCTAN2", (x * x + z * z).sqrt(), y)
    phi = nodes.math("ARCTAN2", -1.0 * z, x) + math.pi
    image = padded_image(path)
    width = image.size[0] - 2
    column = (phi * (width / (2 * math.pi)) + 1.0) / (width + 2.0)
    texture = nodes.node("TexImage", nodes.combine(column, 1.0 - theta / math.pi, 0.0),
                         interpolation="Linear", extension="EXTEND", projection="FLAT")
    texture.image = image
    return texture.outputs["Color"], width


def add_environment(environment):
    world = bpy.data.worlds.new("environment")
    nodes = Nodes(world)
    color, strength, resolution = None, 1.0, 256
    direction = Vector(nodes, nodes.node("TexCoord").outputs["Generated"])
    if environment["kind"] == "image":
        color, width = image_color(nodes, direction, environment["file"])
        resolution = min(max(4 * width, 256), 4096)
    else:
        color = (*environment["radiance"], 1)
    if environment["kind"] == "upper_half":
        # Rough surfaces alone see it.
        path = nodes.node("LightPath")
        strength = direction.parts()[1] > 0.0
        for name in ("Is Camera Ray", "Is Singular Ray"):
            strength = strength * (1.0 - Number(nodes, path.outputs[name]))
    background = nodes.node("Background", color, strength)
    nodes.node("OutputWorld", background.outputs[0])
    put(world.cycles, "world.cycles", sampling_method="MANUAL", sample_map_resolution=resolution,
        max_bounces=1024)
    bpy.context.scene.world = world
