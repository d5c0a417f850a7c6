"""README.md from the results of run.py."""
import math
import os
from collections import defaultdict

import mutate

# kind: stillborn (does not compile), equivalent (the same object code), mutant. unit: the unit test that fails, "-" if none does, "?" if
# only quick ones were asked. validate: DIFFERENT or DIED (no image), with the claim in `by`, "-" and why not, or "?" if it was not asked.
# image: 1 if an image of the pool changes.
COLUMNS = ["id", "file", "line", "operator", "before", "after", "kind", "unit", "validate", "by", "image", "cpu"]
GOALS = (0.97, 0.85)

INTRODUCTION = """# Mutants by machine

A program makes small mistakes in the renderer's files that decide a pixel, one at a time: {total} of them, by
{operators} operators. Two samples are drawn from them that share nothing, each stratified by file. What sample 1
shows is used to make tests better; sample 2 is for the report alone.

    tests/mutants/machine/mutate.py                      # how many there are, by file; --list, --show ID
    tests/mutants/machine/run.py prepare                 # once for a state of renderer/: times, lines that tests run
    tests/mutants/machine/run.py go 1 --seconds 3600     # the next mutants of sample 1; may be killed, and goes on
    tests/mutants/machine/run.py go 1 --again            # its survivors too, by the tests as they are now
    tests/mutants/machine/run.py one ID                  # one mutant
    tests/mutants/machine/run.py page                    # stores the results here and makes this page

- A mutant is **equivalent** if every object file, of all instruction sets, comes out the same, or if
  [equivalent.tsv](equivalent.tsv) gives a reason. One that the compiler refuses is none. Every other one that nothing
  finds is a **survivor**.
- **Unit tests** find it if one of them fails, dies, or takes three times as long as without. Those that never run the
  line are not asked; those that take more than a second only where nothing quicker finds it, and more than 10 s
  never; nor are the end-to-end tests. They are built without sanitizers; what none finds is asked once more of the
  quick ones as `make check` builds them.
- **`assay validate`** finds it if a claim comes out DIFFERENT, or the renderer dies, does not end, or writes what
  cannot be judged. It judges the scenes that run the line and whose image changes, as among all claims of the suite,
  on the default instruction set, for at most 25 CPU s. What is undecided by then, INCONCLUSIVE, or without effect on
  images of 8 samples counts as not found.
- It **changes an image** if, with the same seed, the mean of a tile of 16 x 16 pixels changes by more than 1 %, or
  the variance of a sample by more than 10 %, and by more than 5 standard errors, in 20 renders apart from the suite:
  of the assignment's scenes and of scenes made from them ([pool.py](pool.py)).
- Messages, and statements that give memory back, are left alone: they decide no pixel. So are declarations.
"""


def tail(k, n, p):
    """P(X <= k) for X binomial."""
    if p <= 0:
        return 1.0
    if p >= 1:
        return 1.0 if k >= n else 0.0
    return sum(math.exp(math.lgamma(n + 1) - math.lgamma(i + 1) - math.lgamma(n - i + 1) + i * math.log(p) + (n - i) * math.log1p(-p))
               for i in range(k + 1))


def clopper_pearson(k, n, alpha=0.05):
    def root(f):
        lo, hi = 0.0, 1.0
        for _ in range(60):
            mid = (lo + hi) / 2
            lo, hi = (mid, hi) if f(mid) else (lo, mid)
        return lo
    low = 0.0 if k == 0 else root(lambda p: 1 - tail(k - 1, n, p) < alpha / 2)
    high = 1.0 if k == n else root(lambda p: tail(k, n, p) > alpha / 2)
    return low, high


def rate(k, n):
    if n == 0:
        return "none yet"
    return "%d of %d, %.1f %% [%.1f, %.1f]" % ((k, n, 100 * k / n) + tuple(100 * x for x in clopper_pearson(k, n)))


def read(path):
    if not os.path.exists(path):
        return []
    with open(path) as f:
        rows = [dict(zip(COLUMNS, line.split("\t"))) for line in f.read().splitlines()[1:]]
    return list({r["id"]: r for r in rows}.values())  # the last word on each


def by_unit(r):
    return r["unit"].startswith("test_")


