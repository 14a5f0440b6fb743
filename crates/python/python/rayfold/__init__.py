"""Ray-traced pictures and animations.

    import rayfold as rf

    scene = rf.Scene(320, 240, samples=16, background="#8cb4e6")
    scene.look(eye=(0, 2, 8), at=(0, 1, 0), fov=34)
    scene.ilight("#ffffff", (-1, -2, -1))
    scene.plane((0, 0, 0), (0, 1, 0), diffuse=0.6)
    scene.sphere(1, (0, 1, 0), diffuse="#c04020", mirror=0.2)
    scene.render()
"""

from collections.abc import Mapping

from . import _arguments, _rayfold
from ._animation import Animation, animation, gif, load
from ._errors import SceneError, SceneWarning
from ._rayfold import Curve, Diagnostic, Material, __version__
from ._scene import Scene, parse

__all__ = [
    "Animation",
    "Curve",
    "Diagnostic",
    "Material",
    "Picture",
    "Scene",
    "SceneError",
    "SceneWarning",
    "__version__",
    "animation",
    "gif",
    "keys",
    "linear",
    "load",
    "parse",
]


Material.__doc__ = _rayfold.material_doc


def __getattr__(name):
    if name == "Picture":
        # It imports NumPy, which takes longer than all else.
        from ._picture import Picture

        globals()[name] = Picture
        return Picture
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__():
    return sorted({*globals(), *__all__})


def keys(keys, mode="linear", cycle=False):
    if not isinstance(keys, Mapping):
        raise TypeError(f"keys(): keys is a dict of values by the numbers of frames, not {_arguments.shown(keys)}")
    return _rayfold.keys(dict(keys), mode, _arguments.flag("keys", "cycle", cycle))


keys.__doc__ = _rayfold.keys_doc


def linear(color):
    """Returns the channels of a colour such as `"#c04020"` as linear light, for scenes with `tone("srgb")`."""
    color = _arguments.text("linear", "color", color, "'#c04020'")
    digits = color[1:]
    if not (color.startswith("#") and len(digits) == 6 and set(digits) <= set("0123456789abcdefABCDEF")):
        raise ValueError(f"linear(): color is a text such as '#c04020', not {_arguments.shown(color)}")
    channels = (int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4))
    return tuple(c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels)
