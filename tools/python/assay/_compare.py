"""From two sides to a verdict: compare()."""

import ctypes as c
import os
from dataclasses import dataclass

import numpy as np

from ._library import Options, Side, lib, new_error
from ._moments import Moments

_TYPES = {np.dtype(np.float32): 0, np.dtype(np.uint8): 1, np.dtype(np.uint16): 2}
_HALF = 3
_CHANNELS = ("red", "green", "blue", "luminance")


class NotJudged(Exception):
    """The renders could not be compared: bad input, different sizes, options that exclude each other. Never a pass."""


@dataclass(frozen=True)
class Region:
    """A square of pixels (or the image) in one channel; relative numbers are in units of B's mean there."""

    x: int
    y: int
    width: int
    height: int
    channel: str
    mean_a: float
    mean_b: float
    difference: float
    ci_lo: float
    ci_hi: float
    t: float
    dof: float
    log10_p: float
    mdb: float

    def __str__(self):
        return (f"{self.width} x {self.height} pixels at {self.x},{self.y} ({self.channel}): "
                f"{100 * self.difference:+.3g} % [{100 * self.ci_lo:+.3g}, {100 * self.ci_hi:+.3g}]")


def _region(r):
    values = {name: getattr(r, name) for name, _ in r._fields_}
    values["channel"] = _CHANNELS[r.channel]
    return Region(**values)


class Result:
    """What came out.

    verdict: "EQUIVALENT", "DIFFERENT", "INCONCLUSIVE" or "NO DIFFERENCE FOUND"; reason: one sentence
    passes: EQUIVALENT, or NO DIFFERENCE FOUND and no more than accept_mdb could have been missed
    image, worst, worst_tile: Region; difference, ci: of the image's luminance, relative
    mdb, mdb_tile: the smallest relative error, of the image and of any tile, found with a probability of 95 %
    extra_factor: if undecided, about how many times the samples would decide (100: that or more)
    variance_ratio, variance_ci: A's variance over B's, or None
    exact_p: p-value of exchangeable or same_program, else None
    z, relative: arrays (H, W): luminance of each pixel, difference over its standard error, relative difference
    notes: what had to be assumed
    """

    def __init__(self, handle):
        self._handle = handle
        r = lib.assay_result_of(handle).contents
        self.verdict = lib.assay_verdict_name(r.verdict).decode()
        self.passes = r.passes
        self.reason = r.reason.decode()
        self.image, self.worst, self.worst_tile = (_region(x) for x in (r.image, r.worst, r.worst_tile))
        self.difference = r.image.difference
        self.ci = (r.image.ci_lo, r.image.ci_hi)
        self.mdb, self.mdb_tile, self.extra_factor = r.mdb, r.mdb_tile, r.extra_factor
        known = r.variance_ratio == r.variance_ratio
        self.variance_ratio = r.variance_ratio if known else None
        self.variance_ci = (r.variance_lo, r.variance_hi) if known else None
        self.exact_p = r.exact_p if r.exact_p == r.exact_p else None
        self.num_tests = r.num_tests
        self.notes = [r.notes[i].decode() for i in range(r.num_notes)]

    def _map(self, function):
        width, height = c.c_int(), c.c_int()
        data = function(self._handle, width, height)
        if not data:
            raise NotJudged("the means could not be compared: there is no map of them")
        return np.ctypeslib.as_array(data, (height.value, width.value)).copy()

    @property
    def z(self):
        return self._map(lib.assay_z_map)

    @property
    def relative(self):
        return self._map(lib.assay_relative_map)

    def _write(self, function, path):
        error = new_error()
        if not function(self._handle, os.fsencode(path), error):
            raise OSError(error.value.decode())

    def write_report(self, path):
        """One HTML page with both images and the map of their difference; opens from disk."""
        self._write(lib.assay_write_report, path)

    def write_json(self, path):
        """results.json of the one claim, with its images beside it: for `assay report` and other tools."""
        self._write(lib.assay_write_json, path)

    def __str__(self):
        return f"{self.verdict}: {self.reason}"

    def __repr__(self):
        return f"<assay.Result {self}>"

    def __del__(self):
        if getattr(self, "_handle", None):
            lib.assay_free(self._handle)


