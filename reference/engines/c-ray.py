"""c-ray.py SCENE SPP IMAGES OUT: IMAGES independent images of c-ray 0.6 of a scene as `assay export --engine mitsuba` writes it, as one
EXR of moments (tools/docs/formats/moments-exr.md). With DIR in the place of SPP the files for c-ray are written to the folder OUT and
nothing is rendered.

c-ray is its library, libc-ray.so (`make lib` in its sources), where LIBC_RAY or the loader finds it: the program itself writes 8 bits of
sRGB, the library hands out its linear floats. c-ray has no seed: a pixel's samples depend on its number in the frame alone. Image k is
therefore the middle tile of a frame that is 2k + 1 times as high: the same rays, numbers of their own."""
import ctypes
import json
import math
import os
import struct
import sys
import tempfile
import xml.etree.ElementTree as ET

import numpy as np


def value(node, name):
    return node.find(f"*[@name='{name}']").get("value")


def colour(node, name):
    return [float(x) for x in value(node, name).split(",")]


def shader(bsdf, radiance):
    """One of c-ray's nodes. What glows and reflects does one of the two by chance, as its sum of nodes forgets the light."""
    bsdf = bsdf.find("bsdf") if bsdf.get("type") == "twosided" else bsdf
    if bsdf.get("type") == "conductor":
        node = {"type": "metal", "color": colour(bsdf, "specular_reflectance"), "roughness": 0}
    elif bsdf.get("type") == "dielectric":
        node = {"type": "glass", "color": colour(bsdf, "specular_transmittance"), "roughness": 0, "IOR": float(value(bsdf, "int_ior"))}
    elif bsdf.get("type") == "diffuse":
        node = {"type": "diffuse", "color": colour(bsdf, "reflectance")}
    else:
        sys.exit(f"c-ray.py: c-ray has no {bsdf.get('type')}")
    if radiance is None:
        return node
    most = max(node["color"])
    chance = (1 + most) / 2 if most > 0 else 0  # of reflecting: no weight is above 1, with which c-ray's roulette is wrong
    lamp = {"type": "emissive", "color": [x / (1 - chance) for x in radiance], "strength": 1}
    node["color"] = [x / (chance or 1) for x in node["color"]]
    return {"type": "mix", "A": lamp, "B": node, "factor": chance} if most > 0 else lamp


def write_mesh(folder, name, points, normals, node):
    """An OBJ of triangles, three points each, and its entry in the scene; normals may be None."""
    with open(f"{folder}/{name}.obj", "w") as f:
        print(f"mtllib any.mtl\no {name}\nusemtl any", file=f)
        np.savetxt(f, points, "v %.9g %.9g %.9g")
        if normals is not None:
            np.savetxt(f, normals, "vn %.9g %.9g %.9g")
        for i in range(1, len(points), 3):
            print("f", *(k if normals is None else f"{k}/{k}/{k}" for k in range(i, i + 3)), file=f)
    return {"fileName": f"{name}.obj", "materials": [{"replace": "any", **node}]}


