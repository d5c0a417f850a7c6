"""Builds a dump of export_cycles() in Blender and renders replicates of it with Cycles.

    blender -b --factory-startup -noaudio --python-exit-code 3 -P cycles.py -- \
        --scene scene.json --spp 256 --threads 2 --seeds seeds.json

seeds.json is an array of 31-bit seeds; replicate k goes to replicate_<k>.exr in the current
directory: float32 RGB, linear radiance. Prints one line per replicate and, if all went well, a last
one that starts with "ASSAY OK " and goes on with JSON: version and settings as read back from
Blender. Verified with 3.4.1; branches for later versions follow their release notes.

Every setting is here for a reason that MATCH_CYCLES.md gives, with the measurement.
"""
import argparse
import json
import math
import os
import sys

import bpy
import numpy as np
from mathutils import Matrix

V = bpy.app.version
ICOSPHERE_LEVEL = 5
# Cycles 3.4 samples a triangle by an inexact solid angle (-1 % at grazing angles) from places
# nearer to its plane than longest edge * 2 area; emitters are cut until that is at most this part
# of their edge.
NEAR_PLANE = 1.5e-5
SETTINGS = {}


def put(owner, path, **values):
    """Sets properties and makes sure that Blender, which clamps in silence, has taken them."""
    for name, value in values.items():
        setattr(owner, name, value)
        got = getattr(owner, name)
        same = math.isclose(got, value, rel_tol=1e-6) if isinstance(value, float) else got == value
        if not same:
            raise ValueError(f"{path}.{name}: {value!r} became {got!r}")
        SETTINGS[f"{path}.{name}"] = got


def put_if_any(owner, path, **values):
    """The same for properties that not every version has."""
    put(owner, path, **{k: v for k, v in values.items() if hasattr(owner, k)})


def set_pattern(cycles):
    """Owen-scrambled Sobol in 3.4. In 4.x that pattern correlates seeds at 1 spp; the table does
    not, but is shown only to developers."""
    if V < (3, 5, 0):
        return put(cycles, "cycles", sampling_pattern="SOBOL")
    if V >= (4, 2, 0):
        bpy.context.preferences.view.show_developer_ui = True
        bpy.context.preferences.experimental.use_cycles_debug = True
    put(cycles, "cycles", sampling_pattern="TABULATED_SOBOL")


def set_options(dump, spp, threads):
    scene = bpy.context.scene
    render = scene.render
    put(render, "render", engine="CYCLES", resolution_x=dump["width"],
        resolution_y=dump["height"], resolution_percentage=100, pixel_aspect_x=1.0,
        pixel_aspect_y=1.0, use_border=False, use_motion_blur=False, use_simplify=False,
        use_compositing=False, use_sequencer=False, film_transparent=False, dither_intensity=0.0,
        use_persistent_data=True, threads_mode="FIXED", threads=threads, use_file_extension=False)
    put(render.image_settings, "image_settings", file_format="OPEN_EXR", color_mode="RGB",
        color_depth="32", exr_codec="ZIP")
    put(scene.view_settings, "view_settings", view_transform="Raw", exposure=0.0, gamma=1.0)
    cycles = scene.cycles
    offset = 1
    while offset < spp:
        offset *= 2
    # Sample 0 is at the pixel's centre in every version. An aligned block keeps its stratification.
    put(cycles, "cycles", device="CPU", feature_set="SUPPORTED", samples=spp,
        sample_offset=offset, use_animated_seed=False, time_limit=0.0, scrambling_distance=1.0,
        auto_scrambling_distance=False, use_adaptive_sampling=False, use_denoising=False,
        light_sampling_threshold=0.0, sample_clamp_direct=0.0, sample_clamp_indirect=0.0,
        blur_glossy=0.0, caustics_reflective=True, caustics_refractive=True, film_exposure=1.0,
        pixel_filter_type="BOX", use_auto_tile=False)
    put_if_any(cycles, "cycles", use_guiding=False, use_light_tree=False, use_fast_gi=False)
    set_pattern(cycles)
    # Cycles counts n + 1 scatterings at max_bounces n. Depth 0 scatters nothing: see main().
    bounces = max(dump["depth"] - 1, 0)
    put(cycles, "cycles", max_bounces=bounces, diffuse_bounces=bounces, glossy_bounces=bounces,
        transmission_bounces=bounces, volume_bounces=0, transparent_max_bounces=1024,
        min_light_bounces=1024, min_transparent_bounces=1024)
    scene.world = None