def _array_side(x, side):
    x = np.asarray(x)
    if x.ndim == 2:
        x = x[:, :, None]
    if x.ndim == 3:
        x = x[None]
    if x.ndim != 4 or x.shape[3] not in (1, 3):
        raise ValueError(f"an array of shape {x.shape} is neither (H, W), (H, W, 3) nor (K, H, W, 3)")
    half = x.dtype == np.float16
    if x.dtype.kind == "f":
        x = x.astype(np.float32, copy=False)
    if x.dtype not in _TYPES:
        raise ValueError(f"an array of {x.dtype}: floats are radiance, uint8 and uint16 are codes")
    x = np.ascontiguousarray(x)
    side.num, side.height, side.width, side.channels = x.shape
    side.type, side.pixels = _HALF if half else _TYPES[x.dtype], x.ctypes.data
    return x


def _side(x, name):
    """The struct, and what it points into."""
    side = Side(name=name.encode() if name else None)
    if isinstance(x, Moments):
        x._fill(side)
        return side, x
    if isinstance(x, (str, os.PathLike)):
        side.path = os.fsencode(x)
        return side, side.path
    return side, _array_side(x, side)


def compare(a, b, *, margin=None, margin_tile=None, margin_variance=None, accept_mdb=None, accept_mdb_tile=None,
            alpha=1e-3, tile=16, again=None, paired=False, exchangeable=False, same_program=False, filter_width=0,
            min_side=0, curve=None, spp_a=0, spp_b=0, name_a=None, name_b=None):
    """Judges a (tested) against b (reference); sides as in the package. Returns a Result, raises NotJudged.

    margin: largest relative difference of the image's mean that counts as equal; margin_tile: of a tile's (4 x margin);
      without margins any difference is looked for, and nothing is EQUIVALENT
    margin_variance: the same for the variance of one sample or replicate; without it variances are not judged
    accept_mdb, accept_mdb_tile: without margins: passes if nothing is found and no such error could have been missed
    alpha: chance of a wrong DIFFERENT, and of a wrong EQUIVALENT; tile: side of a reporting tile, pixels
    again=(a2, b2): fresh renders of both: DIFFERENT only if they confirm what a and b show
    paired: both share their noise (one seed, two versions); of arrays of K renders each is compared with that of its place
    exchangeable: exact test by permutation of replicates
    same_program: exact test of "nothing changed" between two versions with equally many samples; filter_width: pixels
      nearer than this may share noise (0: it is measured; 1: none do, also of images without moments)
    curve: of integer images: "srgb", "linear", "gamma=2.2", "exposure=1", "cgl"
    spp_a, spp_b: samples per pixel of a file with a variance only, or of each replicate: variances are then of one path
    """
    options = Options()
    lib.assay_options_init(options, c.sizeof(options))
    options.alpha, options.tile = alpha, tile
    options.margin, options.margin_tile, options.margin_variance = margin or 0, margin_tile or 0, margin_variance or 0
    options.accept_mdb, options.accept_mdb_tile = accept_mdb or 0, accept_mdb_tile or 0
    options.paired, options.exchangeable, options.same_program = paired, exchangeable, same_program
    options.filter_width, options.min_side = filter_width, min_side
    options.curve = curve.encode() if curve else None
    options.spp[0], options.spp[1] = spp_a, spp_b
    sides = [_side(a, name_a), _side(b, name_b)]
    sides += [_side(x, None) for x in again] if again is not None else []
    handle, error = c.c_void_p(), new_error()
    structs = [c.byref(s) for s, _ in sides] + [None] * (4 - len(sides))
    if not lib.assay_compare_again(*structs, options, handle, error):
        raise NotJudged(error.value.decode(errors="replace"))
    return Result(handle)
