#!/usr/bin/python3
"""Builds mutants (mutate.py), and sees who finds them: the unit tests, `assay validate`, both, or none.

    tests/mutants/machine/run.py [--build DIR] prepare                    once for a state of renderer/: ten CPU minutes
    tests/mutants/machine/run.py [--build DIR] go SAMPLE [--seconds S] [--shard I/N] [--again]
                                                 the next mutants of sample 1 or 2; may be killed, and goes on; shards run side by side;
                                                 --again: the survivors once more, by the tests as they are now
    tests/mutants/machine/run.py [--build DIR] one ID...                  these mutants, to the screen
    tests/mutants/machine/run.py [--build DIR] page                       README.md from the results, which it stores beside it

Results are appended to DIR/machine/sampleN.tsv, a line for each mutant; `page` copies them to tests/mutants/machine. `go` begins with
what is stored there. Every beginning of a sample is a sample stratified by file.
"""
import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import time

sys.dont_write_bytecode = True  # nothing is written beside the sources
import mutate
from page import COLUMNS, by_unit, by_validate, write_page
from prepare import Preparation
from workshop import POOL_SPP, SMOKE_SPP, Workshop, cpu_now, limited, run

HERE = os.path.dirname(os.path.abspath(__file__))
EMBREE = "-lembree4" if os.path.exists("/usr/include/embree4") else "-lembree3"
QUICK = 1.0  # seconds; longer unit tests are asked only where neither those nor validate find it
VALIDATE_CPU = 25  # seconds that a mutant may spend with validate, after which it counts as not found


