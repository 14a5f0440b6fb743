"""Arrays of pixels that a notebook shows as pictures."""

import numpy as np

from . import _arguments, _rayfold


class Picture(np.ndarray):
    """An array of height x width x 3: levels as `uint8`, or light from 0 to 1 as `float32`.

    A picture of a scene without background has a fourth channel, its alpha. Light is premultiplied by it.
    """

    def png(self):
        """Returns the picture as a PNG file. Light becomes levels without a curve, and is divided by its alpha."""
        return image_of(self).png()

    def save(self, path):
        """Writes the picture as a PNG file, which appears whole or not at all."""
        _rayfold.write_file(_arguments.path("save", "path", path), self.png())

    def _repr_png_(self):
        # A part of a picture, such as a row of it or a sum, may be none.
        return self.png() if self.ndim == 3 and self.shape[2] in (3, 4) and self.size > 0 else None


def picture_of(image, linear=False):
    """Returns an image of the extension as an array."""
    width, height = image.size
    array = np.frombuffer(image.data(), np.float32 if linear else np.uint8)
    return array.reshape(height, width, image.channels).view(Picture)


def image_of(array, name="the picture"):
    """Returns an array as an image of the extension."""
    try:
        array = np.asarray(array)
    except Exception as error:
        raise TypeError(f"{name} is no array: {error}") from None
    if array.ndim == 2:
        array = np.repeat(array[:, :, None], 3, axis=2)
    if array.ndim != 3 or array.shape[2] not in (3, 4) or array.size == 0:
        raise ValueError(
            f"{name} has the shape {array.shape}: expected (height, width, 3), (height, width, 4) or (height, width)"
        )
    if array.dtype.kind == "f":
        if array.shape[2] == 4:
            alpha = array[:, :, 3:]
            color = np.divide(array[:, :, :3], alpha, out=np.zeros_like(array[:, :, :3]), where=alpha > 0)
            array = np.concatenate([color, alpha], axis=2)
        array = np.round(255.0 * np.nan_to_num(array, nan=0.0).clip(0.0, 1.0))
    elif array.dtype != np.uint8:
        raise TypeError(f"{name} has the type {array.dtype}: expected uint8 from 0 to 255, or floats from 0 to 1")
    height, width = array.shape[:2]
    return _rayfold.Image(width, height, np.ascontiguousarray(array, np.uint8).tobytes())
