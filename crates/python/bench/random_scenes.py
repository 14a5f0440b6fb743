"""Random scenes, made by methods and by formatted strings. Their pictures are compared byte for byte.

A method and a line are written from the same numbers, but not by the same code: the text comes from `repr`. All commands and
clauses of a picture occur. `RAYFOLD_SEED` replays a run.
"""

import os
import random
import subprocess
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

import rayfold as rf

ROOT = Path(__file__).resolve().parents[3]
#: Scenes that the command draws at once, as the frames of a folder.
FOLDER = 500


def seed():
    """The seed of a run, which a failure prints."""
    return int(os.environ.get("RAYFOLD_SEED") or random.SystemRandom().randrange(1 << 32))


class Dice(random.Random):
    """Random values of the kinds that commands take."""

    def number(self, low=-3.0, high=3.0):
        value = self.uniform(low, high)
        return self.choice([value, value, round(value, 1), float(int(value)), int(value), value * 1e-7, -0.0, value * 1e9 % high])

    def positive(self):
        return abs(self.number(0.1, 2.0)) + self.choice([0.05, 1e-6])

    def vector(self):
        return tuple(self.number() for _ in range(3))

    def apart(self, other):
        """A point that is not another."""
        return tuple(x + self.choice([-1, 1]) * self.uniform(0.1, 2) for x in other)

    def color(self):
        return tuple(self.random() for _ in range(3))

    def given(self, values):
        """The same numbers as a tuple, a list or an array."""
        return self.choice([tuple, list, lambda v: np.array(v, float)])(values)


def text(*values):
    flat = []
    for value in values:
        flat.extend(value if isinstance(value, tuple) else [value])
    return " ".join(v if isinstance(v, str) else repr(v) for v in flat)


class Pair:
    """A scene by methods and the lines of its script by formatted strings."""

    def __init__(self, dice, width=24, height=16):
        self.dice = dice
        self.scene = rf.Scene(width, height)
        self.lines = [f"Screen {width} {height}"]
        self.named = []
        #: Those that may be part of a pattern.
        self.plain = []

    def both(self, name, *values):
        given = [self.dice.given(v) if isinstance(v, tuple) else getattr(v, "curve", v) for v in values]
        getattr(self.scene, name.lower())(*given)
        self.lines.append(f"{name} {text(*values)}".rstrip())

    def clauses(self):
        """The keywords of a material, and the words of its line."""
        dice, keywords, words = self.dice, {}, []
        for name in ("ambient", "diffuse", "mirror"):
            if dice.random() < 0.7:
                keywords[name] = color = dice.color()
                words += [name, text(color)]
        if dice.random() < 0.3:
            keywords["shine"] = shine = (dice.color(), 1.0 + dice.positive())
            words += ["shine", text(*shine)]
        if dice.random() < 0.2:
            keywords["glass"] = glass = (dice.color(), dice.uniform(1, 2))
            words += ["glass", text(*glass)]
        if self.plain and dice.random() < 0.4:
            pattern, other = dice.choice(["checker", "stripes", "noise", "gradient"]), dice.choice(self.plain)
            numbers = (dice.number(), dice.number() + 7) if pattern == "gradient" else (dice.positive(),)
            keywords[pattern] = (*numbers, other)
            words += [pattern, text(*numbers), other]
        if not keywords:
            keywords, words = {"diffuse": (0.5, 0.5, 0.5)}, ["diffuse", "0.5 0.5 0.5"]
        return keywords, " ".join(words)

    def material(self):
        name = f"a{len(self.named)}"
        keywords, words = self.clauses()
        self.lines.append(f"Material {name} {words}")
        if self.dice.random() < 0.5:
            self.scene.material(name, **keywords)
        else:
            # Defined by the object that uses it first, which is behind the camera.
            self.scene.sphere(0.1, (0, 0, 50), rf.Material(name=name, **keywords))
            self.lines.append(f"Sphere 0.1 0 0 50 {name}")
        self.named.append(name)
        if set(keywords) <= {"ambient", "diffuse", "mirror"}:
            self.plain.append(name)
        return name

    def shape(self, at):
        dice = self.dice
        near = dice.vector()
        kind = dice.randrange(10)
        if kind == 0:
            self.both("Sphere", self.moving(dice.positive()), near, at)
        elif kind == 1:
            self.both("Box", near, dice.apart(near), at)
        elif kind == 2:
            self.both("Cylinder", dice.positive(), near, dice.apart(near), at)
        elif kind == 3:
            self.both("Torus", 1.0 + dice.positive(), 0.3, near, (0.1, 1.0, 0.0), at)
        elif kind == 4:
            self.both("Triangle", near, dice.vector(), dice.vector(), at)
        elif kind == 5:
            self.both("Disc", dice.positive(), near, (0.2, 1.0, 0.5), at)
        elif kind == 6:
            self.both("Cone", dice.positive(), dice.positive() + 0.1, near, dice.apart(near), at)
        elif kind == 7:
            self.both("Capsule", dice.positive(), near, dice.apart(near), at)
        elif kind == 8:
            far = tuple(place + 0.5 + dice.positive() for place in near)
            self.both("Roundbox", near, far, 0.25 * dice.random(), at)
        else:
            self.both("Plane", (0.0, -3.0 - dice.random(), 0.0), (0.0, 1.0, 0.1), at)

    def moving(self, value):
        """A number, or a curve from it, which is added as both."""
        if self.dice.random() < 0.8:
            return value
        return Both(rf.keys({1: value, 3: value + 1}, "smooth"), f"(smooth 1:{value!r} 3:{value + 1!r})")


