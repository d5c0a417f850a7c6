"""4 x 4 matrices by rows, as lists of 16 numbers."""
import math

IDENTITY = [1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0]


def multiply(a, b):
    return [sum(a[4 * i + k] * b[4 * k + j] for k in range(4)) for i in range(4) for j in range(4)]


def translate(v):
    return [1, 0, 0, v[0], 0, 1, 0, v[1], 0, 0, 1, v[2], 0, 0, 0, 1]


def scale(x, y, z):
    return [x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, 0, 0, 0, 1]


def rotate(axis, degrees):
    """Rodrigues' formula."""
    n = math.sqrt(sum(a * a for a in axis))
    x, y, z = (a / n for a in axis)
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    d = 1 - c
    return [c + x * x * d, x * y * d - z * s, x * z * d + y * s, 0,
            y * x * d + z * s, c + y * y * d, y * z * d - x * s, 0,
            z * x * d - y * s, z * y * d + x * s, c + z * z * d, 0, 0, 0, 0, 1]


def look(eye, target):
    """A camera's matrix, +Y up."""
    back = [e - t for e, t in zip(eye, target)]
    n = math.sqrt(sum(b * b for b in back))
    b = [v / n for v in back]
    n = math.hypot(b[2], b[0])
    r = [b[2] / n, 0, -b[0] / n]
    u = [b[1] * r[2] - b[2] * r[1], b[2] * r[0] - b[0] * r[2], b[0] * r[1] - b[1] * r[0]]
    return [r[0], u[0], b[0], eye[0], r[1], u[1], b[1], eye[1], r[2], u[2], b[2], eye[2], 0, 0, 0, 1]


def apply(m, p):
    return [m[4 * i] * p[0] + m[4 * i + 1] * p[1] + m[4 * i + 2] * p[2] + m[4 * i + 3] for i in range(3)]


def text(m):
    return " ".join(f"{v:.9g}" for v in m)
