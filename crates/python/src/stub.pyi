"""Ray-traced pictures and animations.

Generated from the table of the scene language: `python -m rayfold.stub` writes it anew.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from os import PathLike
from typing import Any, Literal, SupportsFloat, SupportsIndex, TypeAlias, overload

import numpy as np
from numpy.typing import NDArray

__version__: str

#: A number that is the same in all frames.
FixedNumber: TypeAlias = SupportsFloat | SupportsIndex
#: A number, or a curve made by `keys`.
Number: TypeAlias = FixedNumber | Curve
#: As many numbers as the parameter has: a tuple, a list or an array.
FixedVector: TypeAlias = Sequence[FixedNumber] | NDArray[Any]
Vector: TypeAlias = Sequence[Number] | NDArray[Any]
#: Red, green and blue, each from 0 to 1; one number for a grey; or a text such as `"#c04020"`.
FixedColor: TypeAlias = str | FixedNumber | FixedVector
Color: TypeAlias = str | Number | Vector
#: Rows of numbers: an array of NumPy, or what NumPy makes one of.
Array: TypeAlias = NDArray[Any] | memoryview | Sequence[Sequence[FixedNumber] | NDArray[Any]]
#: Pixels from the top: height x width, or height x width x 1, 3 or 4.
Pixels: TypeAlias = NDArray[Any] | memoryview | Sequence[Sequence[FixedNumber | Sequence[FixedNumber]]]
# modes

class Diagnostic:
    """An error or a warning about a script, with its place."""

    @property
    def severity(self) -> Literal["error", "warning"]: ...
    @property
    def code(self) -> str: ...
    @property
    def file(self) -> str: ...
    @property
    def line(self) -> int: ...
    @property
    def column(self) -> int: ...
    @property
    def span(self) -> tuple[int, int]: ...
    @property
    def message(self) -> str: ...
    @property
    def expected(self) -> str | None: ...
    @property
    def help(self) -> str | None: ...

class SceneError(ValueError):
    """A script has errors: `diagnostics` lists them all."""

    diagnostics: list[Diagnostic]
    def __init__(self, diagnostics: list[Diagnostic]) -> None: ...

class SceneWarning(UserWarning):
    """A script is drawn, but perhaps not as intended."""

class Curve:
    """A number that changes from frame to frame, made by `keys`."""

    def at(self, frame: float) -> float:
        """Returns the value at a frame, which may be fractional."""

@overload
def keys(
    keys: Mapping[int, float] | Mapping[float, float],
    mode: Mode | tuple[Literal["bezier"], float, float, float, float] = "linear",
    cycle: bool = False,
) -> Curve: ...
@overload
def keys(
    keys: Mapping[int, Sequence[float] | NDArray[Any] | str] | Mapping[float, Sequence[float] | NDArray[Any] | str],
    mode: Mode | tuple[Literal["bezier"], float, float, float, float] = "linear",
    cycle: bool = False,
) -> tuple[Curve, ...]: ...

class Material:
    """A surface, of the clauses that are given."""

    def __init__(
        self,
        *,
        name: str | None = None,
        # clauses
    ) -> None: ...
    @property
    def name(self) -> str | None: ...

class Picture(NDArray[Any]):
    """An array of pixels that a notebook shows as a picture."""

    def png(self) -> bytes:
        """Returns the picture as a PNG file."""

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the picture as a PNG file."""

class Scene:
    """A scene: its commands in order, as a script has them.

    `Scene(640, 360)` sets the size of the picture. Each command of the scene language that sets something may be a keyword:
    `samples=64`, `samples=(64, 1)`, `background="#204080"`. A tuple holds the arguments of the command, a dict its
    keywords.
    """

    def __init__(
        self,
        width: int | None = None,
        height: int | None = None,
        *,
        # settings
    ) -> None: ...
    # commands
    @property
    def frame_count(self) -> int:
        """The number of frames."""

    def copy(self) -> Scene:
        """Returns a copy, to which other commands can be added."""

    def check(self) -> list[Diagnostic]:
        """Returns all errors and warnings about the script, without drawing it."""

    def render(self, frame: int = 1, *, linear: bool = False) -> Picture:
        """Draws a frame, counted from 1.

        Returns an array of height x width x 3: levels from 0 to 255 as `uint8`, or with `linear` the light before `tone`
        and rounding, from 0 to 1, as `float32`. A scene with `background("none")` has a fourth channel, alpha; `linear` light
        is premultiplied by it.
        """

    def save(self, path: str | PathLike[str], frame: int = 1) -> None:
        """Draws a frame and writes it as PNG; or writes the script, for a path that ends in `.txt`."""