def add_camera(camera):
    data = bpy.data.cameras.new("camera")
    put(data, "camera", type="PERSP", sensor_fit="HORIZONTAL", sensor_width=36.0,
        lens=18.0 / camera["tan_h"], shift_x=0.0, shift_y=0.0, clip_start=camera["clip"][0],
        clip_end=camera["clip"][1])
    data.dof.use_dof = False
    c2w = np.eye(4)
    for k, axis in enumerate(("right", "up", "backward", "eye")):
        c2w[:3, k] = camera[axis]
    bpy.context.scene.camera = add_object("camera", data, c2w)


def add_object(name, data, matrix=None):
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    if matrix is not None:
        obj.matrix_world = Matrix(matrix.tolist())
    # Fudges that move or bend shadow rays on smooth meshes.
    for name in ("shadow_terminator_geometry_offset", "shadow_terminator_offset"):
        if hasattr(obj.cycles, name):
            setattr(obj.cycles, name, 0.0)
    return obj


def add_material(m):
    """Lambert on both sides; emission on the geometric normal's side or on both."""
    material = bpy.data.materials.new(m["name"])
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*m["reflectance"], 1)
    diffuse.inputs["Roughness"].default_value = 0.0
    surface = diffuse.outputs[0]
    if any(m["radiance"]):
        emission = tree.nodes.new("ShaderNodeEmission")
        emission.inputs["Color"].default_value = (*m["radiance"], 1)
        emission.inputs["Strength"].default_value = 1.0
        add = tree.nodes.new("ShaderNodeAddShader")
        tree.links.new(surface, add.inputs[0])
        tree.links.new(emission.outputs[0], add.inputs[1])
        front = add.outputs[0]
        if not m["both_sides"]:
            geometry = tree.nodes.new("ShaderNodeNewGeometry")
            mix = tree.nodes.new("ShaderNodeMixShader")
            tree.links.new(geometry.outputs["Backfacing"], mix.inputs[0])
            tree.links.new(front, mix.inputs[1])
            tree.links.new(surface, mix.inputs[2])
            front = mix.outputs[0]
        surface = front
        if V < (3, 5, 0):
            material.cycles.sample_as_light = True
        else:
            material.cycles.emission_sampling = "FRONT_BACK"
    out = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(surface, out.inputs["Surface"])
    return material


def cut_triangle(corners, n):
    """[corner, xyz] into n x n congruent triangles."""
    uv = []
    for i in range(n):
        for j in range(n - i):
            uv.append(((i, j), (i + 1, j), (i, j + 1)))
            if i + j < n - 1:
                uv.append(((i + 1, j), (i + 1, j + 1), (i, j + 1)))
    uv = np.array(uv, float) / n
    a, b, c = corners
    return a + uv[..., :1] * (b - a) + uv[..., 1:] * (c - a)


def cut_emitter(positions, normals):
    """Triangles [t, corner, xyz] into as many pieces as exact sampling takes."""
    pieces = []
    for k, p in enumerate(positions):
        area2 = np.linalg.norm(np.cross(p[1] - p[0], p[2] - p[0]))
        n = max(1, math.ceil((area2 / NEAR_PLANE) ** (1 / 3)))
        pieces.append((cut_triangle(p, n),
                       None if normals is None else cut_triangle(normals[k], n)))
    positions = np.concatenate([p for p, _ in pieces])
    if normals is not None:
        normals = np.concatenate([n for _, n in pieces])
        normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    return positions, normals


