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

# Python keeps compiled copies beside its modules: not beside ours.
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from cycles_blender import SETTINGS, V, add_object, put, put_if_any  # noqa: E402
from cycles_geometry import (add_exact_spheres, add_mesh, add_mesh_sphere,  # noqa: E402
                             cut_emitter)
from cycles_light import add_environment, add_light  # noqa: E402
from cycles_material import add_material  # noqa: E402



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
        pixel_filter_type="GAUSSIAN" if "filter_width" in dump else "BOX",
        filter_width=dump.get("filter_width", 1.5), use_auto_tile=False)
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
    radius = camera["lens_radius"]
    data.dof.use_dof = radius > 0
    if radius > 0:
        # Cycles: radius of the aperture = focal length in m / (2 f-stop)
        put(data.dof, "lens", focus_distance=camera["focal_distance"],
            aperture_fstop=data.lens * 1e-3 / (2 * radius), aperture_blades=0,
            aperture_ratio=1.0)
    c2w = np.eye(4)
    for k, axis in enumerate(("right", "up", "backward", "eye")):
        c2w[:3, k] = camera[axis]
    bpy.context.scene.camera = add_object("camera", data, c2w)


def rescale(dump):
    """Arrays of numbers, and lengths in a unit in which the scene spans 2 to 4: the rule above is
    not free of units. A power of two, so that nothing is rounded."""
    scale = 2.0 ** math.floor(math.log2(4 / dump["extent"]))
    SETTINGS["scale"] = scale
    for m in dump["meshes"]:
        m["positions"] = scale * np.array(m["positions"], float).reshape(-1, 3, 3)
        if m["normals"] is not None:
            m["normals"] = np.array(m["normals"], float).reshape(-1, 3, 3)
        m["uv"] = np.array(m["uv"], float).reshape(-1, 3, 2) if "uv" in m else None
    for s in dump["spheres"]:
        s["centre"], s["radius"] = [scale * x for x in s["centre"]], scale * s["radius"]
    for light in dump["lights"]:
        if "position" in light:
            light["position"] = [scale * x for x in light["position"]]
            light["attenuation"] = [a / scale ** k for k, a in enumerate(light["attenuation"])]
    camera = dump["camera"]
    for key in ("eye", "clip"):
        camera[key] = [scale * x for x in camera[key]]
    for key in ("lens_radius", "focal_distance"):
        camera[key] *= scale


def build(dump):
    if dump["depth"] == 0:
        # No setting of Cycles ends a path at the camera's first hit: let nothing reflect.
        for m in dump["materials"]:
            m["kind"], m["reflectance"] = "diffuse", [0.0, 0.0, 0.0]
            m.pop("reflectance_map", None)
    upper_half = (dump["environment"] or {}).get("kind") == "upper_half"
    if bpy.app.version >= (3, 5, 0) and (dump["lights"] or upper_half) and any(m["kind"] in ("microfacet", "plastic") for m in dump["materials"]):
        raise ValueError("rough metals under lights without area need Blender 3.4: Glossy of later versions has correlated shadowing")
    materials = [add_material(m) for m in dump["materials"]]
    for m in dump["meshes"]:
        corners = m["positions"], m["normals"], m["uv"]
        if any(dump["materials"][m["material"]]["radiance"]):
            positions, normals, uv = cut_emitter(*corners)
            if normals is not None:
                normals /= np.linalg.norm(normals, axis=2, keepdims=True)
            corners = positions, normals, uv
        add_mesh(m["name"], materials[m["material"]], *corners)
    exact = {}
    for s in dump["spheres"]:
        if s["exact"]:
            exact.setdefault(s["material"], []).append(s)
        else:
            add_mesh_sphere(s, dump["materials"][s["material"]]["kind"], materials[s["material"]])
    for index, spheres in exact.items():
        add_exact_spheres(spheres, materials[index])
    for i, light in enumerate(dump["lights"]):
        add_light(i, light)
    if dump["environment"] is not None:
        add_environment(dump["environment"])
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
    if dump["assay_cycles"] != 2:
        raise ValueError(f"{args.scene}: unknown version of the dump")
    images = [dump["environment"]] + [m.get(key) for m in dump["materials"]
                                      for key in ("reflectance_map", "radiance_map")]
    for image in images:
        if image is not None and "file" in image:
            image["file"] = os.path.join(os.path.dirname(os.path.abspath(args.scene)),
                                         image["file"])
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
