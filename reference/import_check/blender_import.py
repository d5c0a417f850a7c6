"""Reads COLLADA files with Blender's own importer and dumps what it made of them, in world space.

    blender -b --factory-startup -noaudio --python-exit-code 3 -P blender_import.py -- --jobs jobs.json

jobs.json is an array of {"dae": path, "width": pixels, "height": pixels}; file k goes to
import_<k>.json in the current directory:

    {"up_axis": "Y_UP" as the file says,
     "num_ambient": lights of the file that are ambient, of which Blender makes suns,
     "meshes": [{"name", "sizes": corners of each polygon, "corners": [x,y,z, ...] of all of them,
                 "normals": the same of shading normals, or null where Blender made its own,
                 "custom": they are the file's, else the faces'}],
     "cameras": [{"name", "right", "up", "backward", "eye", "tan_h": half width of the image plane
                  at distance 1} or, placed by <lookat>, which Blender does not read, {"name"}],
     "lights": [{"name", "kind": "POINT" ..., "position", "direction": it shines in}]}

or {"error": line}. Coordinates are Blender's: metres, Z up, as its importer turned them. Nothing of
the reader under test is used here. The last line on success starts with "ASSAY OK ".
"""
import argparse
import json
import sys
import xml.etree.ElementTree as ElementTree

import bpy
import numpy as np


def elements(path, tag):
    return [e for e in ElementTree.parse(path).iter() if e.tag.rpartition("}")[2] == tag]


def up_axis(path):
    found = elements(path, "up_axis")
    return found[0].text.strip() if found else "Y_UP"


def num_ambient(path):
    return sum(child.tag.rpartition("}")[2] == "ambient"
               for common in elements(path, "technique_common") for child in common)


def unit(v):
    return (v / np.linalg.norm(v)).tolist()


def dump_mesh(obj):
    mesh = obj.data
    matrix = np.array(obj.matrix_world, float)
    corners = np.empty(3 * len(mesh.vertices))
    mesh.vertices.foreach_get("co", corners)
    corners = corners.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    index = np.empty(len(mesh.loops), np.int64)
    mesh.loops.foreach_get("vertex_index", index)
    sizes = np.empty(len(mesh.polygons), np.int64)
    mesh.polygons.foreach_get("loop_total", sizes)
    smooth = any(p.use_smooth for p in mesh.polygons)
    normals = None
    if mesh.has_custom_normals or not smooth:
        mesh.calc_normals_split()
        normals = np.empty(3 * len(mesh.loops))
        mesh.loops.foreach_get("normal", normals)
        normals = normals.reshape(-1, 3) @ np.linalg.inv(matrix[:3, :3])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    corners = corners[index]
    if np.linalg.det(matrix[:3, :3]) < 0:
        # A mirror turns corners round, but not what is the front.
        ends = np.cumsum(sizes)
        turned = np.concatenate([np.arange(e - 1, e - n - 1, -1) for e, n in zip(ends, sizes)])
        corners = corners[turned]
        normals = normals if normals is None else normals[turned]
    return {"name": obj.name, "sizes": sizes.tolist(), "corners": corners.ravel().tolist(),
            "custom": mesh.has_custom_normals,
            "normals": normals if normals is None else normals.ravel().tolist()}


def is_placed_by_lookat(path):
    return any(len([e for e in node if e.tag.rpartition("}")[2] == "lookat"]) > 0 and
               any(e.tag.rpartition("}")[2] == "instance_camera" for e in node.iter())
               for node in elements(path, "node"))


def dump_camera(obj, by_lookat):
    matrix = np.array(obj.matrix_world, float)
    if by_lookat:
        return {"name": obj.name}
    if obj.data.type != "PERSP":
        raise ValueError(f"camera {obj.name!r} is {obj.data.type}")
    frame = np.array([tuple(v) for v in obj.data.view_frame(scene=bpy.context.scene)])
    return {"name": obj.name, "right": unit(matrix[:3, 0]), "up": unit(matrix[:3, 1]),
            "backward": unit(matrix[:3, 2]), "eye": matrix[:3, 3].tolist(),
            "tan_h": float(max(frame[:, 0] / -frame[:, 2]))}


def dump_light(obj):
    matrix = np.array(obj.matrix_world, float)
    return {"name": obj.name, "kind": obj.data.type, "position": matrix[:3, 3].tolist(),
            "direction": unit(-matrix[:3, 2])}


def read(job):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = job["width"], job["height"]
    render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    # Lengths become metres, axes Blender's, normals the file's.
    done = bpy.ops.wm.collada_import(filepath=job["dae"], import_units=False, custom_normals=True)
    if done != {"FINISHED"}:
        raise RuntimeError(f"the importer ended with {done}")
    bpy.context.view_layer.update()
    kinds = {"MESH": [], "CAMERA": [], "LIGHT": []}
    for obj in bpy.data.objects:
        if obj.type in kinds:
            kinds[obj.type].append(obj)
        elif obj.type != "EMPTY":
            raise ValueError(f"{obj.name!r} is {obj.type}")
    by_lookat = is_placed_by_lookat(job["dae"])
    return {"up_axis": up_axis(job["dae"]), "num_ambient": num_ambient(job["dae"]), "meshes": [dump_mesh(o) for o in kinds["MESH"]],
            "cameras": [dump_camera(o, by_lookat) for o in kinds["CAMERA"]],
            "lights": [dump_light(o) for o in kinds["LIGHT"]]}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--jobs", required=True)
    args = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])
    with open(args.jobs, encoding="utf-8") as f:
        jobs = json.load(f)
    absent = None
    if not getattr(bpy.app.build_options, "collada", False):
        absent = json.dumps({"absent": f"Blender {bpy.app.version_string} of this machine does not import COLLADA"})
    for k, job in enumerate(jobs):
        try:
            result = absent or json.dumps(read(job), allow_nan=False)
        except (RuntimeError, ValueError, ElementTree.ParseError) as why:
            result = json.dumps({"error": " ".join(str(why).split())})
        with open(f"import_{k:04d}.json", "w", encoding="utf-8") as f:
            f.write(result)
    print("ASSAY OK " + json.dumps({"version": "Blender " + bpy.app.version_string}), flush=True)


main()
