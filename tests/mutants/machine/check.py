#!/usr/bin/python3
"""check.py BUILD: what mutate.py, run.py and page.py have to do right, on a small file and on planted mutants. Lines "ok ..." and
"not ok ..."; 20 CPU seconds."""
import collections
import os
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True  # nothing is written beside the sources
import mutate
import page
import prepare
import run

SAMPLE = """#include <math.h>
/* Not a + b; nor "if (a < b)". */
#define TWICE(a) ((a) * 2)
struct point { float x, y, z; };
enum { SIDE = 3 };
static const float weight[] = {0.5f, 0};
static float length2(const struct point *p);
static float length2(const struct point *p)
{
    return p->x * p->x + p->y * p->y + p->z * p->z;
}
float walk(const float *at, int n, float *out)
{
    float best = -1; // n - 1
    const float *end = at + n;
    for (int i = 0; i < n && at[i] >= 0; i++)
        best = best < at[i] ? at[i] : best;
    struct point q = {best, TWICE(best), 0};
    if (end != at)
        *out = powf(best, weight[0]) - length2(&q);
    while (n > 0x10)
        n -= SIDE;
    return fmaxf(best, 1e-3f);
}
"""
# By hand, from the text above: operator, what stands there, what is put in its place.
EXPECTED = {
    ("arithmetic", "*", "/"): 3, ("arithmetic", "+", "-"): 3, ("arithmetic", "-", "+"): 1, ("arithmetic", "-=", "+="): 1,
    ("relational", "<", "<="): 2, ("relational", ">=", ">"): 1, ("relational", "!=", "=="): 1, ("relational", ">", ">="): 1,
    ("logical", "&&", "||"): 1, ("unary", "-", ""): 1,
    ("negated", "end != at", "!(end != at)"): 1, ("negated", "n > 0x10", "!(n > 0x10)"): 1, ("negated", "best < at[i]", "!(best < at[i])"): 1,
    ("axis", "x", "y"): 2, ("axis", "y", "z"): 2, ("axis", "z", "x"): 2, ("call", "fmaxf", "fminf"): 1,
    ("swapped", "best, weight[0]", "weight[0], best"): 1, 
    ("dropped", "best = best < at[i] ? at[i] : best;", ";"): 1, ("dropped", "*out = powf(best, weight[0]) - length2(&q);", ";"): 1,
    ("dropped", "n -= SIDE;", ";"): 1,
    ("constant", "0.5f", "0.55f"): 1, ("constant", "0.5f", "0.25f"): 1, ("constant", "0", "1"): 5, ("constant", "1", "2"): 1,
    ("constant", "1", "0"): 1, ("constant", "0x10", "0x11"): 1, ("constant", "1e-3f", "0.0011f"): 1, ("constant", "1e-3f", "0.0005f"): 1,
}


def say(what, right, why=""):
    print("ok %s" % what if right else "not ok %s: %s" % (what, why), flush=True)


def check_mutator(folder):
    ms = mutate.mutants_of("sample.c", SAMPLE)
    found = {}
    for m in ms:
        key = (m.operator, m.before, m.after)
        found[key] = found.get(key, 0) + 1
    rounded = {(o, b, a.replace("0.0011000000000000001", "0.0011").replace("0.55000000000000004", "0.55")): n for (o, b, a), n in found.items()}
    differ = {k: (rounded.get(k, 0), EXPECTED.get(k, 0)) for k in set(rounded) | set(EXPECTED) if rounded.get(k, 0) != EXPECTED.get(k, 0)}
    say("mutator: the mutants of a small file, counted by hand", not differ, differ)
    texts = [mutate.apply(m, SAMPLE) for m in ms]
    say("mutator: all different", len(set(texts)) == len({m.id for m in ms}) == len(ms) and SAMPLE not in texts)
    refused = 0
    for m, text in zip(ms, texts):
        path = os.path.join(folder, "sample.c")
        with open(path, "w") as f:
            f.write(text)
        refused += subprocess.run(["cc", "-w", "-fsyntax-only", path]).returncode != 0
    say("mutator: all compile", refused == 0, refused)
    moved = mutate.mutants_of("sample.c", "\n\nint more(void)\n{\n    return 1;\n}\n" + SAMPLE)
    say("mutator: ids outlive changes elsewhere", {m.id for m in ms} <= {m.id for m in moved})
    everything = mutate.all_mutants()
    one, two = mutate.sample(everything, 1), mutate.sample(everything, 2)
    say("mutator: two samples share nothing and are all", not {m.id for m in one} & {m.id for m in two} and len(one) + len(two) == len(everything)
        and len({m.id for m in everything}) == len(everything))
    def stratified(order):
        """Does every beginning hold the same share of each file's mutants, to within one mutant?"""
        size = collections.Counter(m.file for m in order)
        for n in (100, 400, 3000):
            count = collections.Counter(m.file for m in order[:n])
            if max((count[f] - 1) / size[f] for f in size) > min((count[f] + 1) / size[f] for f in size):
                return False
        return True
    say("mutator: beginnings of a sample are stratified", stratified(one) and stratified(two))
    say("mutator: those of another order are not (control)", not stratified(sorted(one, key=lambda m: m.id)))


def planted(file, before, after):
    with open(file) as f:
        source = f.read()
    at = source.index(before)
    return mutate.Mutant("planted", file, source.count("\n", 0, at) + 1, "planted", before, after, at, at + len(before))


def check_runner(build):
    some = {"name": "machine_check", "tests": ["test_camera"], "scenes": ["10_furnace_one"]}
    prepare.Preparation(build, **some).prepare()
    r = run.Runner(build, **some)
    r.load()
    camera, tone = "renderer/scene/camera.c", "renderer/image/tone.c"
    for what, m, kind, unit, validate in (
            ("what compiles to the same is equivalent", planted(camera, "c->eye = f->eye;", "c->eye = (f->eye);"), "equivalent", "", ""),
            ("a wrong limit is found by a unit test", planted(camera, "x[28] >= 1e-6", "x[28] >= -1"), "mutant", "test_camera", "-"),
            ("an eye in the wrong place is found by validate", planted(camera, "c->eye = f->eye;", "c->eye = v3(9, 9, 9);"), "mutant", "test_camera", "DIFFERENT"),
            ("a camera that never ends is found", planted(camera, "c->eye = f->eye;", "for (;;);"), "mutant", "test_camera", "DIED"),
            ("what neither looks at survives", planted(tone, "12.92", "13.92"), "mutant", "-", "-"),
            ("what is no C is no mutant", planted(tone, "12.92", "12.92)"), "stillborn", "", "")):
        got = r.evaluate(m)
        say("runner: " + what, (got["kind"], got["unit"], got["validate"]) == (kind, unit, validate), got)


def check_page():
    # No success in n: the upper end p has (1 - p)^n = 0.025; one of one: the lower end is 0.025.
    low, high = page.clopper_pearson(0, 10)
    one = page.clopper_pearson(1, 1)
    say("page: Clopper-Pearson", low == 0 and abs((1 - high)**10 - 0.025) < 1e-9 and abs(one[0] - 0.025) < 1e-9 and one[1] == 1)


def main():
    with tempfile.TemporaryDirectory() as folder:
        check_mutator(folder)
    check_page()
    check_runner(sys.argv[1])


if __name__ == "__main__":
    main()
