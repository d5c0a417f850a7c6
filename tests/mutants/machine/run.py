#!/usr/bin/python3
"""Builds mutants (mutate.py), and sees who finds them: the unit tests, `assay validate`, both, or none.

    tests/mutants/machine/run.py [--build DIR] prepare                    once for a state of renderer/: ten CPU minutes
    tests/mutants/machine/run.py [--build DIR] go SAMPLE [--seconds S] [--shard I/N]
                                                 the next mutants of sample 1 or 2; may be killed, and goes on; shards run side by side
    tests/mutants/machine/run.py [--build DIR] one ID...                  these mutants, to the screen
    tests/mutants/machine/run.py [--build DIR] page                       README.md from the results, which it stores beside it

Results are appended to DIR/machine/sampleN.tsv, a line for each mutant; `page` copies them to tests/mutants/machine. `go` begins with
what is stored there. Every beginning of a sample is a sample stratified by file.
"""
import argparse
import hashlib
import json
import os
import re
import resource
import shutil
import subprocess
import sys
import time
from collections import Counter, defaultdict

sys.dont_write_bytecode = True  # nothing is written beside the sources
import mutate
from page import COLUMNS, write_page
from pool import pool

HERE = os.path.dirname(os.path.abspath(__file__))
SMOKE_SPP, POOL_SPP = 8, 16
VALIDATE_CPU = 25  # seconds that a mutant may spend with validate, after which it counts as not found
TEST_CPU = 10  # unit tests that take longer are left out
STRICT = ["-w", "-Werror=int-conversion", "-Werror=incompatible-pointer-types", "-Werror=implicit-function-declaration"]


def cpu_now():
    u = resource.getrusage(resource.RUSAGE_CHILDREN)
    return u.ru_utime + u.ru_stime


def limited(cpu_s, memory=4 << 30):
    def limits():
        resource.setrlimit(resource.RLIMIT_CPU, (int(cpu_s) + 1, int(cpu_s) + 2))
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 28, 1 << 28))
    return limits


def run(argv, cpu_s=600, cwd=None, **more):
    """Exit status; negative or 124 if it died or took longer than it may."""
    try:
        return subprocess.run(argv, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=cwd,
                              preexec_fn=limited(cpu_s), timeout=20 * cpu_s + 20, **more).returncode
    except subprocess.TimeoutExpired:
        return 124


def source_hash():
    h = hashlib.sha256()
    for d, _, fs in sorted(os.walk("renderer")):
        for f in sorted(fs):
            if f.endswith((".c", ".h")):
                with open(os.path.join(d, f), "rb") as source:
                    h.update(f.encode() + source.read())
    return h.hexdigest()[:12]


def make_says(build, target):
    return subprocess.run(["make", "-s", "--no-print-directory", "BUILD=" + build, target], check=True, capture_output=True,
                          text=True).stdout.strip()