class Both(str):
    """A curve of Python that formats as its text."""

    def __new__(cls, curve, words):
        made = super().__new__(cls, words)
        made.curve = curve
        return made


def random_scene(dice):
    """A scene by methods, and its script by formatted strings."""
    pair = Pair(dice)
    both = pair.both
    both("Background", dice.color(), dice.color())
    both("Look", (0.3, 1.5, 9.0), (dice.number(-1, 1), dice.number(-1, 1), 0.0), dice.uniform(20, 60), (0.0, 1.0, 0.1))
    if dice.random() < 0.3:
        both("Samples", dice.randrange(2, 5), round(dice.random(), 2))
        both("Tone", dice.choice(["plain", "srgb"]))
        if dice.random() < 0.5:
            both("Lens", dice.uniform(0, 0.3))
        if dice.random() < 0.5:
            both("Shutter", dice.random())
    if dice.random() < 0.2:
        both("Fog", dice.color(), 1.0 + dice.positive())
    both("Depth", dice.randrange(0, 9))
    both("Ilight", dice.color(), (1.0, -1.0 - dice.random(), -0.5))
    both("Plight", dice.color(), dice.vector(), 0.0, dice.positive())
    for _ in range(dice.randrange(1, 5)):
        pair.material()
    if dice.random() < 0.3:
        at = dice.choice(pair.named)
        with pair.scene.group("g"):
            pair.lines.append("Group g")
            for _ in range(dice.randrange(1, 4)):
                pair.shape(at)
        pair.lines.append("End")
        for _ in range(dice.randrange(1, 3)):
            both("Use", "g", dice.vector(), dice.vector(), dice.positive())
    for _ in range(dice.randrange(1, 8)):
        pair.shape(dice.choice(pair.named))
    if dice.random() < 0.3:
        both("Frames", 2)
    return pair.scene, "\n".join([*pair.lines, "Trace", ""])


def compare(count, from_seed, command=None):
    """Draws so many scenes in each way. Returns the frames that were compared; a difference is an assertion."""
    dice, frames = Dice(from_seed), 0
    for start in range(0, count, FOLDER):
        scripts, drawn = [], []
        for k in range(start, min(start + FOLDER, count)):
            scene, script = random_scene(dice)
            about = f"RAYFOLD_SEED={from_seed}, scene {k}:\n{script}\n{scene}"
            assert str(scene) == str(rf.parse(str(scene))), about
            other = rf.parse(script)
            assert scene.frame_count == other.frame_count, about
            for frame in range(1, scene.frame_count + 1):
                picture = scene.render(frame)
                assert np.array_equal(picture, other.render(frame)), about
                drawn.append((picture, about))
            scripts.append(str(scene))
        frames += len(drawn)
        if command:
            compare_with_command(command, scripts, drawn)
    return frames


def compare_with_command(command, scripts, drawn):
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place, "scenes")
        folder.mkdir()
        for k, script in enumerate(scripts):
            (folder / f"{k}.txt").write_text(script)
        out = Path(place, "out")
        subprocess.run([command, "render", str(folder), "-o", str(out / "%d.png"), "--quiet"], check=True)
        for k, (picture, about) in enumerate(drawn, 1):
            assert (out / f"{k}.png").read_bytes() == picture.png(), about


def run(count="10000"):
    command = os.environ.get("RAYFOLD", str(ROOT / "target" / "release" / "rayfold"))
    from_seed, start = seed(), time.perf_counter()
    print(f"RAYFOLD_SEED={from_seed}", flush=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rf.SceneWarning)
        frames = compare(int(count), from_seed, command)
    print(f"{int(count):,} scenes, {frames:,} frames: no byte differs, in {time.perf_counter() - start:.0f} s")
    return 0
