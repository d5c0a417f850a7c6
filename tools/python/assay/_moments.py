"""Running moments of a renderer's samples, in memory."""

import ctypes as c

import numpy as np

from ._library import lib, new_error


class Moments:
    """Per pixel and channel: n observations, their mean, and sums of squared and cubed deviations from it.

    Add samples or whole images as they are rendered, or start from sums that your renderer keeps: Moments.of().
    """

    def __init__(self, width, height, unit="sample", spp=0):
        """Moments of no observations yet. Sizes in pixels.

        unit: what one observation is, "sample" or "replicate"; spp: paths in it, if known.
        """
        self._handle = lib.assay_moments_new(width, height, unit.encode(), spp)
        if not self._handle:
            raise ValueError(f"no moments of {width} x {height} pixels, unit {unit}")
        self.shape = (height, width, 3)

    @classmethod
    def of(cls, n, mean, m2, m3=None, unit="sample", spp=0):
        """Of arrays: n (H, W) or a number; mean, m2 = sum (x - mean)^2 and, if known, m3 = sum (x - mean)^3: (H, W, C).

        unit: what one observation is, "sample", "replicate" or "exact" (a closed form: n = 1, m2 = 0)
        spp: paths in it, if known
        """
        self = cls.__new__(cls)
        self._handle = None
        mean = np.asarray(mean)
        if mean.ndim == 2:
            mean = mean[:, :, None]
        if mean.ndim != 3 or mean.shape[2] not in (1, 3):
            raise ValueError(f"mean has shape {mean.shape}, not (H, W, 3) or (H, W)")
        self.shape = mean.shape
        parts = [np.broadcast_to(n, mean.shape[:2]), mean, self._like(m2, mean)]
        parts.append(None if m3 is None else self._like(m3, mean))
        self._arrays = [None if x is None else np.ascontiguousarray(x, np.float64) for x in parts]
        self._unit, self._spp = unit.encode(), spp
        return self

    @staticmethod
    def _like(x, mean):
        x = np.asarray(x)
        if x.ndim == 2 and mean.shape[2] == 1:
            x = x[:, :, None]
        if x.shape != mean.shape:
            raise ValueError(f"moments of shape {x.shape} beside a mean of shape {mean.shape}")
        return x

    def add(self, image):
        """One more observation of every pixel: an array (H, W, 3) of radiance."""
        image = np.ascontiguousarray(image, np.float32)
        self._need_handle()
        if image.shape != self.shape:
            raise ValueError(f"an image of shape {image.shape} into moments of {self.shape}")
        if not lib.assay_moments_add_image(self._handle, image.ctypes.data):
            raise ValueError("the image has numbers that are not finite")

    def add_sample(self, x, y, rgb):
        """One more sample of one pixel, x from the left, y from the top."""
        self._need_handle()
        if not lib.assay_moments_add(self._handle, x, y, (c.c_double * 3)(*rgb)):
            raise ValueError(f"no sample {rgb} at {x},{y} of {self.shape[1]} x {self.shape[0]} pixels")

    def merge(self, other):
        """Adds the observations of other, as if all had been added to this one."""
        self._need_handle()
        other._need_handle()
        error = new_error()
        if not lib.assay_moments_merge(self._handle, other._handle, error):
            raise ValueError(error.value.decode())

    def write(self, path):
        """A moments EXR, which every command reads."""
        self._need_handle()
        error = new_error()
        if not lib.assay_moments_write(self._handle, str(path).encode(), error):
            raise OSError(error.value.decode())

    def _need_handle(self):
        if not self._handle:
            raise ValueError("these moments are of arrays (Moments.of()), which stay as they are")

    def _fill(self, side):
        """As a side for the library; it points into self."""
        if self._handle:
            whole = lib.assay_moments_side(self._handle)
            for name in ("width", "height", "channels", "n", "mean", "m2", "m3", "unit", "spp"):
                setattr(side, name, getattr(whole, name))
            return
        side.height, side.width, side.channels = self.shape
        for name, array in zip(("n", "mean", "m2", "m3"), self._arrays):
            setattr(side, name, None if array is None else array.ctypes.data)
        side.unit, side.spp = self._unit, self._spp

    def __del__(self):
        if getattr(self, "_handle", None):
            lib.assay_moments_free(self._handle)
