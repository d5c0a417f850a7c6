"""The package assay (tools/python) as a renderer's tests use it. Run by end_to_end/library.sh with Debian's pytest;
ASSAY is the command, for its figures of the same files.

Noise is from a law of mean 1 and known variance, seeds are fixed, no test is run again. Claims are of alpha 1e-3."""

import json
import os
import subprocess
import sys
import threading

import numpy as np
import pytest

import assay

K, H, W = 16, 48, 64
SCENE = np.linspace(0.2, 2, H * W).reshape(H, W, 1) * [1, 0.8, 0.6]


def replicates(seed, factor=1.0, num=K):
    """Gamma of shape 4: relative standard deviation 1/2."""
    noise = np.random.default_rng(seed).gamma(4, 0.25, (num, H, W, 3))
    return (noise * SCENE * factor).astype(np.float32)


A, B, BRIGHT = replicates(1), replicates(2), replicates(3, 1.05)


def test_verdicts():
    # standard error of the image: about 0.5 sqrt(2/(16*3072)) times the weights' factor, 0.3 to 0.4 %
    assert assay.compare(A, B, margin=0.03).verdict == "EQUIVALENT"
    assert assay.compare(BRIGHT, B, margin=0.01).verdict == "DIFFERENT"
    assert assay.compare(A, B, margin=0.001).verdict == "INCONCLUSIVE"
    found = assay.compare(A, B)
    assert found.verdict == "NO DIFFERENCE FOUND" and not found.passes
    assert assay.compare(A, B, accept_mdb=0.05, accept_mdb_tile=0.3).passes
    assert not assay.compare(A, B, accept_mdb=found.mdb / 2).passes


def test_numbers():
    r = assay.compare(BRIGHT, B, margin=0.01)
    weights = np.array([0.2126, 0.7152, 0.0722])
    a, b = (float((x.astype(np.float64).mean((0, 1, 2)) * weights).sum()) for x in (BRIGHT, B))
    assert r.difference == pytest.approx(a / b - 1, abs=1e-9)
    assert r.ci[0] < r.difference < r.ci[1] and r.ci[0] < 0.05 < r.ci[1]
    assert r.image.width == W and r.image.height == H and r.image.channel == "luminance"
    mean = (BRIGHT.astype(np.float64).mean(0) - B.astype(np.float64).mean(0)) @ weights
    assert r.z.shape == (H, W) and r.relative.shape == (H, W)
    assert np.all(np.sign(r.relative)[np.abs(mean) > 1e-3] == np.sign(mean)[np.abs(mean) > 1e-3])
    lo, hi = r.variance_ci
    assert lo < 1.05**2 < hi  # variance scales with the square


def test_every_way_in(tmp_path):
    running, parts = assay.Moments(W, H, unit="replicate"), [assay.Moments(W, H, unit="replicate") for _ in range(2)]
    for k, image in enumerate(A):
        running.add(image)
        parts[k % 2].add(image)
    parts[0].merge(parts[1])
    exact = A.astype(np.float64)
    d = exact - exact.mean(0)
    given = assay.Moments.of(K, exact.mean(0), (d**2).sum(0), (d**3).sum(0), unit="replicate")
    running.write(tmp_path / "a.exr")
    expected = assay.compare(A, B, margin=0.03)
    for side in (running, parts[0], given, tmp_path / "a.exr"):
        r = assay.compare(side, B, margin=0.03)
        assert r.verdict == expected.verdict and r.num_tests == expected.num_tests
        assert r.difference == pytest.approx(expected.difference, abs=1e-6)
        assert r.mdb == pytest.approx(expected.mdb, rel=1e-5)
    without = assay.Moments.of(K, exact.mean(0), (d**2).sum(0), unit="replicate")
    assert assay.compare(without, B, margin=0.05).verdict == "EQUIVALENT"


def test_samples_of_pixels():
    m = assay.Moments(2, 1)
    for x, values in ((0, (1, 3, 5)), (1, (0, 0, 3))):
        for v in values:
            m.add_sample(x, 0, (v, v, v))
    with pytest.raises(ValueError, match="no sample"):
        m.add_sample(2, 0, (1, 1, 1))
    r = assay.compare(m, assay.Moments.of(1, [[3.0, 1.0]], [[0.0, 0.0]], unit="exact"))
    assert r.image.mean_a == pytest.approx(2) and r.difference == pytest.approx(0)
    # (1,3,5) has the variance 4, (0,0,3) 3, of the means 4/3 and 1; of their mean (4/3 + 1)/4, over 2
    assert r.ci[1] - r.ci[0] > 2 * 3.29 * np.sqrt(7 / 12) / 2


def test_command_has_the_same_figures(tmp_path):
    sides = {"a": BRIGHT, "b": B}
    for name, side in sides.items():
        m = assay.Moments(W, H)
        for image in side:
            m.add(image)
        m.write(tmp_path / f"{name}.exr")
    line = [os.environ["ASSAY"], "compare", "--margin", "0.02", "--json", str(tmp_path / "r.json"),
            str(tmp_path / "a.exr"), str(tmp_path / "b.exr")]
    status = subprocess.run(line, capture_output=True, text=True)
    r = assay.compare(tmp_path / "a.exr", tmp_path / "b.exr", margin=0.02)
    claim = json.loads((tmp_path / "r.json").read_text())["claims"][0]
    assert status.stdout.splitlines()[0] == str(r)
    assert (status.returncode == 0) == r.passes
    assert claim["verdict"] == r.verdict