class Animation:
    """Frames in order, and how they are shown. `animation` and `load` make one."""

    fps: float
    loop: int
    bounce: bool
    durations: dict[int, float]
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[Scene]: ...
    def __getitem__(self, index: int) -> Scene: ...
    def frames(self, *, progress: bool = True, linear: bool = False) -> Iterator[Picture]:
        """Draws the frames, ahead within a bound on memory, and yields them in order."""

    def gif(self, *, progress: bool = True, exact: bool = False) -> bytes:
        """Returns the animation as a GIF file."""

    def save(self, path: str | PathLike[str], *, progress: bool = True, exact: bool = False) -> None:
        """Writes the animation.

        The ending of `path` decides: `.gif`, `.apng` or `.webp`; `.png` with a number such as `%04d` for a file for each
        frame; a folder (`film/`, or one that is there) for scripts, which `rayfold render` draws.
        """

    def submit(
        self,
        address: str,
        path: str | PathLike[str] | None = None,
        *,
        delete: bool = False,
        wait: bool = True,
        progress: bool = True,
    ) -> bytes | None:
        """Renders the animation in a bucket, as `rayfold submit` does.

        Checks the scripts, uploads those that the bucket does not have, waits, and returns the GIF as bytes, or writes it
        to `path`. Region, credentials and endpoint come from the standard AWS environment. Ctrl-C loses nothing: the same
        call goes on.

        Parameters
        ----------
        address : str
            the bucket and the animation's name in it: `"s3://films/wave"`.
        path : str or path, optional
            the GIF's file.
        delete : bool
            whether scripts of that name in the bucket that the animation does not have are deleted. Otherwise they are an
            error, and nothing is uploaded.
        wait : bool
            whether to wait for the GIF. Otherwise nothing is returned.
        progress : bool
            whether a bar of `tqdm` is shown, if it is installed.
        """

def animation(
    scenes: Callable[[float], Scene] | Iterable[Scene] | Scene,
    frames: int | None = None,
    fps: float = 10,
    *,
    loop: int = 0,
    bounce: bool = False,
    durations: Mapping[int, float] | None = None,
) -> Animation:
    """Makes an animation of scenes.

    Parameters
    ----------
    scenes : callable, iterable of Scene, or Scene
        a function of the time in seconds, which is called `frames` times, with 0, 1/fps, 2/fps and so on; or the scenes
        in order. A scene with several frames (`frames`, `trace`) gives all of them.
    frames : int, optional
        the number of frames; an iterable is cut there.
    fps : float
        frames per second.
    loop : int
        repetitions, 0 for endless; -1 shows the animation once.
    bounce : bool
        whether the animation runs back after its last frame.
    durations : dict, optional
        times of frames in seconds, by the number of the frame from 1.
    """

def gif(
    images: Iterable[NDArray[Any]],
    fps: float = 10,
    path: str | PathLike[str] | None = None,
    *,
    loop: int = 0,
    exact: bool = False,
) -> bytes | None:
    """Encodes arrays of height x width x 3 (`uint8`) as a GIF. Returns its bytes, or writes them to `path`.

    Arrays of height x width x 4 have alpha, of which a GIF shows a pixel or does not. Arrays of height x width are greys. Frames
    are taken one by one: memory does not grow with their number.
    """

def parse(text: str, name: str = "scene") -> Scene:
    """Makes a scene of a script's text. Commands that are added belong to its last frame."""

def load(path: str | PathLike[str]) -> Animation:
    """Reads a folder of scripts with its `animation.json`, or one script, as an animation."""

def linear(color: str) -> tuple[float, float, float]:
    """Returns the channels of a colour such as `"#c04020"` as linear light, for scenes with `tone("srgb")`."""
