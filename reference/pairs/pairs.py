#!/usr/bin/env python3
"""pairs.py DIR [--without SCENE:LEVEL]: writes the scenes 5x and 6x of the suite, which together hold all pairs of levels
of the factors below, each as NN_name.dae, .json and .md; with --without that one scene with the level switched off.

Sixteen scenes: an orthogonal array of the field of four elements, so that each two of its five columns (lights, world,
camera, depth, floor and mosaic) hold all sixteen combinations. Materials, geometries and, in the world "here", transforms go round the
eight objects of each scene from one to the next."""
import argparse
import math
import os
import struct
import sys
import zlib

from pairs_mesh import GEOMETRY, box, corners, quad
from pairs_text import json_text, page
from pairs_transform import (IDENTITY, apply, look, multiply, rotate, scale, text, translate)

LIGHTS = ("image", "many", "ambient", "points")
WORLDS = ("here", "far", "small", "large")
CAMERAS = ("near", "lens_tall", "far_tall", "lens_clip")
DEPTHS = (1, 3, 8, 24)
LIGHT_LEVELS = {"image": ("sky_image", "area_one_sided", "lamp_sphere"),
                "many": ("sky_constant", "area_two_sided", "lamp_mesh", "many"),
                "ambient": ("ambient", "point_constant"),
                "points": ("point_linear", "point_quadratic", "spot", "sun")}
CAMERA_LEVELS = {"near": ("pinhole", "wide", "near"),
                 "lens_tall": ("lens", "tall", "odd_size"),
                 "far_tall": ("pinhole", "tall", "far_clip", "odd_size"),
                 "lens_clip": ("lens", "wide", "near", "far_clip", "odd_size")}
SIZES = {"near": (48, 36), "lens_tall": (39, 52), "far_tall": (36, 48), "lens_clip": (52, 39)}
MATERIALS = ("diffuse", "mirror", "refraction", "glass", "coloured_glass", "ggx", "beckmann")
GEOMETRIES = ("box", "sphere", "smooth", "instances", "slivers")
TRANSFORMS = ("rigid", "mirrored", "uneven")
FLOORS = ("plain", "texture_nearest", "texture_bilinear")
WRAPS = {"texture_nearest": ("WRAP", "MIRROR", "NEAREST"), "texture_bilinear": ("CLAMP", "BORDER", "LINEAR")}
# Where Cycles lights random facets by no point light, the sun or the hidden ambient light.
WITHOUT_BECKMANN = ("ambient", "points")
TILES = 17  # a side of the mosaic: 289 materials
EYE, TARGET = (0, 1.9, 3.0), (0, 0.33, -0.1)
FAR = (12.0, -5.0, 17.0)
RADIUS = 0.215

# x * y in the field of four elements; addition is exclusive or.
TIMES = ((0, 0, 0, 0), (0, 1, 2, 3), (0, 2, 3, 1), (0, 3, 1, 2))


def rows():
    """(number, lights, world, camera, depth, has mosaic, floor)"""
    for i in range(16):
        a, b = divmod(i, 4)
        last = a ^ TIMES[3][b]
        floor = FLOORS[(1 + a % 2, 1, 2, 0)[last]]
        yield (50 + i, LIGHTS[a], WORLDS[b], CAMERAS[a ^ b], DEPTHS[a ^ TIMES[2][b]], last == 0, floor)


def tag(element, body, **attributes):
    return f"<{element}{''.join(f' {k}={chr(34)}{v}{chr(34)}' for k, v in attributes.items())}>{body}</{element}>"


def numbers(*values):
    return " ".join(f"{v:.6g}" for v in values)


def extra(body, profile="ASSAY"):
    return tag("extra", tag("technique", body, profile=profile))