class Runner(Workshop):
    def load(self):
        path = os.path.join(self.dir, "info.json")
        if not os.path.exists(path):
            raise SystemExit("run.py: `run.py prepare` comes first")
        if not self.pool_runs():
            print("run.py: no scenes in %s (ASSAY_CS184): whether a mutant changes an image stays unknown" % self.cs184, file=sys.stderr)
        with open(path) as f:
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
        """1: changes an image, 0: does not, -: there is no pool. The first change, in the order of pool.py, decides."""
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
        """(verdict, scene and claim) that found it, or ("-", why not): "not run" (no render of the suite runs it),
        "same" (no image of 8 samples changes), "passed", "inconclusive", "out of time"."""
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
            if c.get("verdict") == "DIFFERENT" and not c.get("passed", False):
                return "DIFFERENT", where
            if not c.get("passed", False):  # without a verdict: its image cannot be judged
                worst = ("INCONCLUSIVE" if c.get("verdict") in ("INCONCLUSIVE", "NO DIFFERENCE FOUND") else "DIED", where)
        if worst[0] == "" and status not in (0, 1, 2):
            return "DIED", scene
        return worst

    def judge_tests(self, m, objects, rest, fresh, below=None):
        """The first unit test that fails, or "-"; "?" if only those were asked that take less than `below` seconds and need no kernel of
        `rest`: those of other instruction sets, which are compiled when only tests are left that run them. None if they do not compile."""
        tests, sources = self.info["tests"], self.tests()
        order = [t for t in tests if t not in self.asked and self.executes(t, m)]
        stem = os.path.splitext(os.path.basename(m.file))[0]

        def price(t):
            own = 3 if t[5:] in stem or stem.split("_")[0] in t else 0
            return (tests[t] + 0.4) / (0.2 + own + 3 * self.kills[(m.file, t)] + 0.2 * self.kills[t])

        late = {t for t in order if self.runs[t][1] & set(rest)}
        left = set() if below is None else {t for t in order if tests[t] >= below or t in late}
        order = [t for t in order if t not in left]
        for t in sorted(order, key=lambda t: (t in late, price(t))):
            if t in late and rest:
                for name in rest:
                    objects[name] = os.path.join(fresh, name.replace("/", "_") + ".o")
                    if not self.compile(name, objects[name], ["-O1"]):
                        return None
                rest = []
            self.asked.add(t)
            if self.test_fails(t, sources[t], m, objects, fresh):
                return t
        if left:
            return "?"
        return self.judge_sanitized(m, [n for n in self.depends[m.file] if n in objects and not self.is_narrow(n)], order, late, fresh)

    def judge_sanitized(self, m, names, tests, late, fresh):
        """If no test finds it, the quick ones that `make check` runs under sanitizers are asked again, built so."""
        tests = [t for t in tests if t in self.sanitized and t not in late and self.info["tests"][t] < QUICK
                 and os.path.exists(os.path.join(self.build, "san", self.tests()[t] + ".o"))]
        objects = {}
        for name in names if tests else ():
            objects[name] = os.path.join(fresh, "san_" + name.replace("/", "_") + ".o")
            if not self.compile(name, objects[name], self.sanitize):
                return "-"
        for t in tests:
            if self.test_fails(t, self.tests()[t], m, objects, fresh, "san/"):
                return t
        return "-"

    def test_fails(self, test, source, m, objects, fresh, san=""):
        own, flags = os.path.join(self.build, san + source + ".o"), self.sanitize if san else []
        if source in self.depends[m.file]:
            own = os.path.join(fresh, san.replace("/", "_") + test + ".o")
            if not os.path.exists(own) and not self.compile(source, own, flags or ["-O1"]):
                return False
        program = os.path.join(fresh, test)
        if not self.link(program, [own, self.build + "/" + san + "tests/support/asan_options.c.o"] + list(objects.values()),
                         [san + "libtests.a", san + "libassay.a"], flags + ([EMBREE] if test == "test_embree" else [])):
            return False
        limit = (30 if san else 3) * self.info["tests"][test] + 2 + 8 * bool(san)
        p = subprocess.Popen([program], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                             preexec_fn=limited(limit, 1 << 46 if san else 4 << 30))
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
        self.asked = set()
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
            return "mutant", self.judge_tests(m, more, [], fresh), "-", "not run", "0"
        program = os.path.join(fresh, "pathtracer")
        own = first.get("renderer/pathtracer/pathtracer.c", os.path.join(self.build, "renderer/pathtracer/pathtracer.c.o"))
        if not self.link(program, [own] + [o for n, o in first.items() if n != "renderer/pathtracer/pathtracer.c"], ["libassay.a"]):
            return "stillborn", "", "", "", ""
        first.pop("renderer/pathtracer/pathtracer.c", None)
        image = self.judge_pool(program, m)
        unit = self.judge_tests(m, first, rest, fresh, QUICK)
        if unit not in ("?", "-") and image == "0":
            return "mutant", unit, "?", "not asked", image
        verdict, by = self.judge_validate(program, m)
        if unit == "?" and verdict == "-":
            unit = self.judge_tests(m, first, rest, fresh)
        if unit is None:
            return "stillborn", "", "", "", ""
        return "mutant", unit, verdict, by, image

    # A sample.

    def go(self, number, seconds, again=False):
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
                    if again and r["kind"] == "mutant" and not (by_unit(r) or by_validate(r)):
                        done.remove(r["id"])
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
    p.add_argument("--again", action="store_true", help="survivors too, by the tests as they are now")
    a = p.parse_args()
    if a.what == "page":
        for n in (1, 2):
            made = os.path.join(a.build, "machine", "sample%d.tsv" % n)
            if os.path.exists(made):
                shutil.copy(made, HERE)
        write_page(HERE)
        return
    shard, shards = map(int, a.shard.split("/"))
    if a.what == "prepare":
        Preparation(a.build).prepare()
        return
    r = Runner(a.build, shard=(shard - 1, shards))
    if a.what == "go":
        r.go(int(a.more[0]), a.seconds, a.again)
    else:
        r.load()
        for m in mutate.all_mutants():
            if m.id in a.more:
                print("\t".join(r.evaluate(m)[c] for c in COLUMNS), flush=True)


if __name__ == "__main__":
    main()
