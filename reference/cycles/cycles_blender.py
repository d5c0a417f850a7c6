"""Setting Blender's properties for certain, and shader arithmetic as Python expressions."""
import math

import bpy
from mathutils import Matrix

V = bpy.app.version
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


class Nodes:
    """A node tree without nodes; makes nodes, links their inputs."""

    def __init__(self, owner):
        owner.use_nodes = True
        self.tree = owner.node_tree
        self.tree.nodes.clear()

    def node(self, kind, *inputs, **settings):
        """Inputs by position: None keeps the default, a socket or expression is linked, all else is
        a value, which is checked because sockets clamp theirs."""
        node = self.tree.nodes.new("ShaderNode" + kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for socket, value in zip(node.inputs, inputs):
            self.feed(socket, value)
        return node

    def feed(self, socket, value):
        if value is None:
            return
        if isinstance(value, Expression):
            value = value.socket
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
            return
        socket.default_value = value
        got = socket.default_value
        pairs = zip(got, value) if hasattr(got, "__len__") else ((got, value),)
        for a, b in pairs:
            if not math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-30):
                raise ValueError(f"{socket.node.name}.{socket.name}: {b!r} became {a!r}")

    def math(self, operation, *inputs):
        return Number(self, self.node("Math", *inputs, operation=operation).outputs[0])

    def vector_math(self, operation, *inputs):
        if operation != "SCALE":
            return self.node("VectorMath", *inputs, operation=operation)
        node = self.node("VectorMath", inputs[0], operation=operation)
        self.feed(node.inputs["Scale"], inputs[1])
        return node

    def geometry(self, name):
        """An output of the Geometry node; Backfacing is a number, the rest are vectors."""
        socket = self.node("NewGeometry").outputs[name]
        return Number(self, socket) if name == "Backfacing" else Vector(self, socket)

    def combine(self, x, y, z):
        return Vector(self, self.node("CombineXYZ", x, y, z).outputs[0])

    def add_shaders(self, a, b):
        return self.node("AddShader", a, b).outputs[0]


class Expression:
    def __init__(self, nodes, socket):
        self.nodes, self.socket = nodes, socket


class Number(Expression):
    """Math nodes; division by zero gives 0, as do square root and logarithm outside their domain."""

    def __add__(self, other):
        return self.nodes.math("ADD", self, other)

    def __sub__(self, other):
        return self.nodes.math("SUBTRACT", self, other)

    def __mul__(self, other):
        return self.nodes.math("MULTIPLY", self, other)

    def __truediv__(self, other):
        return self.nodes.math("DIVIDE", self, other)

    def __radd__(self, other):
        return self.nodes.math("ADD", other, self)

    def __rsub__(self, other):
        return self.nodes.math("SUBTRACT", other, self)

    def __rmul__(self, other):
        return self.nodes.math("MULTIPLY", other, self)

    def __rtruediv__(self, other):
        return self.nodes.math("DIVIDE", other, self)

    def __pow__(self, other):
        return self.nodes.math("POWER", self, other)

    def __lt__(self, other):
        """1 or 0."""
        return self.nodes.math("LESS_THAN", self, other)

    def __gt__(self, other):
        """1 or 0."""
        return self.nodes.math("GREATER_THAN", self, other)

    def sqrt(self):
        return self.nodes.math("SQRT", self)

    def exp(self):
        return self.nodes.math("EXPONENT", self)

    def log(self):
        return self.nodes.math("LOGARITHM", self, math.e)

    def cos(self):
        return self.nodes.math("COSINE", self)

    def sin(self):
        return self.nodes.math("SINE", self)

    def max(self, other):
        return self.nodes.math("MAXIMUM", self, other)

    def min(self, other):
        return self.nodes.math("MINIMUM", self, other)


class Vector(Expression):
    def dot(self, other):
        return Number(self.nodes, self.nodes.vector_math("DOT_PRODUCT", self, other).outputs[1])

    def cross(self, other):
        return self.vector("CROSS_PRODUCT", other)

    def __add__(self, other):
        return self.vector("ADD", other)

    def __sub__(self, other):
        return self.vector("SUBTRACT", other)

    def __mul__(self, number):
        return self.vector("SCALE", number)

    def normalize(self):
        return Vector(self.nodes, self.nodes.vector_math("NORMALIZE", self).outputs[0])

    def parts(self):
        return [Number(self.nodes, o) for o in self.nodes.node("SeparateXYZ", self).outputs]

    def vector(self, operation, other):
        return Vector(self.nodes, self.nodes.vector_math(operation, self, other).outputs[0])


def choose(condition, yes, no):
    """yes where condition is 1, no where it is 0; both finite."""
    return no + (yes - no) * condition