def shine(material, colour, number):
    """The body of an effect; `colour` in 0..1 tints it."""
    grey = [0.25 + 0.65 * c for c in colour]
    common = [0.0, 0.0, 0.0]
    kinds = {
        "mirror": tag("mirror", tag("reflectance", numbers(*grey))),
        "refraction": tag("refraction", tag("transmittance", numbers(*grey)) + tag("ior", "1.3")),
        "glass": tag("glass", tag("reflectance", "1 1 1") + tag("transmittance", "1 1 1") + tag("ior", "1.5")),
        "coloured_glass": tag("glass", tag("reflectance", "0.6 0.8 1") + tag("transmittance", numbers(*grey)) +
                              tag("ior", "1.6")),
        "ggx": tag("microfacet", tag("shadowing", "separable") + tag("alpha", "0.3") +
                   tag("reflectance", numbers(*grey))),
        "beckmann": tag("microfacet", tag("distribution", "beckmann") +
                        (tag("shadowing", "separable") + tag("alpha", "0.2") + tag("reflectance", numbers(*[g / 2 for g in grey]))
                         if number % 2 else
                         tag("alpha", "0.25") + tag("eta", "0.14 0.37 1.44") + tag("k", "3.98 2.38 1.6")))}
    if material == "diffuse":
        common = grey
    lambert = tag("lambert", tag("diffuse", tag("color", numbers(*common, 1))))
    return tag("profile_COMMON", tag("technique", lambert, sid="c")) + \
        (extra(kinds[material]) if material in kinds else "")


