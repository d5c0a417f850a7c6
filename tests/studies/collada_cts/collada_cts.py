#!/usr/bin/env python3
"""Every COLLADA file of a copy of Khronos' conformance suite through pathtracer: what loads, with which notes, what is
refused and why, and whether images are alike or differ where the suite's own judges say so.

usage: collada_cts.py PATHTRACER DIR [--load-only]

DIR holds StandardDataSets. Prints Markdown; exit code 1 if a run crashes, hangs or says other than one line."""
import collections
import concurrent.futures
import os
import re
import struct
import subprocess
import sys
import tempfile
import zlib

SIZE, SAMPLES = 64, 16
# An image is another one where more than this share of pixels differs by more than the suite's own 5 of 255.
SHARE, STEP = 0.01, 5
JUDGE = re.compile(r'CompareImagesAgainst\(context, "([^"]+)"(?:, None, None, 5, \w+(?:, (True|False))?)?\)')


def run(command):
    try:
        p = subprocess.run(command, capture_output=True, timeout=120)
        return p.returncode, p.stderr.decode(errors="replace")
    except subprocess.TimeoutExpired:
        return -1, "no end within 120 s"


def read_png(path):
    """The bytes of an 8 bit RGB image, rows unfiltered."""
    data, at, body, width = open(path, "rb").read(), 8, b"", 0
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        chunk = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", chunk[:10])
            assert (depth, colour) == (8, 2)
        body += chunk if kind == b"IDAT" else b""
        at += 12 + length
    raw, rows, above = zlib.decompress(body), [], bytes(3 * width)
    for y in range(height):
        start = y * (3 * width + 1)
        kind, row = raw[start], bytearray(raw[start + 1:start + 1 + 3 * width])
        for x in range(3 * width):
            a, b, c = (row[x - 3] if x > 2 else 0), above[x], (above[x - 3] if x > 2 else 0)
            p = a + b - c
            paeth = min((abs(p - v), i) for i, v in enumerate((a, b, c)))[1]
            row[x] = row[x] + (0, a, b, (a + b) // 2, (a, b, c)[paeth])[kind] & 255
        rows.append(bytes(row))
        above = row
    return b"".join(rows)


def try_file(job):
    tracer, path, image = job
    status, text = run([tracer, "--list-cameras", path])
    result = {"path": path, "status": status, "lines": [s for s in text.splitlines() if s], "notes": [], "image": None}
    if status == 0 and image is not None:
        status, text = run([tracer, "-t", "1", "-s", str(SAMPLES), "-m", "1", "-r", str(SIZE), str(SIZE),
                            "-f", image, path])
        lines = text.splitlines()
        result["notes"] = [s.split("note: ", 1)[1] for s in lines if s.startswith("pathtracer: note: ")]
        if status == 0:
            result["image"] = read_png(image)
        else:
            result["status"], result["unlit"] = (0, lines[-1]) if status == 3 else (status, None)
    return result


def reason(line, root):
    """An error without the file's own words."""
    line = re.sub(r"^pathtracer: ", "", line).replace(root, "")
    line = re.sub(r"^[^:]*\.(dae|DAE)(:\d+)?: ", "", line)
    return re.sub(r"(?<!opaque=)'[^']*'", "'…'", re.sub(r"/\S+", "…", re.sub(r"\b\d+\b", "n", line)))


def differs(a, b):
    far = sum(any(abs(a[i + k] - b[i + k]) > STEP for k in range(3)) for i in range(0, len(a), 3))
    return far > SHARE * SIZE * SIZE


def table(title, counter):
    print(f"\n| {title} | files |\n|---|---|")
    for what, n in sorted(counter.items(), key=lambda x: (-x[1], x[0])):
        print(f"| {what} | {n} |")


def judge(results, root):
    """The pairs of images that the suite's own judges compare: equal or not."""
    of = {os.path.splitext(os.path.basename(r["path"]))[0]: r for r in results if r["image"] is not None}
    counts, wrong = collections.Counter(), []
    for r in results:
        script = os.path.splitext(r["path"])[0] + ".py"
        if r["image"] is None or not os.path.exists(script):
            continue
        for name, equal in set(JUDGE.findall(open(script, errors="replace").read())):
            if name not in of or of[name] is r:
                continue
            kind = "differ" if equal == "False" else "be alike"
            good = differs(r["image"], of[name]["image"]) == (kind == "differ")
            counts[kind, good] += 1
            if not good:
                wrong.append(f"- `{os.path.basename(r['path'])}` should {kind}: `{name}`")
    print("\n## Images that the suite compares\n")
    for kind in ("be alike", "differ"):
        print(f"- that should {kind}: {counts[kind, True]} of {counts[kind, True] + counts[kind, False]} do")
    print("\nNot so:\n\n" + "\n".join(sorted(wrong)) if wrong else "")


def main():
    tracer, root = sys.argv[1], sys.argv[2]
    load_only = "--load-only" in sys.argv
    root = os.path.join(root, "StandardDataSets") if os.path.isdir(os.path.join(root, "StandardDataSets")) else root
    paths = sorted(os.path.join(d, f) for top in ("collada", "collada_other", "xml")
                   for d, _, names in os.walk(os.path.join(root, top)) for f in names if f.lower().endswith(".dae"))
    if not paths:
        sys.exit(f"collada_cts: {root}: no .dae files")
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = [(tracer, p, None if load_only else f"{folder}/{i}.png") for i, p in enumerate(paths)]
        results = list(pool.map(try_file, jobs))
    loaded = [r for r in results if r["status"] == 0]
    refused = [r for r in results if r["status"] == 3]
    broken = [r for r in results if r["status"] not in (0, 3) or (r["status"] == 3 and len(r["lines"]) != 1)]
    print(f"- files: {len(results)}\n- loaded: {len(loaded)}, of them {sum(bool(r['notes']) for r in loaded)} with a note"
          f"\n- refused: {len(refused)}\n- crashes, hangs, or more than one line: {len(broken)}")
    table("refused because of", collections.Counter(reason(r["lines"][-1], root) for r in refused))
    table("note", collections.Counter(reason(part, root) for r in loaded for n in r["notes"] for part in n.split("; ")))
    table("loaded, but", collections.Counter(reason(r["unlit"], root) for r in loaded if "unlit" in r))
    for r in broken:
        print(f"\nBROKEN {r['path']}: {r['status']}: {r['lines'][:3]}")
    if not load_only:
        judge(results, root)
    return bool(broken)


if __name__ == "__main__":
    sys.exit(main())
