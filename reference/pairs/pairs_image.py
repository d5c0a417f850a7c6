"""A PNG held against the moments EXR that was written beside it."""
import struct
import zlib


def read_png(path):
    """Rows of 8-bit RGB, as the PNG specification undoes its filters."""
    with open(path, "rb") as f:
        data = f.read()
    at, packed = 8, b""
    while at < len(data):
        size, kind = int.from_bytes(data[at:at + 4], "big"), data[at + 4:at + 8]
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height = int.from_bytes(body[:4], "big"), int.from_bytes(body[4:8], "big")
            step = {2: 3, 6: 4}[body[9]]
        packed += body if kind == b"IDAT" else b""
        at += size + 12
    raw, rows, above = zlib.decompress(packed), [], bytearray(width * step)
    for y in range(height):
        start = y * (width * step + 1)
        kind, row = raw[start], bytearray(raw[start + 1:start + 1 + width * step])
        for i, byte in enumerate(row):
            left, corner = (row[i - step], above[i - step]) if i >= step else (0, 0)
            up = above[i]
            near = min((left, up, corner), key=lambda v: abs(left + up - corner - v))
            row[i] = (byte + (0, left, up, (left + up) // 2, near)[kind]) & 255
        rows.append(row)
        above = row
    return width, height, step, rows


def unzip(data, size):
    """Of OpenEXR's ZIP: differences, and even bytes before odd ones."""
    if len(data) == size:
        return data
    out = bytearray(zlib.decompress(data))
    for i in range(1, size):
        out[i] = (out[i - 1] + out[i] - 128) & 255
    half = (size + 1) // 2
    both = bytearray(size)
    both[0::2], both[1::2] = out[:half], out[half:]
    return both


def read_exr(path):
    """Width, height and {channel: rows} of the float channels of a file of scan lines, ZIP."""
    with open(path, "rb") as f:
        data = f.read()
    at, attributes = 8, {}

    def text(at):
        end = data.index(0, at)
        return data[at:end].decode(), end + 1
    while data[at]:
        name, at = text(at)
        _, at = text(at)
        size, = struct.unpack_from("<i", data, at)
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    if attributes["compression"] != b"\3":
        raise ValueError(f"{path}: not ZIP")
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height, names, i = x1 - x0 + 1, y1 - y0 + 1, [], 0
    channels = attributes["channels"]
    while channels[i]:
        end = channels.index(0, i)
        names.append((channels[i:end].decode(), {1: 2, 2: 4}[channels[end + 1]]))
        i = end + 17
    bytes_of_line = width * sum(size for _, size in names)
    rows = {name: [None] * height for name, _ in names}
    for block in range((height + 15) // 16):
        offset, = struct.unpack_from("<Q", data, at + 1 + 8 * block)
        y, size = struct.unpack_from("<2i", data, offset)
        lines = min(16, height - (y - y0))
        body, p = unzip(data[offset + 8:offset + 8 + size], lines * bytes_of_line), 0
        for line in range(lines):
            for name, size in names:
                if size == 4:
                    rows[name][y - y0 + line] = struct.unpack_from(f"<{width}f", body, p)
                p += size * width
    return width, height, rows


def code(radiance, is_assignments):
    """0 to 255 by IEC 61966-2-1, or by the assignment's curve: gamma 2.2 after a factor of sqrt(2)."""
    x = max(radiance, 0)
    if is_assignments:
        return min(255, 255 * (x * 2 ** 0.5) ** (1 / 2.2))
    return min(255, 255 * (12.92 * x if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055))


def png_differs(image, is_assignments):
    """None, or the first pixel of the PNG that is not within rounding of the EXR's mean."""
    width, height, step, rows = read_png(image[:-3] + "png")
    w, h, means = read_exr(image)
    if (w, h) != (width, height):
        return f"the PNG has {width} x {height} pixels, the EXR {w} x {h}"
    for y in range(h):
        for x in range(w):
            for i, channel in enumerate("RGB"):
                want, got = code(means[channel][y][x], is_assignments), rows[y][step * x + i]
                if abs(got - want) > 1:
                    return f"the PNG's {channel} at {x},{y} is {got}, not {want:.1f}"
    return None