class Runner:
    def __init__(self, build, name="machine", tests=None, scenes=None, shard=(0, 1)):
        """Results below BUILD/name. With tests and scenes: those alone, all of them for every mutant."""
        self.build = os.path.abspath(build)
        self.dir = os.path.join(self.build, name)
        self.some_tests, self.scenes = tests, scenes
        self.shard = shard
        self.tree = os.path.join(self.dir, "tree%d" % shard[0])
        self.work = os.path.join(self.dir, "work%d" % shard[0])
        self.sources = source_hash()
        self.base = os.path.join(self.dir, "base", self.sources)
        for d in (self.dir, self.tree, self.work):
            os.makedirs(d, exist_ok=True)
        self.cc = [w for w in make_says(build, "print-compile").split()]
        self.libs = make_says(build, "print-libs").split()
        self.kernels = {}  # object's name without .o: (source, flags)
        for line in make_says(build, "print-kernels").splitlines():
            words = line.rstrip(";").split()
            self.kernels[words[0]] = (words[1], words[2:])
        with open("/proc/cpuinfo") as f:
            flags = f.read().split()
        self.widest = "avx512" if "avx512dq" in flags else "avx2" if "avx2" in flags else "sse42"
        self.cs184 = os.environ.get("ASSAY_CS184", "../shared/scenes/cs184")
        self.gold = ["-fuse-ld=gold"] if shutil.which("ld.gold") else []
        self.kills = Counter()
        self.read_dependencies()

    # What is compiled from what.

    def read_dependencies(self):
        self.depends = defaultdict(set)  # a file: objects of renderer, and tests, that see it
        for d, _, fs in os.walk(self.build):
            if d.startswith(self.dir) or "/renderer" not in d and "/tests" not in d or d[len(self.build):].split("/")[1] not in ("renderer", "tests"):
                continue
            for f in fs:
                if f.endswith(".c.d"):
                    name = os.path.relpath(os.path.join(d, f), self.build)[:-2]
                    with open(os.path.join(d, f)) as h:
                        for word in h.read().split():
                            if word.startswith(("renderer/", "./renderer/")) or "/../" in word:
                                self.depends[os.path.normpath(word)].add(name)

    def is_narrow(self, name):
        """A kernel of another instruction set than the one that this machine renders with."""
        return name in self.kernels and not name.endswith("_%s.c" % self.widest)

    def fresh_tree(self):
        shutil.rmtree(self.tree)
        os.makedirs(self.tree)
        shutil.copytree("renderer", os.path.join(self.tree, "renderer"))
        for d in ("reference", "tools", "tests"):
            os.symlink(os.path.abspath(d), os.path.join(self.tree, d))

    def compile(self, name, out, extra=()):
        source, flags = self.kernels.get(name, (name, []))
        return run(self.cc + STRICT + flags + list(extra) + ["-c", "-o", out, source], 120, cwd=self.tree) == 0

    def base_object(self, name):
        """Of the sources as they are, compiled in the same way as mutants; to be asked for while the tree is not changed."""
        path = os.path.join(self.base, name + ".o")
        if not os.path.exists(path):
            os.makedirs(os.path.dirname(path), exist_ok=True)
            if not self.compile(name, path):
                raise SystemExit("run.py: %s does not compile" % name)
        return path

    def mutated(self, names, fresh):
        """Compiles; None if one does not compile, else the objects that are not the same."""
        changed = {}
        for name in names:
            out = os.path.join(fresh, name.replace("/", "_") + ".o")
            if not self.compile(name, out):
                return None
            with open(out, "rb") as a, open(os.path.join(self.base, name + ".o"), "rb") as b:
                if a.read() != b.read():
                    changed[name] = out
        return changed

    def link(self, out, objects, archives, more=()):
        return run(["g++"] + self.gold + ["-o", out] + objects + [os.path.join(self.build, a) for a in archives] + self.libs + list(more), 60) == 0

    # What there is to run.

    def suite_runs(self):
        """Renders of the suite: (name, scene, arguments)."""
        runs = []
        for f in sorted(os.listdir("reference/scenes")):
            if not f.endswith(".json") or f.startswith("9") or self.scenes is not None and f[:-5] not in self.scenes:
                continue
            with open("reference/scenes/" + f) as h:
                s = json.load(h)
            scene = f[:-5]
            dae = "reference/scenes/" + s.get("scene", scene + ".dae")
            if not os.path.exists(dae):
                continue
            args = ["-r", str(s["width"]), str(s["height"]), "-m", str(s["depth"])]
            if "environment" in s:
                args += ["-e", "reference/scenes/" + s["environment"]]
            if "lens_radius" in s:
                args += ["-b", str(s["lens_radius"]), "-d", str(s["focal_distance"])]
            runs.append((scene, scene, args + [dae]))
            for v in s.get("variants", []):
                runs.append((scene + "/" + v["name"], scene, args + v["options"] + [dae]))
            adaptive = s.get("consistency", {}).get("adaptive")
            if adaptive:
                runs.append((scene + "/consistency", scene, args + ["-a", str(adaptive["batch"]), str(adaptive["tolerance"]), dae]))
        return runs

    def tests(self):
        found = {os.path.basename(p)[:-4]: os.path.relpath(p, self.build)[:-2]
                for folder in ("renderer", "reference") for d, _, fs in os.walk(os.path.join(self.build, "tests", folder)) for p in
                [os.path.join(d, f) for f in fs if f.startswith("test_") and f.endswith(".c.o")]}
        return {t: o for t, o in found.items() if self.some_tests is None or t in self.some_tests}

    # Once.

    def prepare(self, keep=None):
        """Baselines, times, and which line is run by which test and which render."""
        self.fresh_tree()
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

    def image(self, name):
        return os.path.join(self.dir, "images", name.replace("/", "+").replace(" ", "_") + ".exr")

    def pool_runs(self):
        return pool(self.cs184, self.dir + "/pool")

    def render(self, program, name, args, out, spp):
        spp = [] if "-s" in args else ["-s", str(64 if "-a" in args else spp)]
        if os.path.exists(out):
            os.unlink(out)
        return run([program, "-q", "-t", "1"] + spp + args + ([] if "-f" in args else ["-f", out]), 1)

    # One mutant.

    def load(self):
        with open(os.path.join(self.dir, "info.json")) as f:
            self.info = json.load(f)
        if self.info["sources"] != self.sources:
            raise SystemExit("run.py: the renderer has changed since `run.py prepare`")
        self.known = {f: sorted(map(int, ls)) for f, ls in self.info["lines"].items()}
        self.runs = {n: (r["lines"] and {f: set(ls) for f, ls in r["lines"].items()}, set(r["objects"])) for n, r in self.info["runs"].items()}
        self.fresh_tree()

    def executes(self, name, m):
        """Whether a test or a render may run the mutant: the line of the change, or the nearest ones that gcov knows before and after."""
        if self.runs[name][0] is None:
            return True
        lines = self.runs[name][0].get(m.file)
        if not lines:
            return False
        known = self.known.get(m.file, [])
        last = m.line + m.before.count("\n")
        near = [l for l in known if m.line <= l <= last] + [l for l in known if l < m.line][-1:] + [l for l in known if last < l <= last + 3][:1]
        return not near or any(l in lines for l in near)

    def compare(self, pairs):
        out = subprocess.run([self.build + "/tests/image_change"] + [p for pair in pairs for p in pair], capture_output=True, text=True)
        return [l.split() for l in out.stdout.splitlines()]

    def judge_pool(self, program, m):
        """1: changes an image, 0: does not, -: there is no pool. Cheap ones first; the first change decides."""
        runs = [(n, a) for n, a in self.pool_runs() if n in self.runs and self.executes(n, m) and n != "make sky"]
        if not self.pool_runs():
            return "-"
        for i in range(0, len(runs), 5):
            pairs = []
            for name, args in runs[i:i + 5]:
                out = os.path.join(self.work, "pool%d.exr" % len(pairs))
                if self.render(program, name, args, out, POOL_SPP) != 0:
                    return "1"
                pairs.append((self.image(name), out))
            if any(w[0] == "unreadable" or w[-1] == "1" for w in self.compare(pairs)):
                return "1"
        return "0"

    def judge_validate(self, program, m):
        """Who found it: (verdict, scene and claim). Without: "not run" (no render of the suite runs the line), "same" (no image of 8
        samples changes), "passed", "inconclusive", "out of time"."""
        tasks, started = {}, cpu_now()
        covering = [r for r in self.suite_runs() if r[0] in self.runs and self.executes(r[0], m)]
        if not covering:
            return "-", "not run"
        covering.sort(key=lambda r: self.info["cost"][r[1]])
        pairs = []
        for name, scene, args in covering:
            out = os.path.join(self.work, "smoke%d.exr" % len(pairs))
            status = self.render(program, name, args, out, SMOKE_SPP)
            if status != 0:
                return "DIED", name
            pairs.append((self.image(name), out))
        for (name, scene, _), w in zip(covering, self.compare(pairs)):
            if w[0] == "unreadable":
                return "DIED", name
            if w[0] == "same":
                continue
            t_mean, t_var, changed = float(w[1]), float(w[3]), w[4] == "1"
            cost = self.info["cost"][scene] + 0.1
            own = scene in ("12_point_plane", "13_square_patch", "15_square_overhead", "19_glass_slab")
            weight = 0.3 if own and t_mean < 3 else 1 if changed else 3 if t_mean > 5 else 10
            tasks[scene] = min(tasks.get(scene, 1e9), cost * weight)
        if not tasks:
            return "-", "same"
        doubt = ""
        for scene in sorted(tasks, key=tasks.get):
            if cpu_now() - started + self.info["cost"][scene] > VALIDATE_CPU:
                return "-", "out of time"
            verdict, where = self.validate(program, scene)
            if verdict in ("DIFFERENT", "DIED"):
                return verdict, where
            doubt = doubt or (verdict == "INCONCLUSIVE" and where)
        return "-", "inconclusive: " + doubt if doubt else "passed"

    def validate(self, program, scene):
        """As `make validate` judges this scene among all claims of the suite."""
        out = os.path.join(self.work, "report")
        shutil.rmtree(out, ignore_errors=True)
        status = run([self.build + "/assay", "validate", "--only", scene, "--of-claims", str(self.info["claims"]), "--pathtracer", program,
                      "--threads", "1", "--timeout", "60", "-q", "-o", out], 120)
        try:
            with open(out + "/results.json") as f:
                r = json.load(f)
        except (OSError, ValueError):
            return "DIED", scene
        worst = ("", "")
        for c in r["claims"] + r["consistency"]:
            where = "%s %s" % (c["scene"], "consistency" if "engine" in c else (c["a"] + "/" if c["a"] != "pathtracer" else "").replace("pathtracer-", "") + c["b"])
            if c["verdict"] == "DIFFERENT" and not c.get("passed", False):
                return "DIFFERENT", where
            if not c.get("passed", False):
                worst = ("INCONCLUSIVE" if c["verdict"] in ("INCONCLUSIVE", "NO DIFFERENCE FOUND") else "DIED", where)
        if worst[0] == "" and status not in (0, 1, 2):
            return "DIED", scene
        return worst

    def judge_tests(self, m, first, rest, fresh):
        """The first unit test that fails, or "-". `rest`: kernels of other instruction sets, compiled when only tests are left that use
        them; returns None if those do not compile."""
        tests, sources = self.info["tests"], self.tests()
        order = [t for t in tests if self.executes(t, m)]
        stem = os.path.splitext(os.path.basename(m.file))[0]

        def price(t):
            own = 3 if t[5:] in stem or stem.split("_")[0] in t else 0
            return (tests[t] + 0.4) / (0.2 + own + 3 * self.kills[(m.file, t)] + 0.2 * self.kills[t])

        order.sort(key=price)
        late = [t for t in order if rest and self.runs[t][1] & set(rest)] if rest is not None else []
        objects = dict(first)
        for t in [t for t in order if t not in late]:
            if self.test_fails(t, sources[t], m, objects, fresh):
                return t
        if late:
            more = self.mutated(rest, fresh)
            if more is None:
                return None
            objects.update(more)
            for t in late:
                if self.test_fails(t, sources[t], m, objects, fresh):
                    return t
        return "-"

    def test_fails(self, test, source, m, objects, fresh):
        own = os.path.join(self.build, source + ".o")
        if source in self.depends[m.file]:
            own = os.path.join(fresh, test + ".o")
            if not os.path.exists(own) and not self.compile(source, own, ["-O1"]):
                return False
        program = os.path.join(fresh, test)
        more = ["-lcmocka"] + (["-lembree3"] if test == "test_embree" else [])
        if not self.link(program, [own, self.build + "/tests/support/asan_options.c.o"] + list(objects.values()),
                         ["libtests.a", "libassay.a"], more):
            return False
        limit = 3 * self.info["tests"][test] + 2
        p = subprocess.Popen([program], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                             preexec_fn=limited(limit))
        failed = False
        for line in p.stdout:
            if "[  FAILED  ]" in line:
                failed = True
                p.kill()
                break
        p.stdout.close()
        status = p.wait()
        os.unlink(program)
        if failed or status != 0:
            self.kills[(m.file, test)] += 1
            self.kills[test] += 1
            return True
        return False

    def evaluate(self, m):
        started = cpu_now()
        fresh = os.path.join(self.work, "mutant")
        shutil.rmtree(fresh, ignore_errors=True)
        os.makedirs(fresh)
        path = os.path.join(self.tree, m.file)
        with open(path) as f:
            source = f.read()
        for name in sorted(self.depends[m.file]):
            if name.startswith("renderer/"):
                self.base_object(name)
        with open(path, "w") as f:
            f.write(mutate.apply(m, source))
        try:
            kind, unit, verdict, by, image = self.classify(m, fresh)
        finally:
            with open(path, "w") as f:
                f.write(source)
        values = [m.id, m.file, m.line, m.operator, mutate.one_line(m.before)[:60], mutate.one_line(m.after)[:60], kind, unit, verdict, by, image,
                  "%.1f" % (cpu_now() - started)]
        return dict(zip(COLUMNS, map(str, values)))

    def classify(self, m, fresh):
        names = sorted(o for o in self.depends[m.file] if o.startswith("renderer/"))
        now, rest = [n for n in names if not self.is_narrow(n)], [n for n in names if self.is_narrow(n)]
        first = self.mutated(now, fresh)
        if first is None:
            return "stillborn", "", "", "", ""
        if not first:
            more = self.mutated(rest, fresh)
            if more is None:
                return "stillborn", "", "", "", ""
            if not more:
                return "equivalent", "", "", "", ""
            return "mutant", self.judge_tests(m, more, None, fresh), "-", "not run", "0"
        program = os.path.join(fresh, "pathtracer")
        own = first.get("renderer/pathtracer/pathtracer.c", os.path.join(self.build, "renderer/pathtracer/pathtracer.c.o"))
        if not self.link(program, [own] + [o for n, o in first.items() if n != "renderer/pathtracer/pathtracer.c"], ["libassay.a"]):
            return "stillborn", "", "", "", ""
        image = self.judge_pool(program, m)
        verdict, by = self.judge_validate(program, m)
        unit = self.judge_tests(m, {n: o for n, o in first.items() if n != "renderer/pathtracer/pathtracer.c"}, rest, fresh)
        if unit is None:
            return "stillborn", "", "", "", ""
        return "mutant", unit, verdict, by, image

    # Many.

    def go(self, number, seconds):
        path = os.path.join(self.dir, "sample%d.tsv" % number)
        stored = os.path.join(HERE, "sample%d.tsv" % number)
        if not os.path.exists(path) and os.path.exists(stored):
            shutil.copy(stored, path)
        done = set()
        if os.path.exists(path):
            with open(path) as f:
                for line in f.read().splitlines()[1:]:
                    r = dict(zip(COLUMNS, line.split("\t")))
                    done.add(r["id"])
                    if r["unit"].startswith("test_"):
                        self.kills[(r["file"], r["unit"])] += 1
                        self.kills[r["unit"]] += 1
        else:
            with open(path, "w") as f:
                f.write("\t".join(COLUMNS) + "\n")
        self.load()
        started = time.time()
        for i, m in enumerate(mutate.sample(mutate.all_mutants(), number)):
            if time.time() - started > seconds:
                break
            if m.id in done or i % self.shard[1] != self.shard[0]:
                continue
            r = self.evaluate(m)
            with open(path, "a") as f:
                f.write("\t".join(r[c] for c in COLUMNS) + "\n")
            print("\t".join(r[c] for c in COLUMNS), flush=True)


def main():
    p = argparse.ArgumentParser(usage=__doc__.split("\n\n")[1])
    p.add_argument("--build", default="build")
    p.add_argument("what", choices=["prepare", "go", "one", "page"])
    p.add_argument("more", nargs="*")
    p.add_argument("--seconds", type=float, default=1e9)
    p.add_argument("--shard", default="1/1")
    a = p.parse_args()
    if a.what == "page":
        for n in (1, 2):
            made = os.path.join(a.build, "machine", "sample%d.tsv" % n)
            if os.path.exists(made):
                shutil.copy(made, HERE)
        write_page(HERE)
        return
    shard, shards = map(int, a.shard.split("/"))
    r = Runner(a.build, shard=(shard - 1, shards))
    if a.what == "prepare":
        r.prepare()
    elif a.what == "go":
        r.go(int(a.more[0]), a.seconds)
    else:
        r.load()
        for m in mutate.all_mutants():
            if m.id in a.more:
                print("\t".join(r.evaluate(m)[c] for c in COLUMNS), flush=True)


if __name__ == "__main__":
    main()
