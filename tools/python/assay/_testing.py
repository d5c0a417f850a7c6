"""Assertions for pytest and other runners: a failure shows the verdict, the worst region and the path of a page."""

import os
import re
from pathlib import Path

from ._compare import compare


def _page(report):
    """Where the page goes: as asked, else assay-reports/TEST.html (or below ASSAY_REPORTS) by the test's name."""
    if report is not None:
        return Path(report)
    test = os.environ.get("PYTEST_CURRENT_TEST", "comparison").rsplit(" ", 1)[0]
    return Path(os.environ.get("ASSAY_REPORTS", "assay-reports")) / (re.sub(r"[^\w.-]+", "_", test) + ".html")


def _check(result, report):
    if result.passes:
        return result
    page = _page(report)
    lines = [str(result)]
    if result.verdict != "INCONCLUSIVE":
        lines.append(f"worst: {result.worst}")
    if result.extra_factor > 1:
        lines.append(f"about {result.extra_factor:.2g} times the samples would decide"
                     if result.extra_factor < 100 else
                     "more than 100 times the samples would decide: choose another margin, or larger tiles")
    lines += [f"note: {note}" for note in result.notes]
    try:
        result.write_report(page)
        lines.append(f"page: {page}")
    except OSError as error:
        lines.append(f"no page: {error}")
    raise AssertionError("\n".join(lines))


def assert_equivalent(render, reference, *, margin, report=None, **options):
    """Fails unless the two are shown to be equal within the margin: DIFFERENT and INCONCLUSIVE both fail.

    The margin is yours to declare: the largest relative difference of the image's mean that does not matter (tiles:
    4 times that). Other options as of compare(). report: where the page of a failure goes. Returns the Result.
    """
    __tracebackhide__ = True
    return _check(compare(render, reference, margin=margin, **options), report)


def assert_unchanged(render, previous, *, accept_mdb, report=None, **options):
    """For two versions of one program with equally many samples and different seeds: fails if the distribution of any
    pixel has changed, or if a change of the image by accept_mdb (relative; tiles: 4 times that) could have been missed.
    """
    __tracebackhide__ = True
    return _check(compare(render, previous, same_program=True, accept_mdb=accept_mdb, **options), report)