def test_codes_and_halves():
    def code(x, levels, kind):
        return np.clip(np.clip(x, 0, 1) * levels + 0.5, 0, levels).astype(kind)

    a, b = A.mean(0) * 0.3, B.mean(0) * 0.3
    for levels, kind in ((255, np.uint8), (65535, np.uint16)):
        r = assay.compare(code(a, levels, kind), code(b, levels, kind), margin=0.1, margin_tile=0.5, curve="linear")
        assert r.verdict == "EQUIVALENT"
        with pytest.raises(assay.NotJudged, match="what light is a code"):
            assay.compare(code(a, levels, kind), b)
    r = assay.compare(a.astype(np.float16), b, margin=0.1, margin_tile=0.5)
    assert r.verdict == "EQUIVALENT" and any("half floats" in note for note in r.notes)


@pytest.mark.parametrize("a, b, options, message", [
    (A, B[:, 1:], {}, "pixels"),
    (A * np.nan, B, {}, "not a number"),
    (np.stack([A[0]] * 3), B, {}, "seed was ignored"),
    (A[:2], B, {}, "at least 3"),
    (A, B, {"margin": 2}, "margin"),
    (A, B, {"paired": True, "exchangeable": True}, "--paired and --exchangeable"),
    ("/nowhere.exr", B, {}, "/nowhere.exr"),
    (A, A, {}, "same"),
    (A, assay.Moments.of(1, np.zeros((H, W, 3)), np.zeros((H, W, 3)), unit="exact"), {}, "black"),
])
def test_refusals(a, b, options, message):
    with pytest.raises(assay.NotJudged, match=message):
        assay.compare(a, b, **options)


@pytest.mark.parametrize("bad", [np.zeros((2, 3, 4, 5, 3)), np.zeros((4, 4, 2)), np.zeros((4, 4, 3), np.int64)])
def test_arrays_that_are_no_images(bad):
    with pytest.raises(ValueError):
        assay.compare(bad, B)


def test_two_versions_of_one_program():
    assert assay.assert_unchanged(A, B, accept_mdb=0.05, alpha=1e-3).exact_p > 1e-3
    with pytest.raises(AssertionError, match="law changed"):
        assay.assert_unchanged(replicates(4, 1.1), B, accept_mdb=0.05, report=os.devnull + ".html")
    assert assay.compare(A, B, exchangeable=True).exact_p > 1e-3
    assert assay.compare(replicates(5, 1.2), B, exchangeable=True).exact_p <= 1e-3


def test_second_stage():
    fresh = replicates(6, 1.05), replicates(7)
    assert assay.compare(BRIGHT, B, again=fresh).verdict == "DIFFERENT"
    assert assay.compare(BRIGHT, B, again=(replicates(8), replicates(9))).verdict == "NO DIFFERENCE FOUND"


def test_pairs_of_one_seed():
    """A lamp 1 % brighter with the same random numbers: the standard error of the difference is 1 % of that of A alone,
    (1/2)/sqrt(16 * 3072) = 0.23 % times 0.85, the root of sum f^2 over sum f, so that +1 % is known to 0.01 %."""
    brighter = (B * np.float32(1.01)).astype(np.float32)
    r = assay.compare(brighter, B, margin=0.02, paired=True)
    assert r.verdict == "EQUIVALENT" and abs(r.difference - 0.01) < 1e-4
    assert assay.compare(brighter, B, margin=0.005, margin_tile=0.006, paired=True).verdict == "DIFFERENT"
    assert assay.compare(A, B, margin=0.02, paired=True).verdict != "DIFFERENT"
    assert any("same to the bit" in note for note in assay.compare(B, B, margin=0.02, paired=True).notes)
    with pytest.raises(assay.NotJudged, match="A has 16 renders, B has 8"):
        assay.compare(A, B[:8], paired=True)


def test_threads():
    expected, got = assay.compare(A, B, margin=0.03).mdb, []
    threads = [threading.Thread(target=lambda: got.append(assay.compare(A, B, margin=0.03).mdb)) for _ in range(4)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert got == [expected] * 4


def test_what_a_failing_test_says(tmp_path):
    """pytest on tests that must fail and one that must pass: the verdict, worst region, and a page that is there."""
    (tmp_path / "test_mine.py").write_text(
        "import numpy as np, assay\n"
        "def render(seed): return np.random.default_rng(seed).gamma(4, .25, (8, 32, 32, 3)).astype(np.float32)\n"
        "def test_good(): assay.assert_equivalent(render(1), render(2), margin=.05)\n"
        "def test_bad():\n"
        "    wrong = render(3)\n"
        "    wrong[:, 8:24, 16:] *= 1.5\n"
        "    assay.assert_equivalent(wrong, render(4), margin=.05)\n"
        "def test_too_few(): assay.assert_equivalent(render(5)[:3], render(6)[:3], margin=.01)\n")
    line = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_mine.py"]
    run = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True)
    assert "2 failed, 1 passed" in run.stdout
    assert "DIFFERENT: " in run.stdout and "INCONCLUSIVE: " in run.stdout and "worst: " in run.stdout
    page = tmp_path / "assay-reports" / "test_mine.py_test_bad.html"
    assert f"page: assay-reports/{page.name}" in run.stdout
    assert page.read_text().lstrip().startswith("<!")
    assert not (tmp_path / "assay-reports" / "test_mine.py_test_good.html").exists()
