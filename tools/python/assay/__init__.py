"""Compare renders: EQUIVALENT, DIFFERENT, INCONCLUSIVE or NO DIFFERENCE FOUND, with what could have been missed.

    import assay
    result = assay.compare(render, "gold.exr", margin=0.01)
    print(result)                     # EQUIVALENT: the image and 48 tiles lie within ...

    def test_cornell():               # pytest
        assay.assert_equivalent(my_renderer("cornell.json"), "gold/cornell.exr", margin=0.01)

A side is
  a path                  whatever the command `assay compare` takes: moments EXR, image, directory of replicates
  an array (H, W[, C])    one image, C = 3 (R, G, B) or 1; noise is estimated from neighbouring pixels. Floats are
                          radiance; uint8 and uint16 are codes and need curve="srgb" or another
  an array (K, H, W, C)   K >= 3 replicates, each with a seed of its own
  assay.Moments           running sums over samples or replicates: the most sensitive

Rows run from the top. What margins mean: guide-report.md and background/verdict.md of the project.
"""

from ._compare import NotJudged, Region, Result, compare
from ._library import build
from ._moments import Moments
from ._testing import assert_equivalent, assert_unchanged

__all__ = ["Moments", "NotJudged", "Region", "Result", "assert_equivalent", "assert_unchanged", "build", "compare"]
