#!/usr/bin/env python3
"""runs.py BUILD [RUN ...] [-o FILE]: renders scenes of the suite's pairs in other ways (estimator, -l, roulette, sampler, adaptive
sampling, in shares, in cells, resumed, as PNG; all pairs of these) and holds each image against the scene's golden with
BUILD/assay. A line for each; exit code 1 if one is not EQUIVALENT. FILE gets all as JSON; --list: the table."""
import argparse
import datetime
import itertools
import json
import os
import shutil
import subprocess
import sys
import tempfile

from pairs_image import png_differs

FACTORS = {"estimator": ("mis", "light", "bsdf", "hemisphere"),
           "lights": (1, 4, 9),
           "roulette": ("on", "off", "0.7"),
           "sampler": ("independent", "sobol"),
           "adaptive": ("no", "rule", "unbiased"),
           "parts": ("whole", "merged", "cells", "resumed"),
           "output": ("exr", "png")}
# Scenes by turns; estimators that seldom find a lamp have a sky or point lights alone.
SCENES = {"mis": ("62_points_here", "55_many_far", "51_image_far", "60_ambient_small"),
          "light": ("53_image_large", "56_many_small", "65_points_large", "57_many_large"),
          "bsdf": ("64_points_small", "59_ambient_far", "52_image_small", "59_ambient_far"),
          "hemisphere": ("59_ambient_far", "64_points_small", "59_ambient_far", "64_points_small")}
SEEDS = 16  # of Sobol's: its samples depend on each other, images of seeds of their own do not
ALPHA = "5e-6"  # of a claim of the suite, about


def is_possible(run):
    """Adaptive sampling needs independent samples; shares that each stopped by its own samples do not add up; and a pilot
    has the number of samples to choose from beforehand, so that none can be added."""
    bad = {"no": (), "rule": ("merged",), "unbiased": ("resumed",)}[run["adaptive"]]
    return run["parts"] not in bad and (run["adaptive"] == "no" or run["sampler"] == "independent")


def table():
    """Runs that hold all possible pairs, each the one that adds most, and one more; a scene for each."""
    names = list(FACTORS)
    every = [dict(zip(names, v)) for v in itertools.product(*FACTORS.values())]
    every = [r for r in every if is_possible(r)]

    def pairs(run):
        return set(itertools.combinations(sorted(run.items()), 2))
    missing = set().union(*map(pairs, every))
    runs, turn = [], dict.fromkeys(SCENES, 0)
    while missing:
        best = max(every, key=lambda r: len(pairs(r) & missing))
        missing -= pairs(best)
        scenes = SCENES[best["estimator"]]
        runs.append({"name": f"run_{len(runs) + 1:02}", "scene": scenes[turn[best["estimator"]] % len(scenes)], **best})
        turn[best["estimator"]] += 1
    # Where lamps are many one of them is chosen for each of -l samples: a pair with a level of the scenes.
    plain = {"estimator": "mis", "lights": 9, "roulette": "on", "sampler": "independent", "adaptive": "no", "parts": "whole", "output": "exr"}
    return runs + [{"name": f"run_{len(runs) + 1:02}", "scene": "55_many_far", **plain}]


