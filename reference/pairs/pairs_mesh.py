"""Shapes of about unit size, as COLLADA writes them."""
import math


class Mesh:
    """Corners, with normals and texture coordinates or without, and groups of polygons: symbol and lists of numbers of corners."""

    def __init__(self, points, groups, normals=None, uv=None):
        self.points, self.groups, self.normals, self.uv = points, groups, normals, uv

    def text(self, name):
        sources = [("p", self.points)] + ([("n", self.normals)] if self.normals else [])
        uv = f'<input semantic="TEXCOORD" source="#{name}_t" offset="0" set="0"/>' if self.uv else ""
        out = "".join(
            f'<source id="{name}_{s}"><float_array id="{name}_{s}a" count="{3 * len(v)}">' +
            " ".join(f"{x + 0.0:.4g}" for p in v for x in p) +
            f'</float_array><technique_common><accessor source="#{name}_{s}a" count="{len(v)}" stride="3">'
            '<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>'
            "</accessor></technique_common></source>" for s, v in sources)
        if uv:
            out += f'<source id="{name}_t"><float_array id="{name}_ta" count="{2 * len(self.uv)}">' + \
                " ".join(f"{x:g}" for p in self.uv for x in p) + \
                f'</float_array><technique_common><accessor source="#{name}_ta" count="{len(self.uv)}" stride="2">' \
                '<param name="S" type="float"/><param name="T" type="float"/></accessor></technique_common></source>'
        out += f'<vertices id="{name}_v"><input semantic="POSITION" source="#{name}_p"/>' + \
            (f'<input semantic="NORMAL" source="#{name}_n"/>' if self.normals else "") + "</vertices>"
        for symbol, polygons in self.groups:
            out += f'<polylist material="{symbol}" count="{len(polygons)}">' \
                f'<input semantic="VERTEX" source="#{name}_v" offset="0"/>{uv}' \
                f"<vcount>{' '.join(str(len(p)) for p in polygons)}</vcount>" \
                f"<p>{' '.join(str(i) for p in polygons for i in p)}</p></polylist>"
        return f"<mesh>{out}</mesh>"


class Sphere:
    uv = None

    def text(self, _name):
        return '<extra><technique profile="ASSAY"><sphere><radius>1</radius></sphere></technique></extra>'


def corners(mesh):
    """Points whose hull holds the shape."""
    if isinstance(mesh, Sphere):
        return [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    return mesh.points


def quad(corner, a, b, uv=None):
    p = [list(corner), [c + x for c, x in zip(corner, a)], [c + x + y for c, x, y in zip(corner, a, b)],
         [c + y for c, y in zip(corner, b)]]
    return Mesh(p, [("m", [(0, 1, 2, 3)])], uv=uv)


def box():
    h = 0.72
    p = [(x, y, z) for x in (-h, h) for y in (-h, h) for z in (-h, h)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return Mesh(p, [("m", faces)])


def ball(around, along, radius):
    p = [(0, radius, 0)] + [
        (radius * math.sin(math.pi * j / along) * math.cos(2 * math.pi * i / around),
         radius * math.cos(math.pi * j / along),
         -radius * math.sin(math.pi * j / along) * math.sin(2 * math.pi * i / around))
        for j in range(1, along) for i in range(around)] + [(0, -radius, 0)]
    last = len(p) - 1
    faces = [(0, 1 + i, 1 + (i + 1) % around) for i in range(around)]
    for j in range(along - 2):
        for i in range(around):
            a, b = 1 + j * around + i, 1 + j * around + (i + 1) % around
            faces.append((a, a + around, b + around, b))
    faces += [(last - around + i, last, last - around + (i + 1) % around) for i in range(around)]
    return Mesh(p, [("m", faces)])


def torus(around=14, about=8, major=0.62, minor=0.36):
    p, n, faces = [], [], []
    for i in range(around):
        a = 2 * math.pi * i / around
        for j in range(about):
            b = 2 * math.pi * j / about
            n.append((math.cos(a) * math.cos(b), math.sin(b), -math.sin(a) * math.cos(b)))
            r = major + minor * math.cos(b)
            p.append((math.cos(a) * r, minor * math.sin(b), -math.sin(a) * r))
            k, m = (i + 1) % around, (j + 1) % about
            faces.append((i * about + j, k * about + j, k * about + m, i * about + m))
    return Mesh(p, [("m", faces)], n)


def needles(around=200):
    """Two cones, base to base, of triangles 50 times as long as wide."""
    p = [(0, 1, 0), (0, -1, 0)] + [(0.8 * math.cos(2 * math.pi * i / around), 0, -0.8 * math.sin(2 * math.pi * i / around))
                                   for i in range(around)]
    ring = [(2 + i, 2 + (i + 1) % around) for i in range(around)]
    return Mesh(p, [("m", [(0, a, b) for a, b in ring] + [(1, b, a) for a, b in ring])])


def mosaic(side):
    """A square board whose tiles are a group of polygons each."""
    step = 1.8 / side
    p = [(-0.9 + step * i, 0, 0.9 - step * j) for j in range(side + 1) for i in range(side + 1)]
    groups = []
    for j in range(side):
        for i in range(side):
            a = j * (side + 1) + i
            groups.append((f"m{j * side + i}", [(a, a + 1, a + side + 2, a + side + 1)]))
    return Mesh(p, groups)


GEOMETRY = {"box": box, "sphere": Sphere, "smooth": torus, "slivers": needles, "mosaic": mosaic,
            "instances": lambda: ball(8, 9, 0.09), "ball": lambda: ball(8, 9, 0.5),
            "flat": lambda: Mesh(torus().points, torus().groups), "board": lambda: quad((-0.9, 0, 0.9), (1.8, 0, 0), (0, 0, -1.8))}
