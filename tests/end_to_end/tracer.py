#!/usr/bin/env python3
"""tracer.py SCENE WIDTH HEIGHT SPP SEED OUT: a path tracer of sixty lines: balls, a floor, a square lamp overhead, two bounces. It
knows nothing of Assay; the guide lets it stand for the reader's renderer."""
import json
import sys

import numpy as np


def hit(scene, origin, way):
    """Distance (inf: nothing), normal and albedo where each ray ends."""
    down = np.where(way[:, 1] < -1e-9, -origin[:, 1] / np.minimum(way[:, 1], -1e-9), np.inf)
    far = np.where(down > 1e-6, down, np.inf)
    normal, albedo = np.tile([0.0, 1, 0], (len(way), 1)), np.tile(scene["floor"], (len(way), 1))
    for ball in scene["balls"]:
        to = np.array(ball["at"]) - origin
        along = (to * way).sum(1)
        inside = ball["radius"] ** 2 - (to * to).sum(1) + along**2
        near = along - np.sqrt(np.maximum(inside, 0))
        is_hit = (inside > 0) & (near > 1e-6) & (near < far)
        far = np.where(is_hit, near, far)
        at = origin + near[:, None] * way
        normal[is_hit] = ((at - ball["at"]) / ball["radius"])[is_hit]
        albedo[is_hit] = ball["albedo"]
    return far, normal, albedo


def light(scene, at, normal, random):
    """Reflected radiance (albedo 1) from a random point of the lamp, over the point's density."""
    lamp = scene["lamp"]
    to = np.column_stack([lamp["size"] * (random[0] - 0.5), np.full(len(at), lamp["height"]),
                          lamp["size"] * (random[1] - 0.5)]) - at
    far = np.sqrt((to * to).sum(1))
    way = to / far[:, None]
    lit = hit(scene, at + 1e-4 * normal, way)[0] > far
    cosines = np.maximum((way * normal).sum(1), 0) * np.maximum(way[:, 1], 0)
    return lit * cosines * lamp["radiance"] * lamp["size"] ** 2 / far**2 / np.pi


def around(normal, random):
    """Cosine-distributed directions around the normals."""
    a, z = 2 * np.pi * random[0], 2 * random[1] - 1
    way = normal + np.column_stack([np.sqrt(1 - z * z) * np.cos(a), np.sqrt(1 - z * z) * np.sin(a), z])
    return way / np.sqrt((way * way).sum(1))[:, None]


def render_row(scene, row, width, height, spp, random):
    """(width, 3)"""
    x = (np.repeat(np.arange(width), spp) + random[0]) / width - 0.5
    y = 0.5 - (row + random[1]) / height
    origin = np.tile([0.0, 1, 4], (len(x), 1))
    way = np.column_stack([x, y * height / width - 0.15, np.full(len(x), -1.0)])
    way /= np.sqrt((way * way).sum(1))[:, None]
    total, left = np.zeros((len(x), 3)), np.ones((len(x), 3))
    for bounce in range(2):
        far, normal, albedo = hit(scene, origin, way)
        left *= np.where(np.isfinite(far), 1, 0)[:, None] * albedo
        origin = origin + np.where(np.isfinite(far), far, 0)[:, None] * way + 1e-4 * normal
        total += left * light(scene, origin, normal, random[4 * bounce + 2:])[:, None]
        way = around(normal, random[4 * bounce + 4:])
    return total.reshape(width, spp, 3).mean(1)


def render(scene, width, height, spp, seed):
    """(height, width, 3), rows from the top."""
    random = np.random.default_rng(seed).random((10, height, width * spp))
    return np.array([render_row(scene, row, width, height, spp, random[:, row]) for row in range(height)])


if __name__ == "__main__":
    file, width, height, spp, seed, out = sys.argv[1:]
    image = render(json.load(open(file)), int(width), int(height), int(spp), int(seed))
    with open(out, "wb") as f:
        f.write(b"PF\n%d %d\n-1.0\n" % (int(width), int(height)) + image[::-1].astype("<f4").tobytes())
