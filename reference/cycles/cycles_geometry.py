"""Triangles and spheres of a dump as Blender objects."""
import math

import bpy
import numpy as np

from cycles_blender import V, add_object
from cycles_texture import UV_LAYER

ICOSPHERE_LEVEL = 5
# Of glass: what is seen through it depends on where a ray leaves the mesh.
GLASS_ICOSPHERE_LEVEL = 6
# Cycles 3.4 samples a triangle by an inexact solid angle (-1 % at grazing angles) from places
# nearer to its plane than longest edge * 2 area; emitters are cut until that is at most this part
# of their edge.
NEAR_PLANE = 1.5e-5

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


def cut_emitter(positions, *others):
    """Triangles [t, corner, xyz] into as many pieces as exact sampling takes, and what else corners have, or None."""
    pieces = []
    for p in positions:
        area2 = np.linalg.norm(np.cross(p[1] - p[0], p[2] - p[0]))
        pieces.append(max(1, math.ceil((area2 / NEAR_PLANE) ** (1 / 3))))
    return [None if a is None else np.concatenate([cut_triangle(c, n) for c, n in zip(a, pieces)])
            for a in (positions, *others)]


def add_mesh(name, material, positions, normals=None, uv=None):
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
    if uv is not None:
        mesh.uv_layers.new(name=UV_LAYER).data.foreach_set("uv", uv.ravel())
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


def add_mesh_sphere(sphere, kind, material):
    """Finely cut, with exact normals, and the sphere's own area: a convex body's mean projected
    area is a quarter of its surface, so coverage and emitted power are right on average."""
    t = unit_icosphere(GLASS_ICOSPHERE_LEVEL if kind in ("refraction", "glass")
                       else ICOSPHERE_LEVEL)
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