class Scene:
    """One row, written as text; `off` is a level that is left out."""

    def __init__(self, row, off=None):
        self.number, self.lights, self.world, self.camera, self.depth, self.mosaic, self.floor = row
        self.row, self.off = row, off
        self.name = f"{self.number}_{self.lights}_{self.world}"
        self.cgl = self.lights == "ambient"
        self.effects, self.geometries, self.light_library, self.nodes = [], {}, [], []
        self.corners = {"seen": [], "near": [], "far_clip": []}
        self.size = {"small": 1e-3, "large": 1e3}.get(self.world, 1.0)
        # Large: by the file's unit, which the assignment's dialect does not have.
        self.unit = 1e3 if self.world == "large" and not self.cgl else 1.0
        self.root = multiply(translate(FAR if self.world == "far" else (0, 0, 0)),
                             scale(*[self.size / self.unit] * 3))
        self.materials = [m for m in MATERIALS if m != "beckmann" or self.lights not in WITHOUT_BECKMANN]
        self.levels = {}
        self.build()

    # Parts.

    def material(self, name, body):
        if all(n != name for n, _ in self.effects):
            self.effects.append((name, body))
        return name

    def diffuse(self, name, *colour):
        return self.material(name, tag("profile_COMMON", tag("technique", tag("lambert", tag(
            "diffuse", tag("color", numbers(*colour, 1)))), sid="c")))

    def textured(self, name, wrap_s, wrap_t, filter_):
        sampler = tag("sampler2D", tag("source", "surface") + tag("wrap_s", wrap_s) + tag("wrap_t", wrap_t) +
                      tag("minfilter", filter_) + tag("magfilter", filter_))
        return self.material(name, tag("profile_COMMON", tag("newparam", tag("surface", tag(
            "init_from", "picture"), type="2D"), sid="surface") + tag("newparam", sampler, sid="sampler") + tag(
                "technique", tag("lambert", tag("diffuse", tag("texture", "", texture="sampler", texcoord="UV"))), sid="c")))

    def glow(self, name, radiance, sides):
        black = tag("lambert", tag("diffuse", tag("color", "0 0 0 1")))
        return self.material(name, tag("profile_COMMON", tag("technique", black, sid="c")) + extra(tag(
            "emission", tag("radiance", numbers(*radiance)) + tag("sides", sides))))

    def geometry(self, name, mesh):
        self.geometries.setdefault(name, mesh)
        return name

    def put(self, name, geometry, bind, matrix, part="seen", root=None):
        """An instance; bind: of symbol to material."""
        root = self.root if root is None else root
        mesh = self.geometries[geometry]
        if root is self.root:
            self.corners[part] += [apply(multiply(root, matrix), p) for p in corners(mesh)]
        instance = tag("instance_geometry", tag("bind_material", tag("technique_common", "".join(
            f'<instance_material symbol="{s}" target="#M{m}"' +
            ('><bind_vertex_input semantic="UV" input_semantic="TEXCOORD" input_set="0"/></instance_material>'
             if mesh.uv else "/>") for s, m in bind))), url="#G" + geometry)
        if geometry == "instances":
            instance = self.clump(bind)
        self.nodes.append(tag("node", tag("matrix", text(multiply(root, matrix))) + instance, name=name))

    def clump(self, bind):
        """256 instances of a ball of 128 triangles, by instances of rows of instances."""
        material = bind[0][1]
        if ("ball_" + material) not in self.library:
            one = tag("instance_geometry", tag("bind_material", tag("technique_common", tag(
                "instance_material", "", symbol="m", target="#M" + material))), url="#Ginstances")
            self.library["ball_" + material] = one
            steps = [(-0.75 + 0.5 * i) for i in range(4)]
            grid = [(x, z) for x in steps for z in steps]
            rise = [(0.03 * ((i * 7) % 5), 0.03 * ((i * 3) % 7)) for i in range(16)]
            self.library["row_" + material] = "".join(tag("node", tag("translate", numbers(
                0.13 * (i - 7.5), 0.12 * math.sin(i), 0.12 * math.cos(2 * i))) + one) for i in range(16))
            self.library["clump_" + material] = "".join(tag("node", tag("translate", numbers(
                rise[i][0] - 0.06, 0.9 * grid[i][0], 0.9 * grid[i][1])) + tag("rotate", numbers(
                    0, 1, 0, 23 * i)) + f'<instance_node url="#Nrow_{material}"/>') for i in range(16))
        return f'<instance_node url="#Nclump_{material}"/>'

    def other(self, material):
        """What stands for a material that is left out."""
        return material if self.is_on(material) else "mirror" if material == "diffuse" else "diffuse"

    def is_on(self, level):
        return level != self.off

    def light(self, name, body, matrix):
        self.light_library.append(tag("light", body, id="L" + name))
        self.nodes.append(tag("node", tag("matrix", text(multiply(self.root, matrix))) +
                              f'<instance_light url="#L{name}"/>', name=name))

    # The whole.

    def build(self):
        self.library = {}
        self.objects()
        self.depth_meter()
        self.clipped()
        getattr(self, "lights_" + self.lights)()

    def transform(self, level, where, k, geometry):
        """From unit size to the floor's; turned, then mirrored or scaled along axes that it is not aligned with."""
        turned = multiply(multiply(rotate((0, 1, 0), 25 + 40 * k), rotate((1, 0, 0), 20)), translate((0.15, 0, 0)))
        if geometry == "mosaic":
            turned = multiply(multiply(rotate((0, 1, 0), 15), rotate((1, 0, 0), 60)), scale(1.25, 1.25, 1.25))
        if level == "rigid" and not self.is_on("rigid"):
            turned = IDENTITY
        uneven = {"mirrored": (-1, 1, 1), "uneven": (0.75, 1.2, 0.9)}.get(level if self.is_on(level) else "", (1, 1, 1))
        return multiply(multiply(translate(where), scale(*[RADIUS * u for u in uneven])), turned)

    def objects(self):
        uv = None
        if self.has_texture():
            self.textured("floor", *WRAPS[self.floor])
            uv = [(-0.6, -0.4), (1.7, -0.4), (1.7, 1.3), (-0.6, 1.3)]
        else:
            self.diffuse("floor", 0.55, 0.5, 0.45)
        self.geometry("floor", quad((-1.2, 0, 0.6), (2.4, 0, 0), (0, 0, -1.4), uv))
        # A world that is left out, of the objects alone.
        root = self.root if self.is_on(self.world) else scale(*[1 / self.unit] * 3)
        plan = [(self.materials[k % len(self.materials)],
                 GEOMETRIES[(k % len(self.materials) + self.number + (k >= 7)) % len(GEOMETRIES)]) for k in range(8)]
        if self.mosaic:
            mosaics = TRANSFORMS if self.world == "here" else ("rigid",)
            for j, transform in enumerate(mosaics):
                plan[(2, 5, 7)[j]] = ("mosaic", "mosaic")
        order = [k for k in range(8) if plan[k][1] == "mosaic"] + [k for k in range(8) if plan[k][1] != "mosaic"]
        count = 0
        for k in order:
            material, geometry = plan[k]
            x, z = -0.75 + 0.5 * (k % 4), 0.25 - 0.55 * (k // 4)
            level = TRANSFORMS[(k + self.number // 4) % 3] if self.world == "here" else "rigid"
            if geometry == "mosaic":
                level = TRANSFORMS[count] if self.world == "here" else "rigid"
                count += 1
            if geometry == "sphere" and level == "uneven":
                level = "mirrored"
            self.levels.setdefault("objects", []).append(
                (material, geometry, level if self.world == "here" else self.world))
            m = self.transform(level, (x, 0.27, z), k, geometry)
            name = f"{material}_{k}"
            # Left out: without its normals, one tile, one ball; others are gone.
            shown = geometry if self.is_on(geometry) else {
                "smooth": "flat", "mosaic": "board", "instances": "ball"}.get(geometry)
            if shown is None:
                continue
            self.geometry(shown, GEOMETRY[shown]() if shown != "mosaic" else GEOMETRY[shown](TILES))
            if geometry == "mosaic":
                bind = [(f"m{i}", self.tile(i)) for i in range(TILES * TILES)]
                if shown == "board":
                    bind = [("m", self.tile(0))]
            else:
                colour = [(0.3 + 0.37 * k * c) % 1 for c in (1, 1.7, 2.3)]
                bind = [("m", self.material(name, shine(
                    self.other(material), colour, self.number)))]
            self.put(name, shown, bind, m, root=root)
        self.put("floor", "floor", [("m", "floor")], IDENTITY)

    def tile(self, i):
        kind = self.other(self.materials[i % len(self.materials)])
        # Left out: all tiles as the first.
        j = i if self.is_on("mosaic") else 0
        return self.material(f"t{j}", shine(kind if j else "diffuse", [(j * s) % 97 / 97 for s in (13, 29, 41)], self.number))

    def depth_meter(self):
        """Parallel mirrors before a glowing sheet, which the eye sees along their diagonal: after as many reflections as
        paths may have, a few more, a few fewer."""
        if self.depth == 1:
            return
        gap = max(0.06, 0.6 / self.depth)
        length, height = gap * self.depth, 0.3
        front = (-0.2, 0.72, -0.75)
        # The assignment's viewer stands off, in about the same direction.
        off = 1.5 if self.cgl else 0
        v = [t - e - off * (e - a) for t, e, a in zip(front, EYE, TARGET)]
        norm = math.sqrt(sum(x * x for x in v))
        v = [x / norm for x in v]
        w = (1, 0, 0)
        along = [(a - b) / math.sqrt(2) for a, b in zip(v, w)]
        across = [(a + b) / math.sqrt(2) for a, b in zip(v, w)]
        up = [across[1] * along[2] - across[2] * along[1], across[2] * along[0] - across[0] * along[2],
              across[0] * along[1] - across[1] * along[0]]
        plates = max(1, round(0.5 / gap))
        self.material("plate", tag("profile_COMMON", tag("technique", tag("lambert", tag("diffuse", tag(
            "color", "0 0 0 1"))), sid="c")) + extra(tag("mirror", tag("reflectance", "1 1 1"))))
        dark = 0.3 if self.lights in WITHOUT_BECKMANN else 1
        self.glow("sheet", [dark * c for c in (1.6, 1.3, 1.0)], 1)
        half = [f - 0.5 * plates * gap * a - 0.5 * height * u for f, a, u in zip(front, across, up)]
        self.geometry("plate", quad((0, 0, 0), [length * x for x in along], [height * x for x in up]))
        for i in range(plates + 1):
            self.put(f"plate_{i}", "plate", [("m", "plate")],
                     translate([h + i * gap * a for h, a in zip(half, across)]))
        end = [h + length * a for h, a in zip(half, along)]
        self.geometry("sheet", quad(end, [plates * gap * x for x in across], [height * x for x in up]))
        self.put("sheet", "sheet", [("m", "sheet")], IDENTITY)

    def clipped(self):
        """Before the near plane and behind the far one: only paths that have bounced meet them."""
        back = [e - t for e, t in zip(EYE, TARGET)]
        norm = math.sqrt(sum(x * x for x in back))
        back = [b / norm for b in back]
        up, right = (0, back[2], -back[1]), (1, 0, 0)
        levels = CAMERA_LEVELS[self.camera]
        for part, where, a, b, colour in (("near", 1.15, 0.45, 0.35, (0.8, 0.3, 0.2)),
                                          ("far_clip", -2.3, 2, 1.4, (0.3, 0.7, 0.4))):
            if part not in levels:
                continue
            self.diffuse(part, *colour)
            corner = [t + where * n - a * r - b * u for t, n, r, u in zip(TARGET, back, right, up)]
            self.geometry(part, quad(corner, [2 * a * r for r in right], [2 * b * u for u in up]))
            self.put(part, part, [("m", part)], IDENTITY, part)

    # Lights. Of lamps with a matrix, mirrored and uneven ones in the world "here".

    def lamp_matrix(self, where, axis, angle, sizes=(1, 1, 1)):
        return multiply(multiply(translate(where), rotate(axis, angle)),
                        scale(*(sizes if self.world == "here" else (1, 1, 1))))

    def lights_image(self):
        if self.is_on("area_one_sided"):
            self.light("rectangle", tag("technique_common", tag("point", tag("color", "1 1 1"))) + extra(tag(
                "rectangle", tag("radiance", "6 5 4") + tag("width", "0.6") + tag("height", "0.4"))),
                self.lamp_matrix((-0.6, 1.5, -0.4), (1, 0, 0), -70, (-1.2, 0.8, 1)))
        if self.is_on("lamp_sphere"):
            self.geometry("lamp_ball", GEOMETRY["sphere"]())
            self.put("lamp_ball", "lamp_ball", [("m", self.glow("lamp_ball", (3, 4, 6), 1))],
                     multiply(self.lamp_matrix((0.8, 1.0, -0.6), (0, 0, 1), 10, (-1, 1, 1)), scale(0.2, 0.2, 0.2)))

    def lights_many(self):
        if self.is_on("area_two_sided"):
            self.geometry("two_sided", quad((-0.3, -0.2, 0), (0.6, 0, 0), (0, 0.4, 0)))
            self.put("two_sided", "two_sided", [("m", self.glow("two_sided", (4, 3, 2), 2))],
                     self.lamp_matrix((-0.65, 1.4, -0.5), (1, 0, 0), 60, (1.1, -0.8, 1)))
        if self.is_on("lamp_mesh"):
            self.geometry("lamp_mesh", box())
            self.put("lamp_mesh", "lamp_mesh", [("m", self.glow("lamp_mesh", (2, 3, 4), 1))],
                     multiply(self.lamp_matrix((0.75, 1.3, -0.5), (0, 1, 1), 30, (0.7, 1.2, 1)), scale(0.16, 0.16, 0.16)))
        if self.is_on("many"):
            self.geometry("spark", quad((-0.07, 0, 0.07), (0, 0, -0.14), (0.14, 0, 0)))
            for i in range(24):
                j = i * 7 % 24
                bright = 24 * 10 ** (-3.3 * j / 23)
                x, z = -0.9 + 0.36 * (i % 6), -0.1 - 0.2 * (i // 6)
                self.put(f"spark_{i}", "spark", [("m", self.glow(
                    f"spark_{i}", (bright, bright * (0.5 + 0.5 * (i % 3) / 2), bright * (0.4 + 0.6 * (i % 2))), 2))],
                    translate((x, 1.6, z)))

    def lights_ambient(self):
        if self.is_on("ambient"):
            self.light("ambient", extra(tag("ambient", tag("color", "0.4 0.45 0.5")), "CGL"), IDENTITY)
        if self.is_on("point_constant"):
            self.light("bulb", extra(tag("point", tag("color", "1.2 1 0.8")), "CGL"), translate((0.5, 1.3, 0.4)))

    def lights_points(self):
        s = self.size / self.unit

        def falloff(constant, linear, quadratic):
            return tag("constant_attenuation", numbers(constant)) + tag("linear_attenuation", numbers(linear / s)) + \
                tag("quadratic_attenuation", numbers(quadratic / s / s))
        if self.is_on("point_linear"):
            self.light("linear", tag("technique_common", tag("point", tag("color", "0.4 0.7 1") + falloff(0, 0.8, 0))),
                       translate((-0.9, 1.2, 0.2)))
        if self.is_on("point_quadratic"):
            self.light("quadratic", tag("technique_common", tag("point", tag("color", "1 0.6 0.3") + falloff(0, 0, 1))),
                       translate((0.2, 0.9, 0.5)))
        if self.is_on("spot"):
            self.light("spot", tag("technique_common", tag("spot", tag("color", "4 4 2.5") + falloff(0.5, 0.7, 0.2) + tag(
                "falloff_angle", "50") + tag("falloff_exponent", "1.5"))),
                self.lamp_matrix((0.9, 1.4, 0.2), (0.7, -0.7, 0), -60, (-0.5, 1.5, 1)))
        if self.is_on("sun"):
            self.light("sun", tag("technique_common", tag("directional", tag("color", "0.9 0.8 0.9"))),
                       self.lamp_matrix((0, 1, 0), (1, 0.3, 0), -50, (1, -0.5, 2)))

    # The files.

    def eye(self):
        """The assignment's viewer stands off by 1.5 diagonals of what it sees."""
        if not self.cgl:
            return apply(self.root, EYE), apply(self.root, TARGET)
        seen = self.corners["seen"] + self.corners["near"] + self.corners["far_clip"]
        low, high = [min(p[i] for p in seen) for i in range(3)], [max(p[i] for p in seen) for i in range(3)]
        centre = [(a + b) / 2 for a, b in zip(low, high)]
        away = 1.5 * math.dist(low, high)
        back = [e - t for e, t in zip(EYE, TARGET)]
        norm = math.dist(EYE, TARGET)
        return [c + away * b / norm for c, b in zip(centre, back)], centre

    def clip(self, eye):
        """Half way between what is cut off and what is not, in the file's unit."""
        seen = [math.dist(eye, p) for p in self.corners["seen"]]
        near, far = 0.3 * min(seen), 3 * max(seen)
        levels = CAMERA_LEVELS[self.camera]
        if "near" in levels:
            cut = max(math.dist(eye, p) for p in self.corners["near"])
            near = (cut + min(seen)) / 2
            if not cut < 0.99 * min(seen):
                sys.exit(f"{self.name}: near {cut} {min(seen)}")
        if "far_clip" in levels:
            cut = self.far_distance(eye)
            far = (cut + max(seen)) / 2
            if not cut > 1.01 * max(seen):
                sys.exit(f"{self.name}: far {cut} {max(seen)}")
        if not self.is_on("near"):
            near *= 0.1
        if not self.is_on("far_clip"):
            far *= 4
        return near, far

    def far_distance(self, eye):
        """Of the plane of the sheet behind."""
        a, b, _, d = self.corners["far_clip"][:4]
        u, v = [y - x for x, y in zip(a, b)], [y - x for x, y in zip(a, d)]
        n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        return abs(sum(k * (e - x) for k, e, x in zip(n, eye, a))) / math.hypot(*n)

    def camera_text(self):
        eye, target = self.eye()
        near, far = self.clip(eye)
        width, height = SIZES[self.camera]
        s = self.size / self.unit
        tan_h = (1.12 if width > height else 1.05) * s / math.dist(eye, target)
        tan_v = tan_h * height / width
        wide = "wide" in CAMERA_LEVELS[self.camera]
        if not self.is_on("wide") or not self.is_on("tall"):
            tan_h, tan_v = tan_v, tan_h
        if self.cgl:
            tan_v = 300 * 2 * tan_v / height
            angles = tag("xfov", numbers(2 * math.degrees(math.atan(tan_v)))) + \
                tag("yfov", f"{2 * math.degrees(math.atan(tan_v)):.9g}")
            # The point (0, 0, -1) of the node is the direction to the eye.
            place = tag("translate", f"{EYE[0] - TARGET[0]:.9g} {EYE[1] - TARGET[1]:.9g} {EYE[2] - TARGET[2] + 1:.9g}")
        else:
            angles = tag("xfov", f"{2 * math.degrees(math.atan(tan_h)):.9g}") if wide else \
                tag("yfov", f"{2 * math.degrees(math.atan(tan_v)):.9g}")
            place = tag("matrix", text(look(eye, target)))
        optics = tag("optics", tag("technique_common", tag("perspective", angles + tag(
            "znear", f"{near:.9g}") + tag("zfar", f"{far:.9g}"))))
        return tag("camera", optics, id="camera"), tag("node", place + '<instance_camera url="#camera"/>', name="eye")

    def dae(self):
        camera, eye = self.camera_text()
        if self.lights == "many" and self.is_on("sky_constant"):
            self.light_library.append(tag("light", tag("technique_common", tag("ambient", tag(
                "color", "0.25 0.3 0.4"))), id="Lsky"))
            self.nodes.append(tag("node", '<instance_light url="#Lsky"/>', name="sky"))
        library = "\n".join(tag("node", body, id="N" + name) for name, body in self.library.items())
        parts = [
            '<?xml version="1.0" encoding="utf-8"?>',
            f"<!-- Made by reference/pairs/pairs.py: {self.name}.md. -->",
            '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">',
            f'<asset><unit name="unit" meter="{self.unit:g}"/><up_axis>Y_UP</up_axis></asset>',
            tag("library_cameras", camera),
            tag("library_lights", "\n".join(self.light_library)) if self.light_library else "",
            tag("library_images", tag("image", tag("init_from", TEXTURE), id="picture")) if self.has_texture() else "",
            tag("library_effects", "\n".join(tag("effect", body, id="E" + name) for name, body in self.effects)),
            tag("library_materials", "\n".join(
                tag("material", f'<instance_effect url="#E{name}"/>', id="M" + name) for name, _ in self.effects)),
            tag("library_geometries", "\n".join(tag("geometry", m.text(n), id="G" + n) for n, m in self.geometries.items())),
            tag("library_nodes", library) if library else "",
            tag("library_visual_scenes", tag("visual_scene", "\n".join(self.nodes + [eye]), id="scene")),
            '<scene><instance_visual_scene url="#scene"/></scene>', "</COLLADA>"]
        return "\n".join(p for p in parts if p) + "\n"

    def settings(self):
        """What the scene's .json says beside titles and references."""
        width, height = SIZES[self.camera]
        depth = self.depth - (self.off == "depth")
        out = {"width": width, "height": height, "depth": depth}
        if self.lights == "image" and self.is_on("sky_image"):
            out["environment"] = "pairs_sky.hdr"
        if self.has_texture():
            out["uses"] = [TEXTURE]
        if "lens" in CAMERA_LEVELS[self.camera] and self.is_on("lens"):
            eye, target = self.eye()
            out["lens_radius"] = float(f"{0.14 * self.size:.6g}")
            out["focal_distance"] = float(f"{1.25 * self.unit * math.dist(eye, target):.6g}")
        return out

    def has_texture(self):
        return self.floor != "plain" and self.is_on(self.floor)

    def all_levels(self):
        """Those that can be left out."""
        objects = self.levels["objects"]
        return sorted({m for m, _, _ in objects} - {"mosaic"}) + sorted({g for _, g, _ in objects}) + \
            sorted({t for _, _, t in objects}) + \
            [f for f in [self.floor] if f != "plain"] + list(LIGHT_LEVELS[self.lights]) + [c for c in CAMERA_LEVELS[self.camera] if c not in ("pinhole", "odd_size")] + \
            ["depth"]


TEXTURE = "pairs_texture.png"


def write_images(folder):
    write_sky(os.path.join(folder, "pairs_sky.hdr"))
    write_texture(os.path.join(folder, TEXTURE))


def write_sky(path):
    """16 x 8, a broad bright side and a red one, in the flat form of Radiance's format."""
    rows_ = bytearray(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n")
    for y in range(8):
        for x in range(16):
            up = math.cos(math.pi * (y + 0.5) / 8)
            side = math.cos(2 * math.pi * (x - 4.5) / 16)
            colour = (0.35 + 0.25 * side + 0.1 * up, 0.35 + 0.15 * up + 0.05 * side, 0.4 + 0.3 * up - 0.1 * side)
            rows_ += bytes([min(255, max(0, round(256 * c))) for c in colour] + [128])
    with open(path, "wb") as f:
        f.write(rows_)


def write_texture(path):
    """5 x 4 texels of all hues, half of the light on the mean; not packed, so that each zlib writes the same bytes."""
    raw = bytearray()
    for y in range(4):
        raw.append(0)
        for x in range(5):
            raw += bytes(130 + (37 * x * x + 71 * y + 97 * c * (x + y)) % 120 for c in range(3))

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 5, 4, 8, 2, 0, 0, 0)) +
                chunk(b"IDAT", zlib.compress(bytes(raw), 0)) + chunk(b"IEND", b""))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("dir")
    parser.add_argument("--without", default=":")
    args = parser.parse_args()
    which, off = args.without.split(":")
    write_images(args.dir)
    for row in rows():
        scene = Scene(row)
        if which and which != scene.name:
            continue
        if off:
            if off not in scene.all_levels():
                sys.exit(f"{scene.name} has no level '{off}', but {' '.join(scene.all_levels())}")
            scene = Scene(row, off)
        write(args.dir, scene)


def write(folder, scene):
    for ending, body in (("dae", scene.dae()), ("json", json_text(scene)), ("md", page(scene))):
        with open(os.path.join(folder, f"{scene.name}.{ending}"), "w", encoding="utf-8") as f:
            f.write(body)


if __name__ == "__main__":
    main()