def translate(path, folder):
    """Writes scene.json for c-ray, and the OBJ files of its meshes; returns the image's width and height."""
    scene, here = ET.parse(path).getroot(), os.path.dirname(path) or "."
    sensor, bsdfs = scene.find("sensor"), {b.get("id"): b for b in scene.findall("bsdf")}
    fov, film = float(value(sensor, "fov")), sensor.find("film")
    width, height = int(value(film, "width")), int(value(film, "height"))
    camera = {"FOV": fov, "transforms": []}
    if sensor.get("type") == "thinlens":
        # c-ray's focal length, of a sensor 36 mm wide by a formula of its own, over twice the f-number is the radius of the lens.
        camera["fstops"] = 0.25 * 0.036 / math.radians(fov / 2) / float(value(sensor, "aperture_radius"))
        camera["focalDistance"] = float(value(sensor, "focus_distance"))
    # The world as the camera sees it: c-ray's stays at the origin and has, as Mitsuba's, +X to the left, +Y up, +Z ahead.
    to_world = np.array(sensor.find("transform/matrix").get("value").split(), float).reshape(4, 4)
    axes, eye = to_world[:3, :3], to_world[:3, 3]
    meshes, balls = [], []
    for shape in scene.findall("shape"):
        lamp = shape.find("emitter")
        node = shader(bsdfs[shape.find("ref").get("id")], None if lamp is None else colour(lamp, "radiance"))
        if shape.get("type") == "sphere":
            at = (np.array([shape.find("point").get(k) for k in "xyz"], float) - eye) @ axes
            balls.append({"type": "sphere", "radius": float(value(shape, "radius")), "material": node,
                          "instances": [{"transforms": [{"type": "translate", **dict(zip("xyz", at))}]}]})
            continue
        with open(f"{here}/{value(shape, 'filename')}", "rb") as f:
            head, body = f.read().split(b"end_header\n", 1)
        size, count = head.count(b"property float"), int(head.split(b"element vertex ")[1].split()[0])
        vertices = np.frombuffer(body, "<f4", size * count).reshape(count, size).astype(float)
        points = (vertices[:, :3] - eye) @ axes
        meshes.append(write_mesh(folder, f"mesh{len(meshes)}", points, vertices[:, 3:] @ axes if size > 3 else None, node))
        if lamp is not None:
            # c-ray's lamps glow on both sides: a black back, as far behind as c-ray lets its rays start.
            a, b, c = points[0::3], points[1::3], points[2::3]
            normal = np.cross(b - a, c - a)
            normal *= 1e-4 * np.linalg.norm(np.ptp(points, 0)) / np.maximum(np.linalg.norm(normal, axis=1), 1e-30)[:, None]
            meshes.append(write_mesh(folder, f"mesh{len(meshes)}", points - np.repeat(normal, 3, 0), None,
                                     {"type": "diffuse", "color": [0, 0, 0]}))
    for emitter in scene.findall("emitter"):
        sys.exit(f"c-ray.py: c-ray has no light of the kind '{emitter.get('type')}'")
    with open(f"{folder}/any.mtl", "w") as f:
        print("newmtl any", file=f)
    depth, black = int(value(scene.find("integrator"), "max_depth")) - 1, {"r": 0, "g": 0, "b": 0}
    with open(f"{folder}/scene.json", "w") as f:
        json.dump({"renderer": {"bounces": depth, "width": width, "height": height, "tileWidth": width, "tileHeight": height,
                                "tileOrder": "fromMiddle", "threads": 1}, "camera": camera,
                   "scene": {"ambientColor": {"type": "background", "color": black}, "primitives": balls, "meshes": meshes}}, f, indent=1)
    return width, height


class Bitmap(ctypes.Structure):  # struct cr_bitmap
    _fields_ = [("colourspace", ctypes.c_int), ("precision", ctypes.c_int), ("floats", ctypes.c_void_p), ("channels", ctypes.c_size_t)]


class Progress(ctypes.Structure):  # struct cr_renderer_cb_info
    _fields_ = [(n, ctypes.c_size_t) for n in ("bitmap", "tiles", "num_tiles", "threads")] + [("us", ctypes.c_double)] + [
        (n, ctypes.c_int64) for n in ("speed", "eta", "passes")] + [("done", ctypes.c_double)]


REPORT = ctypes.CFUNCTYPE(None, ctypes.POINTER(Progress), ctypes.c_void_p)
CALLS = {"new_renderer": [], "load_json": [ctypes.c_char_p], "renderer_set_num_pref": [ctypes.c_int, ctypes.c_uint64],
         "renderer_set_callback": [ctypes.c_int, REPORT, ctypes.c_void_p], "renderer_render": [], "renderer_stop": [],
         "renderer_get_result": [], "destroy_renderer": []}