class Runner:
    def __init__(self, build, folder, run):
        self.build, self.folder, self.run = build, folder, run
        scenes = "reference/scenes"
        with open(f"{scenes}/{run['scene']}.json", encoding="utf-8") as f:
            self.s = json.load(f)
        s = self.s
        self.command = [f"{build}/pathtracer", "-q", "-r", str(s["width"]), str(s["height"]), "-m", str(s["depth"]),
                        "--direct", run["estimator"], "-l", str(run["lights"]), "--roulette", run["roulette"],
                        "--sampler", run["sampler"], f"{scenes}/{run['scene']}.dae"]
        if "environment" in s:
            self.command += ["-e", f"{scenes}/{s['environment']}"]
        if "lens_radius" in s:
            self.command += ["-b", str(s["lens_radius"]), "-d", str(s["focal_distance"])]
        if run["adaptive"] == "rule":
            self.command += ["-a", "256", "0.01"]
        if run["adaptive"] == "unbiased":
            self.command += ["--adaptive-unbiased", "0.01", "--pilot", "256"]

    def trace(self, image, samples, *options):
        self.last = image
        out = ["-f", image] + (["-f", image[:-3] + "png"] if self.run["output"] == "png" else [])
        subprocess.run(self.command + ["-s", str(samples), *options, *out], check=True, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)

    def merge(self, image, shares):
        subprocess.run([f"{self.build}/assay", "merge", image, *shares], check=True, stdout=subprocess.DEVNULL)

    def image(self, image, samples, seed):
        """One image, as the run's parts say."""
        w, h = self.s["width"], self.s["height"]
        stem = image[:-4]
        if self.run["parts"] == "whole":
            self.trace(image, samples, "--seed", seed)
        elif self.run["parts"] == "resumed":
            self.trace(image, samples // 4, "--seed", seed, "--keep-state")
            self.trace(image, samples, "--seed", seed, "--resume", image)
        elif self.run["parts"] == "merged":
            cut = [0, samples // 4 - 3, samples // 2, samples]
            shares = [f"{stem}_{a}.share.exr" for a in cut[:-1]]
            for share, a, b in zip(shares, cut, cut[1:]):
                self.trace(share, samples, "--seed", seed, "--samples", f"{a}:{b}")
            self.merge(image, shares)
        else:
            x, y = w // 2 - 3, h // 3
            cells = [(0, 0, x, y), (x, 0, w - x, y), (0, y, x, h - y), (x, y, w - x, h - y)]
            shares = [f"{stem}_{i}.cell.exr" for i in range(len(cells))]
            for share, cell in zip(shares, cells):
                self.trace(share, samples, "--seed", seed, "-p", *map(str, cell))
            self.merge(image, shares)

    def judge(self):
        """(what is wrong or None, the claim)"""
        margins = self.s["references"]["cycles"]
        out, golden = f"{self.folder}/claim.json", f"golden/{self.run['scene']}/cycles.exr"
        a = f"{self.folder}/a.exr"
        if self.run["sampler"] == "sobol":
            a = f"{self.folder}/seeds"
            os.makedirs(a)
            for seed in range(SEEDS):
                one = f"{self.folder}/one_{seed}.exr"
                self.image(one, max(64, self.s["spp"] // SEEDS), str(seed + 1))
                shutil.copy(one, f"{a}/{seed}.exr")
        else:
            self.image(a, self.s["spp"], "1")
        tile = str(self.s["tile"])
        subprocess.run([f"{self.build}/assay", "compare", "-q", "--alpha", ALPHA, "--margin",
                        str(margins["margin_global"]), "--margin-tile", str(margins["margin_tile"]), "--tile", tile,
                        "--json", out, a, golden], check=False)
        with open(out, encoding="utf-8") as f:
            claim = json.load(f)["claims"][0]
        wrong = None if claim["verdict"] == "EQUIVALENT" else claim["reason"]
        if wrong is None and self.run["output"] == "png":
            wrong = png_differs(self.last, "ambient" in self.run["scene"])
        return wrong, claim


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("runs", nargs="*")
    parser.add_argument("-o", "--out")
    parser.add_argument("--list", action="store_true")
    args = parser.parse_args()
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
    found, failed = [], 0
    for run in table():
        words = " ".join(f"{k} {v}" for k, v in run.items() if k not in ("name", "scene"))
        if args.list:
            print(run["name"], run["scene"], words)
            continue
        if args.runs and run["name"] not in args.runs:
            continue
        with tempfile.TemporaryDirectory() as folder:
            wrong, claim = Runner(args.build, folder, run).judge()
        failed += wrong is not None
        text = f"{claim['verdict']}, {100 * claim['difference']:+.2f} %, MDB {100 * claim['mdb_global']:.2f} %"
        found.append({**run, "verdict": claim["verdict"], "difference": round(claim["difference"], 6)})
        print(f"{run['name']} {run['scene']} ({words}): {text}{'' if wrong is None else ' FAILED: ' + wrong}", flush=True)
    if args.out:
        with open(args.out, "w", encoding="utf-8") as f:
            json.dump({"date": str(datetime.date.today()), "runs": found}, f, indent=0)
            f.write("\n")
    if not args.list:
        print(f"{failed} failed")
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
