"""Where mutants are built and run: objects, links, what there is to render and to test; each run within limits of time and memory."""
import hashlib
import json
import os
import resource
import shutil
import subprocess
from collections import Counter, defaultdict

from pool import pool

SMOKE_SPP, POOL_SPP = 8, 16
STRICT = ["-Werror=int-conversion", "-Werror=incompatible-pointer-types", "-Werror=implicit-function-declaration"]


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
    """Exit status; negative if a signal ended it (the CPU limit, for example), 124 past the wall-clock limit."""
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


class Workshop:
    def __init__(self, build, name="machine", tests=None, scenes=None, shard=(0, 1)):
        """Results go below BUILD/name. tests, scenes: use only these, and all of them for every mutant."""
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
        self.sanitize = make_says(build, "print-sanitize").split()
        self.sanitized = set(make_says(build, "print-sanitized").split())  # tests that `make check` runs so
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
        """An object of the unchanged sources, compiled like mutants; to be called while the tree is unchanged."""
        path = os.path.join(self.base, name + ".o")
        if not os.path.exists(path):
            os.makedirs(os.path.dirname(path), exist_ok=True)
            if not self.compile(name, path):
                raise SystemExit("run.py: %s does not compile" % name)
        return path

    def mutated(self, names, fresh):
        """Compiles all names; None if one does not compile, else {name: object} of those that differ from base."""
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
        return run(["g++"] + self.gold + list(more) + ["-o", out] + objects + [os.path.join(self.build, a) for a in archives] + self.libs + ["-lcmocka"],
                   60) == 0

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

    def image(self, name):
        return os.path.join(self.dir, "images", name.replace("/", "+").replace(" ", "_") + ".exr")

    def pool_runs(self):
        return pool(self.cs184, self.dir + "/pool")

    def render(self, program, name, args, out, spp):
        spp = [] if "-s" in args else ["-s", str(64 if "-a" in args else spp)]
        if os.path.exists(out):
            os.unlink(out)
        return run([program, "-q", "-t", "1"] + spp + args + ([] if "-f" in args else ["-f", out]), 5)
