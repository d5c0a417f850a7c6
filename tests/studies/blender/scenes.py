"""Scenes made in Blender, exported by its own COLLADA exporter, and rendered by Cycles.

    blender -b --factory-startup -noaudio --python-exit-code 3 -P scenes.py -- NAME FOLDER SAMPLES THREADS

Writes FOLDER/NAME.dae and FOLDER/NAME.exr. Materials are Principled with a base colour when they are exported, as the
exporter reads, and diffuse of that colour when Cycles renders, as COLLADA has it."""
import math
import sys

import bpy

NAME, FOLDER, SAMPLES, THREADS = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
mesh = bpy.ops.mesh


def put(make, rgb, smooth=False, modifiers=(), **where):
    make(**where)
    o = bpy.context.object
    if rgb is not None:
        m = bpy.data.materials.new("paint")
        m.use_nodes = True
        m.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*rgb, 1)
        o.data.materials.append(m)
    for p in o.data.polygons:
        p.use_smooth = smooth
    for kind, values in modifiers:
        modifier = o.modifiers.new(kind, kind)
        for key, value in values.items():
            setattr(modifier, key, value)
    return o


def light(kind, energy, color, location, rotation=(0, 0, 0), **values):
    lamp = bpy.data.lights.new("lamp", kind)
    lamp.energy, lamp.color = energy, color
    for key, value in values.items():
        setattr(lamp, key, value)
    lamp.cycles.max_bounces = 1024
    o = bpy.data.objects.new("lamp", lamp)
    o.location, o.rotation_euler = location, rotation
    scene.collection.objects.link(o)
    return o


def camera(location, rotation, size, **values):
    c = bpy.data.cameras.new("camera")
    for key, value in values.items():
        setattr(c, key, value)
    scene.camera = bpy.data.objects.new("camera", c)
    scene.camera.location, scene.camera.rotation_euler = location, rotation
    scene.collection.objects.link(scene.camera)
    scene.render.resolution_x, scene.render.resolution_y = size


def first(area=True):
    """The one that lights were tuned on."""
    put(mesh.primitive_plane_add, (.6, .5, .4), size=10)
    put(mesh.primitive_cube_add, (.2, .4, .7), size=1.4, location=(-1.3, .3, .7), rotation=(0, 0, .5),
        modifiers=[("BEVEL", {"width": .2, "segments": 3})])
    put(mesh.primitive_ico_sphere_add, (.7, .3, .2), True, radius=.8, location=(.9, -.2, .8), subdivisions=2,
        modifiers=[("SUBSURF", {"levels": 1, "render_levels": 1})])
    put(mesh.primitive_monkey_add, None, size=1.2, location=(.2, 1.8, .9))
    light("POINT", 200, (1, .9, .8), (-2, -3, 3), shadow_soft_size=0)
    light("SUN", 1.5, (.8, .9, 1), (0, 0, 5), (.6, .3, 0), angle=0)
    light("SPOT", 400, (1, 1, 1), (3, -2, 4), (.5, .5, .2), shadow_soft_size=0, spot_size=math.radians(50), spot_blend=0)
    if area:
        light("AREA", 60, (1, .8, .6), (2.5, 1, 2.5), (.3, .9, 0), shape="RECTANGLE", size=.8, size_y=.4)
    camera((.5, -7, 3.5), (1.15, 0, .05), (160, 120), lens=40)


def second(smooth=False):
    """In decimetres; parents, mirrored and stretched objects, one mesh twice, modifiers; a wide lens. A cone that is smooth
    has normals far from its faces' where side and base meet."""
    scene.unit_settings.scale_length = .1
    put(mesh.primitive_grid_add, (.3, .6, .3), size=24, x_subdivisions=3, y_subdivisions=5)
    put(mesh.primitive_plane_add, None, size=24, location=(0, 9, 5), rotation=(1.4, 0, 0))
    cone = put(mesh.primitive_cone_add, (.8, .7, .1), smooth, vertices=24, radius1=2, depth=4, location=(-4, 1, 2))
    twin = cone.copy()
    twin.location, twin.scale, twin.rotation_euler = (3.5, 3, 2.5), (-1, .5, 1.5), (.3, .2, 1)
    scene.collection.objects.link(twin)
    child = put(mesh.primitive_torus_add, (.2, .3, .8), True, major_radius=1.5, minor_radius=.5, location=(1, -1, 2),
                rotation=(1, .4, 0))
    child.parent = twin
    put(mesh.primitive_cube_add, (.7, .2, .5), size=1, location=(-1, -3, .6),
        modifiers=[("ARRAY", {"count": 3}), ("SOLIDIFY", {"thickness": .1})])
    light("AREA", 5000, (.9, 1, .7), (0, 0, 12), (.2, -.1, 0), shape="SQUARE", size=3)
    light("POINT", 3000, (1, .6, .4), (7, -5, 6), shadow_soft_size=0)
    camera((-2, -14, 7), (1.2, .1, -.15), (150, 100), lens=24)


def third():
    """A wide spot and a low sun on smooth and flat halves of one mesh with two materials; an upright image."""
    put(mesh.primitive_plane_add, (.5, .5, .5), size=8)
    ball = put(mesh.primitive_uv_sphere_add, (.9, .8, .6), radius=1.2, location=(0, 0, 1.5), segments=20, ring_count=10)
    put(mesh.primitive_cylinder_add, (.1, .1, .6), radius=.5, depth=3, location=(-1.6, 1, 1.5), vertices=12)
    other = bpy.data.materials.new("other")
    other.use_nodes = True
    other.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (.1, .7, .3, 1)
    ball.data.materials.append(other)
    for p in ball.data.polygons:
        p.use_smooth = p.center[0] > 0
        p.material_index = int(p.center[2] > .2)
    light("SPOT", 900, (1, .5, .9), (2.5, 2, 5), (-.3, .5, 0), shadow_soft_size=0, spot_size=math.radians(120), spot_blend=0)
    light("SUN", .7, (1, 1, .8), (0, 0, 0), (1.2, 0, 2.4), angle=0)
    camera((5, -5, 3), (1.25, 0, .79), (90, 140), lens=35, sensor_fit="HORIZONTAL")


def parallel():
    """The first by an orthographic camera, without the area light, whose shadow it would show."""
    first(area=False)
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 5.5


{"parallel": parallel, "first": first, "second": second, "third": third, "edges": lambda: second(True)}[NAME]()
bpy.ops.wm.collada_export(filepath=f"{FOLDER}/{NAME}.dae", apply_modifiers=True)
for material in bpy.data.materials:
    if material.use_nodes:
        tree = material.node_tree
        diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
        diffuse.inputs["Color"].default_value = tree.nodes["Principled BSDF"].inputs["Base Color"].default_value[:]
        tree.links.new(diffuse.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
scene.render.engine = "CYCLES"
for key, value in {"device": "CPU", "samples": int(SAMPLES), "use_denoising": False, "use_adaptive_sampling": False,
                   "light_sampling_threshold": 0, "sample_clamp_indirect": 0, "blur_glossy": 0, "max_bounces": 4,
                   "diffuse_bounces": 4, "pixel_filter_type": "BOX"}.items():
    setattr(scene.cycles, key, value)
scene.render.threads_mode, scene.render.threads = "FIXED", int(THREADS)
scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
scene.view_settings.view_transform = "Raw"
scene.render.filepath = f"{FOLDER}/{NAME}.exr"
bpy.ops.render.render(write_still=True)