def load():
    ctypes.CDLL("libm.so.6", ctypes.RTLD_GLOBAL)  # libc-ray.so does not name what it needs
    try:
        c = ctypes.CDLL(os.environ.get("LIBC_RAY") or "libc-ray.so")
    except OSError as e:
        sys.exit(f"c-ray.py: {e} (LIBC_RAY says where it is)")
    for name, more in CALLS.items():
        getattr(c, f"cr_{name}").argtypes = [ctypes.c_void_p, *more] if name != "new_renderer" else []
    c.cr_new_renderer.restype, c.cr_load_json.restype = ctypes.c_void_p, ctypes.c_bool
    c.cr_renderer_get_result.restype = ctypes.POINTER(Bitmap)
    c.cr_get_version.restype = ctypes.c_char_p
    c.cr_log_level_set(0)
    return c


def render(c, scene, spp, width, height, k):
    """Image k: rows from the top, RGB."""
    r = c.cr_new_renderer()
    if not c.cr_load_json(r, scene.encode()):
        sys.exit(f"c-ray.py: c-ray does not read {scene}")
    c.cr_renderer_set_num_pref(r, 1, spp)  # cr_renderer_samples
    c.cr_renderer_set_num_pref(r, 7, (2 * k + 1) * height)  # cr_renderer_override_height

    @REPORT
    def report(progress, _):  # a second tile that was begun means that the first is done
        if progress[0].done * progress[0].num_tiles > 1.5:
            c.cr_renderer_stop(r)
    c.cr_renderer_set_callback(r, 2, report, None)  # cr_cb_status_update
    c.cr_renderer_render(r)
    bitmap = c.cr_renderer_get_result(r)[0]
    size = 4 * height * width * bitmap.channels
    image = np.frombuffer(ctypes.string_at(bitmap.floats + k * size, size), "f4").reshape(height, width, bitmap.channels)[..., :3]
    c.cr_destroy_renderer(r)
    return image.astype(float)


def write_moments(path, images, spp):
    """An EXR without compression: the image's rows, of each its channels by name."""
    height, width = images[0].shape[:2]
    mean, away = np.mean(images, 0), images - np.mean(images, 0)
    planes = {m + c: x[..., i] for m, x in (("", mean), ("M2.", (away**2).sum(0)), ("M3.", (away**3).sum(0))) for i, c in enumerate("RGB")}
    planes["n"] = np.full((height, width), len(images))
    names, box = sorted(planes), struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = struct.pack("<2i", 20000630, 2)
    for name, kind, data in (
            ("channels", "chlist", b"".join(c.encode() + struct.pack("<B4i", 0, 2, 0, 1, 1) for c in names) + b"\0"),
            ("compression", "compression", b"\0"), ("dataWindow", "box2i", box), ("displayWindow", "box2i", box),
            ("lineOrder", "lineOrder", b"\0"), ("pixelAspectRatio", "float", struct.pack("<f", 1)),
            ("screenWindowCenter", "v2f", bytes(8)), ("screenWindowWidth", "float", struct.pack("<f", 1)),
            ("assay:unit", "string", b"replicate"), ("assay:spp", "string", b"%d" % spp)):
        head += f"{name}\0{kind}\0".encode() + struct.pack("<i", len(data)) + data
    head += b"\0"
    line = 4 * width * len(names)
    with open(path, "wb") as f:
        f.write(head + struct.pack(f"<{height}Q", *(len(head) + 8 * height + y * (8 + line) for y in range(height))))
        for y in range(height):
            f.write(struct.pack("<2i", y, line) + np.array([planes[c][y] for c in names], "<f4").tobytes())


def main():
    if sys.argv[1:] == ["--version"]:
        print("c-ray", load().cr_get_version().decode())
        return
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    scene, spp, images, out = sys.argv[1:]
    if spp == "DIR":
        translate(scene, out)
        return
    c = load()
    with tempfile.TemporaryDirectory() as folder:
        size = translate(scene, folder)
        write_moments(out, np.array([render(c, f"{folder}/scene.json", int(spp), *size, k) for k in range(int(images))]), int(spp))


if __name__ == "__main__":
    main()