def by_validate(r):
    return r["validate"] in ("DIFFERENT", "DIED")


def summary(rows):
    live = [r for r in rows if r["kind"] == "mutant"]
    seen = [r for r in live if r["image"] == "1"]
    found = sum(by_unit(r) or by_validate(r) for r in live)
    return [
        ("drawn so far", "%d" % len(rows)),
        ("the compiler refuses", "%d" % sum(r["kind"] == "stillborn" for r in rows)),
        ("equivalent: same object code, by a reason", "%d, %d" % (sum(r["kind"] == "equivalent" for r in rows), sum(r["kind"] == "reasoned" for r in rows))),
        ("found by unit tests or `validate`, of those not equivalent (goal: 97 %)", rate(found, len(live))),
        ("found by `validate`, of those that change an image (goal: 85 %)", rate(sum(map(by_validate, seen)), len(seen))),
        ("found by either, of those that change an image", rate(sum(by_unit(r) or by_validate(r) for r in seen), len(seen))),
    ]


def escape(text):
    return text.replace("|", "\\|").replace("`", "'")


def write_page(folder):
    reasons = {}
    path = os.path.join(folder, "equivalent.tsv")
    if os.path.exists(path):
        with open(path) as f:
            reasons = dict(line.split("\t", 1) for line in f.read().splitlines() if "\t" in line)
    samples = [read(os.path.join(folder, "sample%d.tsv" % n)) for n in (1, 2)]
    as_run = summary(samples[1])[3][1]
    for rows in samples:
        for r in rows:
            if r["id"] in reasons and r["kind"] == "mutant":
                r["kind"] = "reasoned"
    everything = mutate.all_mutants()
    page = [INTRODUCTION.format(total=len(everything), operators=len({m.operator for m in everything}))]
    page += ["Shares with their 95 % intervals (Clopper-Pearson).", "", "| | sample 1 | sample 2 |", "|---|--:|--:|"]
    page += ["| %s | %s | %s |" % (a, b, c) for (a, b), (_, c) in zip(summary(samples[0]), summary(samples[1]))]
    if samples[1]:
        page += ["", "Sample 2 was run once, 2026-11-23; nothing that it showed had been mended before. As it came out,",
                 "**%s** were found; of those that were not, those that cannot show in any output" % as_run,
                 "were then given a [reason](equivalent.tsv), which is what the table counts. Tests may find some of the others by",
                 "now."]
    page += ["", "## By file", "", "Both samples. n: those that are not equivalent.", "",
             "| file | n | both | unit tests | `validate` | none | change an image | of these by `validate` |",
             "|---|--:|--:|--:|--:|--:|--:|--:|"]
    files = defaultdict(list)
    for r in samples[0] + samples[1]:
        if r["kind"] == "mutant":
            files[r["file"]].append(r)
    for f, rows in sorted(files.items()):
        u, v = [by_unit(r) for r in rows], [by_validate(r) for r in rows]
        seen = [r for r in rows if r["image"] == "1"]
        page.append("| %s | %d | %d | %d | %d | %d | %d | %d |" % (
            f[len("renderer/"):], len(rows), sum(a and b for a, b in zip(u, v)), sum(a and not b for a, b in zip(u, v)),
            sum(b and not a for a, b in zip(u, v)), sum(not a and not b for a, b in zip(u, v)), len(seen), sum(map(by_validate, seen))))
    for number, rows in enumerate(samples, 1):
        left = [r for r in rows if r["kind"] == "mutant" and not by_unit(r) and not by_validate(r)]
        if not rows:
            continue
        page += ["", f"## Survivors of sample {number}", "", "Lines are those of the state that was measured; `mutate.py --show ID` finds a mutant as long as its line stands.",
                 "", "| mutant | place | operator | before | after | changes an image | why `validate` did not find it |",
                 "|---|---|---|---|---|---|---|"]
        for r in left:
            page.append("| %s | %s:%s | %s | `%s` | `%s` | %s | %s |" % (
                r["id"], r["file"][len("renderer/"):], r["line"], r["operator"], escape(r["before"]), escape(r["after"]) or " ",
                "yes" if r["image"] == "1" else "no", r["by"]))
    with open(os.path.join(folder, "README.md"), "w") as f:
        f.write("\n".join(page) + "\n")