def add_mesh(name, material, positions, normals=None):
    """[t, corner, xyz]. Triangles share no vertices: Cycles keeps one normal per vertex."""
    mesh = bpy.data.meshes.new(name)
    count = len(positions)
    mesh.from_pydata(positions.reshape(-1, 3).tolist(), [],
                     np.arange(3 * count).reshape(-1, 3).tolist())
    if len(mesh.polygons) != count:
        raise ValueError(f"{name}: {count} triangles became {len(mesh.polygons)}")
    mesh.materials.append(material)
    mesh.polygons.foreach_set("use_smooth", [normals is not None] * count)
    if normals is not None:
        if V < (4, 1, 0):
            mesh.use_auto_smooth = True
            mesh.auto_smooth_angle = math.pi
        mesh.normals_split_custom_set(normals.reshape(-1, 3).tolist())
    mesh.update()
    return add_object(name, mesh)


def unit_icosphere(level):
    """[t, corner, xyz] with all corners on the unit sphere, counter-clockwise from outside.
    Neighbours are near each other in the list too: Cycles picks an emitter by its place there, and
    well spread numbers should pick well spread places."""
    g = (1 + 5 ** 0.5) / 2
    v = np.array([(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
                  (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)])
    f = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
         (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9),
         (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    t = (v / np.linalg.norm(v[0]))[np.array(f)]
    for _ in range(level):
        mid = t + np.roll(t, -1, axis=1)
        mid /= np.linalg.norm(mid, axis=2, keepdims=True)
        a, b, c = t[:, 0], t[:, 1], t[:, 2]
        ab, bc, ca = mid[:, 0], mid[:, 1], mid[:, 2]
        t = np.stack([np.stack(q, axis=1) for q in
                      ((a, ab, ca), (ab, bc, ca), (b, bc, ab), (c, ca, bc))], axis=1)
        t = t.reshape(-1, 3, 3)
    return t


def add_mesh_sphere(sphere, material):
    """Finely cut, with exact normals, and the sphere's own area: a convex body's mean projected
    area is a quarter of its surface, so coverage and emitted power are right on average."""
    t = unit_icosphere(ICOSPHERE_LEVEL)
    area = np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1).sum() / 2
    if sphere["normal_out"] < 0:
        t = t[:, ::-1]
    radius = sphere["radius"] * math.sqrt(4 * math.pi / area)
    add_mesh(sphere["name"], material, np.array(sphere["centre"]) + radius * t,
             sphere["normal_out"] * t)


def add_exact_spheres(spheres, material):
    """Points of a cloud, which Cycles intersects as spheres."""
    mesh = bpy.data.meshes.new("spheres")
    mesh.from_pydata([s["centre"] for s in spheres], [], [])
    mesh.attributes.new("assay_radius", "FLOAT", "POINT").data.foreach_set(
        "value", [s["radius"] for s in spheres])
    group = bpy.data.node_groups.new("spheres", "GeometryNodeTree")
    if V < (4, 0, 0):
        group.inputs.new("NodeSocketGeometry", "Geometry")
        group.outputs.new("NodeSocketGeometry", "Geometry")
    else:
        for way in ("INPUT", "OUTPUT"):
            group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    first, last = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    points = group.nodes.new("GeometryNodeMeshToPoints")
    paint = group.nodes.new("GeometryNodeSetMaterial")
    radius = group.nodes.new("GeometryNodeInputNamedAttribute")
    radius.data_type = "FLOAT"
    radius.inputs["Name"].default_value = "assay_radius"
    paint.inputs["Material"].default_value = material
    value = next(o for o in radius.outputs if o.name == "Attribute" and o.enabled)
    group.links.new(first.outputs[0], points.inputs["Mesh"])
    group.links.new(value, points.inputs["Radius"])
    group.links.new(points.outputs[0], paint.inputs["Geometry"])
    group.links.new(paint.outputs[0], last.inputs[0])
    add_object("spheres", mesh).modifiers.new("spheres", "NODES").node_group = group


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


def use_constant_falloff(lamp):
    lamp.use_nodes = True
    tree = lamp.node_tree
    tree.nodes.clear()
    falloff = tree.nodes.new("ShaderNodeLightFalloff")
    falloff.inputs["Strength"].default_value = 1.0
    falloff.inputs["Smooth"].default_value = 0.0
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Color"].default_value = (1, 1, 1, 1)
    out = tree.nodes.new("ShaderNodeOutputLight")
    tree.links.new(falloff.outputs["Constant"], emission.inputs["Strength"])
    tree.links.new(emission.outputs[0], out.inputs["Surface"])


def add_light(i, light):
    name, matrix = f"light_{i}", np.eye(4)
    if light["kind"] == "point":
        if not any(light["intensity"]):
            return
        matrix[:3, 3] = light["position"]
        lamp = add_lamp(name, "POINT", matrix, 4 * math.pi, light["intensity"],
                        shadow_soft_size=0.0)
        if light["falloff"] == "constant":
            use_constant_falloff(lamp)
        elif light["falloff"] != "quadratic":
            raise ValueError(f"unknown falloff {light['falloff']!r}")
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


def rescale(dump):
    """Arrays of numbers, and lengths in a unit in which the scene spans 2 to 4: the rule above is
    not free of units. A power of two, so that nothing is rounded."""
    scale = 2.0 ** math.floor(math.log2(4 / dump["extent"]))
    SETTINGS["scale"] = scale
    for m in dump["meshes"]:
        m["positions"] = scale * np.array(m["positions"], float).reshape(-1, 3, 3)
        if m["normals"] is not None:
            m["normals"] = np.array(m["normals"], float).reshape(-1, 3, 3)
    for s in dump["spheres"]:
        s["centre"], s["radius"] = [scale * x for x in s["centre"]], scale * s["radius"]
    for light in dump["lights"]:
        if light["kind"] == "point":
            light["position"] = [scale * x for x in light["position"]]
            if light["falloff"] == "quadratic":
                light["intensity"] = [scale * scale * x for x in light["intensity"]]
    for key in ("eye", "clip"):
        dump["camera"][key] = [scale * x for x in dump["camera"][key]]


def build(dump):
    if dump["depth"] == 0:
        # No setting of Cycles ends a path at the camera's first hit: let nothing reflect.
        for m in dump["materials"]:
            m["reflectance"] = [0.0, 0.0, 0.0]
    materials = [add_material(m) for m in dump["materials"]]
    for m in dump["meshes"]:
        positions, normals = m["positions"], m["normals"]
        if any(dump["materials"][m["material"]]["radiance"]):
            positions, normals = cut_emitter(positions, normals)
        add_mesh(m["name"], materials[m["material"]], positions, normals)
    exact = {}
    for s in dump["spheres"]:
        if s["exact"]:
            exact.setdefault(s["material"], []).append(s)
        else:
            add_mesh_sphere(s, materials[s["material"]])
    for index, spheres in exact.items():
        add_exact_spheres(spheres, materials[index])
    for i, light in enumerate(dump["lights"]):
        add_light(i, light)
    add_camera(dump["camera"])


def main():
    parser = argparse.ArgumentParser(prog="cycles.py")
    parser.add_argument("--scene", required=True)
    parser.add_argument("--spp", type=int, required=True)
    parser.add_argument("--threads", type=int, required=True)
    parser.add_argument("--seeds", required=True)
    args = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])
    with open(args.scene, encoding="utf-8") as f:
        dump = json.load(f)
    with open(args.seeds, encoding="utf-8") as f:
        seeds = json.load(f)
    if dump["assay_cycles"] != 1:
        raise ValueError(f"{args.scene}: unknown version of the dump")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    rescale(dump)
    set_options(dump, args.spp, args.threads)
    build(dump)
    scene = bpy.context.scene
    for k, seed in enumerate(seeds):
        scene.cycles.seed = seed
        if scene.cycles.seed != seed:
            raise ValueError(f"seed {seed} became {scene.cycles.seed}")
        scene.render.filepath = os.path.join(os.getcwd(), f"replicate_{k:04d}.exr")
        bpy.ops.render.render(write_still=True)
        print(f"ASSAY replicate {k + 1}/{len(seeds)} seed {seed}", flush=True)
    print("ASSAY OK " + json.dumps({"version": "Blender " + bpy.app.version_string,
                                    "replicates": len(seeds), "settings": SETTINGS}), flush=True)


main()
