"""What run.py has to know beforehand: images and verdicts of the unchanged renderer, the time of each unit test, and
which lines each test and each render runs (gcov)."""
import json
import os
import subprocess
from collections import Counter, defaultdict

from workshop import POOL_SPP, SMOKE_SPP, Workshop, cpu_now, run

TEST_CPU = 10  # seconds; unit tests that take longer are left out


class Preparation(Workshop):
    def prepare(self):
        """Measures baselines, times, and the lines that each test and render runs; goes on after an interruption."""
        base = os.path.join(self.dir, "validate")
        if not os.path.exists(base + "/results.json") or not os.path.exists(self.base):
            os.makedirs(self.base, exist_ok=True)
            run([self.build + "/assay", "validate", "--threads", "1", "-q", "-o", base] + [w for x in self.scenes or () for w in ("--only", x)], 3600)
        with open(base + "/results.json") as f:
            r = json.load(f)
        cost, sides = Counter(), set()
        for c in r["claims"] + r["consistency"]:
            side = (c["scene"], c.get("a", "consistency"))
            if side not in sides and side[1].startswith(("pathtracer", "consistency")):
                sides.add(side)
                cost[c["scene"]] += c.get("seconds_a", 0) + c.get("seconds", 0)
        info = {"claims": len(r["claims"]) + len(r["consistency"]), "cost": cost, "tests": {}, "runs": {}, "lines": {}, "sources": self.sources}
        if os.path.exists(self.dir + "/info.json"):
            with open(self.dir + "/info.json") as f:
                before = json.load(f)
            info = before if before["sources"] == self.sources else info
        self.base_images()
        if self.scenes is not None:
            for name in [n for n, _, _ in self.suite_runs()] + [n for n, _ in self.pool_runs()] + list(self.tests()):
                info["runs"][name] = {"lines": None, "objects": []}
            info["tests"] = {t: 0.1 for t in self.tests()}
            return self.store(info)
        cov = os.path.join(self.dir, "cov")
        subprocess.run(["make", "-s", "-k", "-j2", "BUILD=" + cov, "WERROR=", "CC=gcc", "OPT=-O1 -fno-math-errno -fno-trapping-math --coverage",
                        cov + "/pathtracer"] + [cov + "/tests/" + t for t in self.tests()], stdout=subprocess.DEVNULL)
        for name, args in [(n, a) for n, _, a in self.suite_runs()] + self.pool_runs():
            spp = [] if "-s" in args else ["-s", "64" if "-a" in args else "2"]
            self.cover(info, name, cov, [cov + "/pathtracer", "-q", "-t", "1"] + spp + args + ["-f", self.work + "/cov.exr"])
        for name in sorted(self.tests()):
            program = os.path.join(self.build, "tests", name)
            if name in info["runs"] or not os.path.exists(program) or not os.path.exists(cov + "/tests/" + name):
                continue
            before = cpu_now()
            if run([program], TEST_CPU) == 0:
                cost = round(cpu_now() - before, 2)
                self.cover(info, name, cov, [cov + "/tests/" + name])
                if info["runs"][name]["lines"]:
                    info["tests"][name] = cost
            else:
                info["runs"][name] = {"lines": {}, "objects": []}
            self.store(info)
        self.store(info)

    def store(self, info):
        with open(self.dir + "/info.new", "w") as f:
            json.dump(info, f)
        os.replace(self.dir + "/info.new", self.dir + "/info.json")

    def cover(self, info, name, cov, argv):
        if name in info["runs"]:
            return
        found = [os.path.join(d, f) for d, _, fs in os.walk(cov + "/renderer") for f in fs if f.endswith(".gcda")]
        for f in found:
            os.unlink(f)
        run(argv, 300)
        found = [os.path.join(d, f) for d, _, fs in os.walk(cov + "/renderer") for f in fs if f.endswith(".gcda")]
        lines, objects = defaultdict(set), [os.path.relpath(f, cov)[:-5] for f in found]
        told = subprocess.run(["gcov", "-j", "-t"] + found, capture_output=True, text=True).stdout if found else ""
        ran = set()
        for text in told.splitlines():
            data = json.loads(text)
            for f in data["files"]:
                path = os.path.normpath(f["file"])
                if path.startswith("renderer/"):
                    known = info["lines"].setdefault(path, {})
                    for l in f["lines"]:
                        known[str(l["line_number"])] = 1
                        if l["count"] > 0:
                            lines[path].add(l["line_number"])
                            ran.add(data["data_file"])
        objects = sorted({os.path.relpath(os.path.join(cov, o), cov)[:-5] if o.endswith(".gcda") else o for o in objects
                          if any(o.split("/")[-1] in r for r in ran)})
        info["runs"][name] = {"lines": {f: sorted(l) for f, l in lines.items()}, "objects": objects}

    def base_images(self):
        os.makedirs(self.dir + "/images", exist_ok=True)
        for name, _, args in self.suite_runs():
            self.render(self.build + "/pathtracer", name, args, self.image(name), SMOKE_SPP)
        for name, args in self.pool_runs():
            self.render(self.build + "/pathtracer", name, args, self.image(name), POOL_SPP)
