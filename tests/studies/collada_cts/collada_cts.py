#!/usr/bin/env python3
"""Every COLLADA file of a copy of Khronos' conformance suite through pathtracer: what loads, with which notes, what is
refused and why, whether images are alike or differ where the suite's own judges say so, and whether silhouettes are those
of its reference images (oiiotool reads these), but for what stands in others.txt beside this.

usage: collada_cts.py PATHTRACER DIR [--load-only]

DIR holds StandardDataSets. Prints Markdown; exit code 1 if a run crashes, hangs or says other than one line, or if a
silhouette is another one than was seen before."""
import collections
import concurrent.futures
import os
import re
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "../../../reference/pairs"))
from pairs_image import read_png  # noqa: E402

SIZE, SAMPLES = 64, 16
# Two silhouettes are the same if intersection over union is at least this.
ALIKE, SILHOUETTE_SIZE = 0.88, 128
# Two images are different if more than this share of pixels differs by more than the suite's own 5 of 255.
SHARE, STEP = 0.01, 5
JUDGE = re.compile(r'CompareImagesAgainst\(context, "([^"]+)"(?:, None, None, 5, \w+(?:, (True|False))?)?\)')


def run(command):
    try:
        p = subprocess.run(command, capture_output=True, timeout=120)
        return p.returncode, p.stderr.decode(errors="replace")
    except subprocess.TimeoutExpired:
        return -1, "no end within 120 s"


def pixels(path):
    """The bytes of an 8 bit RGB image."""
    return b"".join(read_png(path)[3])


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
            result["image"] = pixels(image)
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


def reference_image(path):
    """The one still image that the suite has of a file, or None."""
    found = [os.path.join(d, f) for d, _, names in os.walk(os.path.join(os.path.dirname(path), "Blessed"))
             for f in names if f.lower().endswith(".png")]
    return found[0] if len(found) == 1 else None


def mask(image, channel, folder):
    """Where the channel is above a half, in a square of SILHOUETTE_SIZE."""
    out = os.path.join(folder, "mask.png")
    subprocess.run(["oiiotool", image, "--ch", ",".join([channel] * 3), "--resize:filter=box",
                    f"{SILHOUETTE_SIZE}x{SILHOUETTE_SIZE}", "-d", "uint8", "-o", out], check=True, capture_output=True)
    return [b > 127 for b in pixels(out)[::3]]


def silhouette(job):
    """Share of what either image covers that both cover; None where there is nothing to compare."""
    tracer, path, reference = job
    with tempfile.TemporaryDirectory() as folder:
        image, size = os.path.join(folder, "hits.exr"), str(SILHOUETTE_SIZE)
        if run([tracer, "-q", "-t", "1", "-s", "16", "-m", "1", "-r", size, size, "--aov", "-f", image, path])[0] != 0:
            return None
        ours, theirs = mask(image, "depth.hits", folder), mask(reference, "A", folder)
    either = sum(a or b for a, b in zip(ours, theirs))
    return sum(a and b for a, b in zip(ours, theirs)) / either if either else 1.0


def judge_silhouettes(loaded, tracer, pool, root):
    """Are those that are not the reference image's the ones of others.txt? Those were looked at."""
    jobs = [(tracer, r["path"], reference_image(r["path"])) for r in loaded if r["image"] is not None]
    jobs = [j for j in jobs if j[2] is not None]
    shares = {os.path.relpath(j[1], root): s for j, s in zip(jobs, pool.map(silhouette, jobs)) if s is not None}
    with open(os.path.join(HERE, "others.txt"), encoding="utf-8") as f:
        seen = dict(line.rstrip("\n").split(": ", 1)[::-1] for line in f if line.strip())
    others = sorted(p for p, s in shares.items() if s < ALIKE)
    new = [p for p in others if p not in seen]
    print(f"\n## Silhouettes of the suite's reference images\n\n- compared: {len(shares)}\n- the same: {len(shares) - len(others)}"
          f"\n- another, and looked at: {len(others) - len(new)}\n- another, not seen before: {len(new)}")
    if others:
        table("another because", collections.Counter(seen[p] for p in others if p in seen))
    print("".join(f"\nNEW {p}: {shares[p]:.2f}" for p in new))
    return bool(new)


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
    if load_only:
        return bool(broken)
    judge(results, root)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        return judge_silhouettes(loaded, tracer, pool, root) or bool(broken)


if __name__ == "__main__":
    sys.exit(main())
