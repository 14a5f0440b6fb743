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
Mode: TypeAlias = Literal["linear", "smooth", "step", "in", "out", "inout", "back", "elastic", "bounce", "bezier"]

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
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
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
        camera: Any = ...,
        look: Any = ...,
        lens: Any = ...,
        background: Any = ...,
        sky: Any = ...,
        fog: Any = ...,
        samples: Any = ...,
        shutter: Any = ...,
        tone: Any = ...,
        depth: Any = ...,
        indirect: Any = ...,
        ilight: Any = ...,
        plight: Any = ...,
        frames: Any = ...,
    ) -> None: ...
    def screen(
        self,
        width: int,
        height: int,
    ) -> None:
        """The size of the image.

        In a script: `Screen nx ny`.

        Parameters
        ----------
        width : int
            the width nx (`nx`): number in pixels, whole, from 1.
        height : int
            the height ny (`ny`): number in pixels, whole, from 1.
        """
    def orthocamera(
        self,
    ) -> None:
        """A parallel projection.

        In a script: `Orthocamera`.
        """
    def camera(
        self,
        eye: Vector,
        gaze: Vector,
        up: Vector,
        distance: Number,
        lower_left: Vector,
        upper_right: Vector,
    ) -> None:
        """A pinhole camera.

        In a script: `Camera ex ey ez gx gy gz upx upy upz s au av bu bv`.

        Parameters
        ----------
        eye : Vector
            the eye (`ex ey ez`): position in world units.
        gaze : Vector
            the gaze (`gx gy gz`): direction, not all 0.
        up : Vector
            the view-up (`upx upy upz`): direction, not all 0.
        distance : Number
            the window's distance s (`s`): length in world units, greater than 0.
        lower_left : Vector
            the window's corner (`au av`): position in the window in world units.
        upper_right : Vector
            the window's corner (`bu bv`): position in the window in world units.

        In the names of the script, `gx gy gz` and `upx upy upz` are not parallel; `au av` and `bu bv` differ in every number.
        """
    def look(
        self,
        eye: Vector,
        at: Vector,
        fov: Number,
        up: Vector | None = None,
    ) -> None:
        """A camera that looks at a target.

        In a script: `Look ex ey ez tx ty tz fov [upx upy upz]`.

        Parameters
        ----------
        eye : Vector
            the eye (`ex ey ez`): position in world units.
        at : Vector
            the target (`tx ty tz`): position in world units.
        fov : Number
            the field of view (`fov`): angle in degrees, above 0 and below 180.
        up : Vector, optional
            the view-up (`upx upy upz`): direction, not all 0; by default 0 1 0, or 0 0 -1 for a gaze along y.

        In the names of the script, `ex ey ez` and `tx ty tz` differ; from `ex ey ez` to `tx ty tz` is not parallel to `upx upy upz`, if given.
        """
    def lens(
        self,
        radius: Number,
        distance: Number | None = None,
    ) -> None:
        """A lens that is in focus at one distance.

        In a script: `Lens radius [distance]`.

        Parameters
        ----------
        radius : Number
            the lens's radius (`radius`): length in world units, at least 0.
        distance : Number, optional
            the lens's distance (`distance`): length in world units, greater than 0; by default the target's, or the window's.
        """
    def background(
        self,
        color: Color | Literal["none"],
        top: Color | None = None,
    ) -> None:
        """The colour of rays that hit nothing.

        In a script: `Background r g b [R G B] or none`.

        Parameters
        ----------
        color : Color
            the background (`r g b`): colour in display values, clamped to 0..1.
        top : Color, optional
            the background (`R G B`): colour in display values, clamped to 0..1; by default the first colour.

        `background("none")` in place of all arguments.
        """
    def sky(
        self,
        color: Color,
        top: Color | None = None,
    ) -> None:
        """The light around the scene.

        In a script: `Sky r g b [R G B]`.

        Parameters
        ----------
        color : Color
            the sky (`r g b`): colour in display values, at least 0.
        top : Color, optional
            the sky above (`R G B`): colour in display values, at least 0; by default the first colour.
        """
    def sky_picture(
        self,
        file: str | Pixels,
        strength: Number | None = None,
        turn: Number | None = None,
    ) -> None:
        """A picture as the light around the scene.

        In a script: `Sky "FILE" [strength [turn]]`.

        Parameters
        ----------
        file : str | Pixels
            the name of a file in the script's folder; of a scene that has none, in the current folder; or an array of pixels, of height x width, with 1, 3 or 4 channels: `uint8` or `uint16` are levels, floats are light from 0.
        strength : Number, optional
            the sky's strength (`strength`): number, at least 0; by default 1.
        turn : Number, optional
            the sky's turn (`turn`): angle in degrees; by default 0.
        """
    def fog(
        self,
        color: Color | Literal["none"],
        distance: Number | None = None,
    ) -> None:
        """The colour that rays take on over their length.

        In a script: `Fog r g b d or none`.

        Parameters
        ----------
        color : Color
            the fog (`r g b`): colour in display values.
        distance : Number
            the fog's distance d (`d`): length in world units, greater than 0.

        `fog("none")` in place of all arguments.
        """
    def samples(
        self,
        n: int,
        error: FixedNumber | None = None,
    ) -> None:
        """The number of rays per pixel.

        In a script: `Samples n [e]`.

        Parameters
        ----------
        n : int
            the number of samples (`n`): number in rays, whole, from 1.
        error : FixedNumber, optional
            the error e (`e`): error in levels, at least 0; by default 1.
        """
    def shutter(
        self,
        open: FixedNumber,
    ) -> None:
        """The share of a frame's time that the shutter is open.

        In a script: `Shutter f`.

        Parameters
        ----------
        open : FixedNumber
            the shutter (`f`): number, from 0 to 1.
        """
    def tone(
        self,
        tone: Literal["plain", "srgb"],
    ) -> None:
        """The conversion of colours to levels.

        In a script: `Tone tone`.

        Parameters
        ----------
        tone : Literal["plain", "srgb"]
            the tone (`tone`): word, plain or srgb.
        """
    def depth(
        self,
        bounces: int,
    ) -> None:
        """The largest number of reflections and refractions of a ray.

        In a script: `Depth n`.

        Parameters
        ----------
        bounces : int
            the depth (`n`): number in bounces, whole, from 0 to 64.
        """
    def indirect(
        self,
        bounces: int,
    ) -> None:
        """The largest number of diffuse reflections of a ray.

        In a script: `Indirect n`.

        Parameters
        ----------
        bounces : int
            the number of diffuse reflections (`n`): number in bounces, whole, from 0 to 16.
        """
    def sphere(
        self,
        radius: Number,
        center: Vector,
        material: Material | str | None = None,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> None:
        """A sphere.

        In a script: `Sphere R cx cy cz ar ag ab rr rg rb [sr sg sb]`.

        Parameters
        ----------
        radius : Number
            the radius (`R`): length in world units, at least 0.
        center : Vector
            the centre (`cx cy cz`): position in world units.
        material : Material | str, optional
            the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. Black by default.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.
        """
    def triangle(
        self,
        u: Vector,
        v: Vector,
        w: Vector,
        material: Material | str | None = None,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> None:
        """A triangle.

        In a script: `Triangle ux uy uz vx vy vz wx wy wz ar ag ab rr rg rb [sr sg sb]`.

        Parameters
        ----------
        u : Vector
            the vertex (`ux uy uz`): position in world units.
        v : Vector
            the vertex (`vx vy vz`): position in world units.
        w : Vector
            the vertex (`wx wy wz`): position in world units.
        material : Material | str, optional
            the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. Black by default.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.
        """
    def box(
        self,
        u: Vector,
        v: Vector,
        material: Material | str | None = None,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> None:
        """A box along the axes.

        In a script: `Box ux uy uz vx vy vz ar ag ab rr rg rb [sr sg sb]`.

        Parameters
        ----------
        u : Vector
            the corner (`ux uy uz`): position in world units.
        v : Vector
            the corner (`vx vy vz`): position in world units.
        material : Material | str, optional
            the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. Black by default.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.
        """
    def plane(
        self,
        point: Vector,
        normal: Vector,
        material: Material | str | None = None,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> None:
        """An infinite plane.

        In a script: `Plane px py pz nx ny nz ar ag ab rr rg rb [sr sg sb]`.

        Parameters
        ----------
        point : Vector
            the point (`px py pz`): position in world units.
        normal : Vector
            the normal (`nx ny nz`): direction, not all 0.
        material : Material | str, optional
            the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. Black by default.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.
        """
    def disc(
        self,
        radius: Number,
        center: Vector,
        normal: Vector,
        material: Material | str | None = None,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> None:
        """A flat, round disc.

        In a script: `Disc R cx cy cz nx ny nz ar ag ab rr rg rb [sr sg sb]`.

        Parameters
        ----------
        radius : Number
            the radius (`R`): length in world units, at least 0.
        center : Vector
            the centre (`cx cy cz`): position in world units.
        normal : Vector
            the normal (`nx ny nz`): direction, not all 0.
        material : Material | str, optional
            the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. Black by default.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.
        """
    def cylinder(
        self,
        radius: Number,
        a: Vector,
        b: Vector,
        material: Material | str | None = None,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> None:
        """A closed cylinder.

        In a script: `Cylinder R ax ay az bx by bz ar ag ab rr rg rb [sr sg sb]`.

        Parameters
        ----------
        radius : Number
            the radius (`R`): length in world units, at least 0.
        a : Vector
            the axis's end (`ax ay az`): position in world units.
        b : Vector
            the axis's end (`bx by bz`): position in world units.
        material : Material | str, optional
            the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. Black by default.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.

        In the names of the script, `ax ay az` and `bx by bz` differ.
        """
    def cone(
        self,
        radius_a: Number,
        radius_b: Number,
        a: Vector,
        b: Vector,
        material: Material | str | None = None,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> None:
        """A closed cone or truncated cone.

        In a script: `Cone Ra Rb ax ay az bx by bz ar ag ab rr rg rb [sr sg sb]`.

        Parameters
        ----------
        radius_a : Number
            the radius Ra (`Ra`): length in world units, at least 0.
        radius_b : Number
            the radius Rb (`Rb`): length in world units, at least 0.
        a : Vector
            the axis's end (`ax ay az`): position in world units.
        b : Vector
            the axis's end (`bx by bz`): position in world units.
        material : Material | str, optional
            the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. Black by default.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.

        In the names of the script, `ax ay az` and `bx by bz` differ.
        """
    def torus(
        self,
        radius: Number,
        thickness: Number,
        center: Vector,
        normal: Vector,
        material: Material | str | None = None,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> None:
        """A ring (torus).

        In a script: `Torus R r cx cy cz nx ny nz ar ag ab rr rg rb [sr sg sb]`.

        Parameters
        ----------
        radius : Number
            the radius (`R`): length in world units, greater than 0.
        thickness : Number
            the thickness r (`r`): length in world units, greater than 0.
        center : Vector
            the centre (`cx cy cz`): position in world units.
        normal : Vector
            the normal (`nx ny nz`): direction, not all 0.
        material : Material | str, optional
            the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. Black by default.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.

        In the names of the script, `R` is greater than `r`.
        """
    def capsule(
        self,
        radius: Number,
        a: Vector,
        b: Vector,
        material: Material | str | None = None,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> None:
        """A cylinder with round ends.

        In a script: `Capsule R ax ay az bx by bz ar ag ab rr rg rb [sr sg sb]`.

        Parameters
        ----------
        radius : Number
            the radius (`R`): length in world units, at least 0.
        a : Vector
            the axis's end (`ax ay az`): position in world units.
        b : Vector
            the axis's end (`bx by bz`): position in world units.
        material : Material | str, optional
            the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. Black by default.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.
        """
    def roundbox(
        self,
        u: Vector,
        v: Vector,
        radius: Number,
        material: Material | str | None = None,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> None:
        """A box with round edges.

        In a script: `Roundbox ux uy uz vx vy vz r ar ag ab rr rg rb [sr sg sb]`.

        Parameters
        ----------
        u : Vector
            the corner (`ux uy uz`): position in world units.
        v : Vector
            the corner (`vx vy vz`): position in world units.
        radius : Number
            the radius (`r`): length in world units, at least 0.
        material : Material | str, optional
            the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. Black by default.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.

        In the names of the script, `r` is at most half of each side from `ux uy uz` to `vx vy vz`.
        """
    @overload
    def mesh(
        self,
        file: str,
        material: Material | str | None = None,
        smooth: FixedNumber | None = None,
        flat: bool | None = None,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> None:
        """The triangles of a model in a file.

        In a script: `Mesh "FILE" [M] [smooth a or flat]`.

        Parameters
        ----------
        file : str
            the name of a file in the script's folder; of a scene that has none, in the current folder.
        material : Material | str, optional
            the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. By default that of the file.
        smooth : FixedNumber, optional
            faces that meet at less than this angle in degrees, 0 to 180, look smooth.
        flat : bool, optional
            whether the normals of the file are left out.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.

        From arrays: `mesh(vertices, faces, normals, colors, uv, material, smooth, flat)`, of which the first two are needed. NumPy's arrays are taken, and what NumPy makes arrays of, such as lists of rows. The scene names them as a file, which is written where the script is saved.

        Parameters
        ----------
        vertices : Array
            (n, 3) places, of `float32`, `float64` or integers.
        faces : Array
            (m, 3) triangles or (m, 4) convex quadrilaterals: the indices of their vertices from 0, counterclockwise seen from
            outside.
        normals : Array, optional
            (n, 3) directions at the vertices, with which the mesh looks smooth.
        colors : Array, optional
            (n, 3) or opaque (n, 4) levels of the vertices: `uint8` from 0 to 255, `uint16` or floats from 0 to 1. Under `tone("srgb")` they are decoded, as `"#c04020"` is.
        uv : Array, optional
            (n, 2) texture coordinates of the vertices. (0, 0) is the lower left corner of a picture.
        material, smooth, flat and the clauses
            as those of a file.
        """
    @overload
    def mesh(
        self,
        vertices: Array,
        faces: Array,
        normals: Array | None = None,
        colors: Array | None = None,
        uv: Array | None = None,
        material: Material | str | None = None,
        smooth: FixedNumber | None = None,
        flat: bool | None = None,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> None:
        """The triangles of a model in a file.

        In a script: `Mesh "FILE" [M] [smooth a or flat]`.

        Parameters
        ----------
        file : str
            the name of a file in the script's folder; of a scene that has none, in the current folder.
        material : Material | str, optional
            the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. By default that of the file.
        smooth : FixedNumber, optional
            faces that meet at less than this angle in degrees, 0 to 180, look smooth.
        flat : bool, optional
            whether the normals of the file are left out.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.

        From arrays: `mesh(vertices, faces, normals, colors, uv, material, smooth, flat)`, of which the first two are needed. NumPy's arrays are taken, and what NumPy makes arrays of, such as lists of rows. The scene names them as a file, which is written where the script is saved.

        Parameters
        ----------
        vertices : Array
            (n, 3) places, of `float32`, `float64` or integers.
        faces : Array
            (m, 3) triangles or (m, 4) convex quadrilaterals: the indices of their vertices from 0, counterclockwise seen from
            outside.
        normals : Array, optional
            (n, 3) directions at the vertices, with which the mesh looks smooth.
        colors : Array, optional
            (n, 3) or opaque (n, 4) levels of the vertices: `uint8` from 0 to 255, `uint16` or floats from 0 to 1. Under `tone("srgb")` they are decoded, as `"#c04020"` is.
        uv : Array, optional
            (n, 2) texture coordinates of the vertices. (0, 0) is the lower left corner of a picture.
        material, smooth, flat and the clauses
            as those of a file.
        """
    def text(
        self,
        text: str,
        size: FixedNumber,
        depth: FixedNumber,
        material: Material | str | None = None,
        align: Literal["left", "centre", "right"] | None = None,
        font: str | None = None,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> None:
        """Letters cut out of a plate.

        In a script: `Text "TEXT" SIZE DEPTH [M] [left or centre or right] [font "FILE"]`.

        Parameters
        ----------
        text : str
            the words; a line feed begins a line.
        size : FixedNumber
            the size of the letters (`SIZE`): length in world units, greater than 0.
        depth : FixedNumber
            the depth of the letters (`DEPTH`): length in world units, at least 0.
        material : Material | str, optional
            the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. By default .8 grey.
        align : Literal["left", "centre", "right"], optional
            the end of the lines that is at x = 0: they begin there, have their middles there or end there; by default "left".
        font : str, optional
            the name of a TrueType or OpenType file, as that of a model; by default Noto Sans Bold, which comes with rayfold.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.
        """
    def material(
        self,
        name: str,
        *,
        ambient: Color | None = None,
        diffuse: Color | None = None,
        mirror: Color | None = None,
        shine: tuple[Color, Number] | None = None,
        glass: tuple[Color, Number] | None = None,
        checker: tuple[Number, Material | str] | None = None,
        stripes: tuple[Number, Material | str] | None = None,
        noise: tuple[Number, Material | str] | None = None,
        gradient: tuple[Number, Number, Material | str] | None = None,
        image: tuple[str | Pixels, Literal["uv", "ball"]] | tuple[str | Pixels, Literal["flat"], Number] | tuple[str | Pixels, Literal["flat"], Number, Literal["xy", "xz", "zy"]] | None = None,
        own: bool | None = None,
        glow: Color | None = None,
        rough: Number | None = None,
    ) -> Material:
        """A surface material with a name.

        In a script: `Material NAME`.

        Parameters
        ----------
        name : str
            the name of the new material.
        ambient, diffuse, mirror, shine, glass, checker, stripes, noise, gradient, image, own, glow, rough
            the clauses of a material, as those of `Material`.
        """
    def group(
        self,
        name: str,
    ) -> AbstractContextManager[Scene]:
        """Names the objects up to its `End`.

        In a script: `Group NAME`.

        Parameters
        ----------
        name : str
            the name of the new group.
        """
    def end(
        self,
    ) -> None:
        """Ends a group.

        In a script: `End`.
        """
    def use(
        self,
        name: str,
        translation: Vector | None = None,
        rotation: Vector | None = None,
        scale: Number | None = None,
    ) -> None:
        """Draws a group.

        In a script: `Use NAME [tx ty tz [rx ry rz [s]]]`.

        Parameters
        ----------
        name : str
            the name of a group.
        translation : Vector, optional
            the translation (`tx ty tz`): position in world units; by default 0.
        rotation : Vector, optional
            the rotation (`rx ry rz`): angles about the axes in degrees; by default 0.
        scale : Number, optional
            the scale (`s`): number, at least 0; by default 1.
        """
    def ilight(
        self,
        color: Color,
        direction: Vector,
        angle: Number | None = None,
    ) -> None:
        """A directional light.

        In a script: `Ilight lr lg lb dx dy dz [angle]`.

        Parameters
        ----------
        color : Color
            the light's colour (`lr lg lb`): colour in display values.
        direction : Vector
            the light's direction (`dx dy dz`): direction, not all 0.
        angle : Number, optional
            the sun's angle (`angle`): angle in degrees, from 0 to below 180; by default 0.
        """
    def plight(
        self,
        color: Color,
        position: Vector,
        radius: Number | None = None,
        reach: Number | None = None,
    ) -> None:
        """A light with a position.

        In a script: `Plight lr lg lb x y z [radius [reach]]`.

        Parameters
        ----------
        color : Color
            the light's colour (`lr lg lb`): colour in display values.
        position : Vector
            the lamp's position (`x y z`): position in world units.
        radius : Number, optional
            the lamp's radius (`radius`): length in world units, at least 0; by default 0.
        reach : Number, optional
            the lamp's reach (`reach`): length in world units, at least 0; by default 0.
        """
    def frames(
        self,
        a: int,
        b: int | None = None,
    ) -> None:
        """The frame numbers of a `Trace`.

        In a script: `Frames a [b]`.

        Parameters
        ----------
        a : int
            the first frame a (`a`): number in frames, whole, from 1.
        b : int, optional
            the last frame b (`b`): number in frames, whole, from 1; by default 1 to a.

        In the names of the script, `a` is at most `b`.
        """
    def clear(
        self,
    ) -> None:
        """Removes objects and lights.

        In a script: `Clear`.
        """
    def trace(
        self,
    ) -> None:
        """Renders a frame.

        In a script: `Trace`.
        """
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
