#!/usr/bin/env python3
"""knockout.py BUILD [SCENE ...] [-o FILE] [--levels LEVEL ...]: switches each level of each scene off in turn, renders what is left with
BUILD/pathtracer, and holds it against the scene's golden with BUILD/assay. Prints a line for each; FILE gets all as JSON. A
level without which the image is not DIFFERENT, by more than the smallest bias that could have been missed there, is there
in name only: exit code 1."""
import argparse
import datetime
import json
import os
import statistics
import subprocess
import sys
import tempfile

from pairs import Scene, rows, write, write_images
from pairs_cover import is_seen

ALPHA = "5e-6"  # of a claim of the suite, about
SHARE = 4  # a quarter of the scene's samples first, then all: most move the image so much that it needs no more


def render(build, folder, scene, share):
    """The image of what write() left in the folder."""
    with open(f"{folder}/{scene.name}.json", encoding="utf-8") as f:
        s = json.load(f)
    image = f"{folder}/{scene.name}.exr"
    command = [f"{build}/pathtracer", "-q", "-r", str(s["width"]), str(s["height"]), "-s", str(s["spp"] // share),
               "-m", str(s["depth"]), "--seed", "7", "-f", image]
    if "environment" in s:
        command += ["-e", f"{folder}/{s['environment']}"]
    if "lens_radius" in s:
        command += ["-b", str(s["lens_radius"]), "-d", str(s["focal_distance"])]
    subprocess.run(command + [f"{folder}/{scene.name}.dae"], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)
    return image, s


def judge(build, folder, image, golden, s):
    """The claim of `assay compare`."""
    margins = s["references"]["cycles"]
    out = f"{folder}/claim.json"
    subprocess.run([f"{build}/assay", "compare", "-q", "--alpha", ALPHA, "--margin", str(margins["margin_global"]),
                    "--margin-tile", str(margins["margin_tile"]), "--tile", str(s["tile"]), "--json", out, image, golden],
                   check=False)
    with open(out, encoding="utf-8") as f:
        return json.load(f)["claims"][0]


def knock(build, folder, scene, off, whole, share=SHARE):
    golden = f"golden/{scene.name}/cycles.exr"
    less = Scene(scene.row, off) if off else scene
    write(folder, less)
    image, s = render(build, folder, less, share)
    claim = judge(build, folder, image, golden, s)
    if whole is None:
        return claim
    return {"scene": scene.name, "level": off, "depth": scene.depth, "verdict": claim["verdict"], "effect": round(max(
        abs(claim["difference"]) / whole["mdb_global"], abs(claim["worst"]["difference"]) / region_mdb(claim)), 1)}


def region_mdb(claim):
    """Of the region that differs most: its margin, and what noise hides from a test at its share of alpha with a power of
    95 %. Its interval is the one of alpha for a single region."""
    worst, alpha, normal = claim["worst"], float(ALPHA), statistics.NormalDist()
    error = (worst["ci"][1] - worst["ci"][0]) / 2 / normal.inv_cdf(1 - alpha / 2)
    return worst["margin"] + error * (normal.inv_cdf(1 - alpha / claim["num_tests"] / 2) + normal.inv_cdf(0.95))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("-o", "--out")
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--levels", nargs="*", help="these; 'nothing': none, which must be seen to fail")
    args = parser.parse_args()
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
    found, failed = [], 0
    with tempfile.TemporaryDirectory() as folder:
        write_images(folder)
        for row in rows():
            scene = Scene(row)
            if args.scenes and scene.name not in args.scenes:
                continue
            whole = knock(args.build, folder, scene, None, None)
            if whole["verdict"] == "DIFFERENT":
                failed += 1
            print(f"{scene.name}: {whole['verdict']}, MDB {100 * whole['mdb_global']:.2f} % of the image, "
                  f"{100 * whole['mdb_tile']:.1f} % of a tile", flush=True)
            found.append({"scene": scene.name, "mdb_global": whole["mdb_global"], "mdb_tile": whole["mdb_tile"]})
            for off in args.levels or scene.all_levels():
                k = knock(args.build, folder, scene, off, whole)
                if not is_seen(k):
                    k = knock(args.build, folder, scene, off, whole, 1)
                ok = is_seen(k)
                failed += not ok
                print(f"  without {off}: {k['verdict']}, {k['effect']} MDB{'' if ok else ' FAILED'}", flush=True)
                found.append(k)
    if args.out:
        with open(args.out, "w", encoding="utf-8") as f:
            json.dump({"date": str(datetime.date.today()), "levels": [k for k in found if "level" in k]}, f, indent=0)
            f.write("\n")
    print(f"{sum('level' in k for k in found)} levels, {failed} failed")
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
