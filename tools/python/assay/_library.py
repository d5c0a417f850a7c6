"""libassay.so as ctypes sees it: the structs and functions of assay.h, in its order."""

import ctypes as c
import os
from pathlib import Path

ABI = 1
ERROR_SIZE = 1024


class Side(c.Structure):
    _fields_ = [
        ("name", c.c_char_p), ("path", c.c_char_p),
        ("num", c.c_int), ("width", c.c_int), ("height", c.c_int), ("channels", c.c_int),
        ("type", c.c_int), ("pixels", c.c_void_p),
        ("n", c.c_void_p), ("mean", c.c_void_p), ("m2", c.c_void_p), ("m3", c.c_void_p),
        ("unit", c.c_char_p), ("spp", c.c_double),
    ]


class Options(c.Structure):
    _fields_ = [
        ("size", c.c_size_t), ("alpha", c.c_double),
        ("margin", c.c_double), ("margin_tile", c.c_double), ("margin_variance", c.c_double),
        ("accept_mdb", c.c_double), ("accept_mdb_tile", c.c_double),
        ("spp", c.c_double * 2), ("curve", c.c_char_p), ("tile", c.c_int),
        ("paired", c.c_bool), ("exchangeable", c.c_bool), ("same_program", c.c_bool),
        ("filter_width", c.c_int), ("min_side", c.c_int),
    ]


class Region(c.Structure):
    _fields_ = [(name, c.c_int) for name in ("x", "y", "width", "height", "channel")] + [
        (name, c.c_double)
        for name in ("mean_a", "mean_b", "difference", "ci_lo", "ci_hi", "t", "dof", "log10_p", "mdb")
    ]


class Result(c.Structure):
    _fields_ = [
        ("verdict", c.c_int), ("passes", c.c_bool), ("reason", c.c_char * 256),
        ("image", Region), ("worst", Region), ("worst_tile", Region),
        ("mdb", c.c_double), ("mdb_tile", c.c_double), ("extra_factor", c.c_double),
        ("variance_ratio", c.c_double), ("variance_lo", c.c_double), ("variance_hi", c.c_double),
        ("exact_p", c.c_double), ("num_tests", c.c_int), ("num_notes", c.c_int), ("notes", c.POINTER(c.c_char_p)),
    ]


def _places():
    """Where to look: ASSAY_LIBRARY alone; else beside this package (by pip), a checkout's build, the system's."""
    here = Path(__file__).resolve().parent
    name = f"libassay.so.{ABI}"
    if "ASSAY_LIBRARY" in os.environ:
        return [os.environ["ASSAY_LIBRARY"]]
    beside = [here / name, here.parents[2] / "build" / name]
    return [str(p) for p in beside if p.exists()] + [name]


def _load():
    tried = []
    for place in _places():
        try:
            library = c.CDLL(place)
        except OSError as error:
            tried.append(str(error))
            continue
        if library.assay_abi() != ABI:
            tried.append(f"{place}: has ABI {library.assay_abi()}, this package is for {ABI}")
            continue
        return library
    raise ImportError("cannot load libassay (set ASSAY_LIBRARY=PATH): " + "; ".join(tried))


lib = _load()

_error = c.c_char_p
_signatures = {
    "assay_build": (c.c_char_p, []),
    "assay_verdict_name": (c.c_char_p, [c.c_int]),
    "assay_options_init": (None, [c.POINTER(Options), c.c_size_t]),
    "assay_compare_again": (c.c_bool, [c.POINTER(Side)] * 4 + [c.POINTER(Options), c.POINTER(c.c_void_p), _error]),
    "assay_result_of": (c.POINTER(Result), [c.c_void_p]),
    "assay_z_map": (c.POINTER(c.c_float), [c.c_void_p, c.POINTER(c.c_int), c.POINTER(c.c_int)]),
    "assay_relative_map": (c.POINTER(c.c_float), [c.c_void_p, c.POINTER(c.c_int), c.POINTER(c.c_int)]),
    "assay_write_report": (c.c_bool, [c.c_void_p, c.c_char_p, _error]),
    "assay_write_json": (c.c_bool, [c.c_void_p, c.c_char_p, _error]),
    "assay_free": (None, [c.c_void_p]),
    "assay_moments_new": (c.c_void_p, [c.c_int, c.c_int, c.c_char_p, c.c_double]),
    "assay_moments_add": (c.c_bool, [c.c_void_p, c.c_int, c.c_int, c.POINTER(c.c_double)]),
    "assay_moments_add_image": (c.c_bool, [c.c_void_p, c.c_void_p]),
    "assay_moments_merge": (c.c_bool, [c.c_void_p, c.c_void_p, _error]),
    "assay_moments_write": (c.c_bool, [c.c_void_p, c.c_char_p, _error]),
    "assay_moments_side": (Side, [c.c_void_p]),
    "assay_moments_free": (None, [c.c_void_p]),
}
for _name, (_result, _arguments) in _signatures.items():
    getattr(lib, _name).restype = _result
    getattr(lib, _name).argtypes = _arguments


def new_error():
    return c.create_string_buffer(ERROR_SIZE)


def build():
    """What build the library is: "0.1 (commit 1a2b3c4d5e6f)"."""
    return lib.assay_build().decode()
