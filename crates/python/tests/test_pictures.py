"""What Python draws is what `rayfold render` draws of the same text, bit for bit."""

import io
import random
import warnings

import numpy as np
import pytest
from PIL import Image

import rayfold as rf

SEED = 4242


def pixels(file):
    return np.asarray(Image.open(io.BytesIO(file)).convert("RGB"))


def number(dice, low=-3.0, high=3.0):
    kind = dice.randrange(6)
    value = dice.uniform(low, high)
    return [value, round(value, 1), float(int(value)), value * 1e-7, value * 1e9 % high, value][kind]


def positive(dice):
    return abs(number(dice, 0.1, 2.0)) + dice.choice([0.05, 1e-6])


def vector(dice):
    return tuple(number(dice) for _ in range(3))


def color(dice):
    return tuple(dice.random() for _ in range(3))


def text(*values):
    flat = []
    for value in values:
        flat.extend(value if isinstance(value, tuple) else [value])
    return " ".join(v if isinstance(v, str) else repr(v) for v in flat)


def random_scene(dice):
    """A scene by methods, and its script by formatted strings."""
    scene, lines = rf.Scene(24, 16), ["Screen 24 16"]

    def both(name, *values):
        getattr(scene, name.lower())(*values)
        lines.append(f"{name} {text(*values)}")

    both("Background", color(dice), color(dice))
    eye, up = (0.3, 1.5, 9.0), (0.0, 1.0, 0.1)
    both("Look", eye, (number(dice, -1, 1), number(dice, -1, 1), 0.0), dice.uniform(20, 60), up)
    if dice.random() < 0.3:
        both("Samples", dice.randrange(2, 5), round(dice.random(), 2))
        both("Tone", dice.choice(["plain", "srgb"]))
    both("Depth", dice.randrange(0, 9))
    both("Ilight", color(dice), (1.0, -1.0 - dice.random(), -0.5))
    both("Plight", color(dice), vector(dice), 0.0, positive(dice))
    for i in range(dice.randrange(1, 8)):
        ambient, diffuse, mirror = color(dice), color(dice), color(dice)
        exponent = 1.0 + positive(dice)
        scene.material(f"a{i}", ambient=ambient, diffuse=diffuse, mirror=mirror, shine=(color(random.Random(i)), exponent))
        shine = text(color(random.Random(i)), exponent)
        lines.append(
            f"Material a{i} ambient {text(ambient)} diffuse {text(diffuse)} mirror {text(mirror)} shine {shine}"
        )
        kind = dice.randrange(6)
        at = f"a{i}"
        if kind == 0:
            both("Sphere", positive(dice), vector(dice), at)
        elif kind == 1:
            both("Box", vector(dice), vector(dice), at)
        elif kind == 2:
            both("Cylinder", positive(dice), (0.0, -1.0, number(dice)), (0.5, 1.0, number(dice)), at)
        elif kind == 3:
            both("Torus", 1.0 + positive(dice), 0.3, vector(dice), (0.1, 1.0, 0.0), at)
        elif kind == 4:
            both("Triangle", vector(dice), vector(dice), vector(dice), at)
        else:
            both("Disc", positive(dice), vector(dice), (0.2, 1.0, 0.5), at)
    return scene, "\n".join([*lines, "Trace\n"])


def test_a_thousand_random_scenes_are_those_of_their_texts(tmp_path, rayfold):
    dice = random.Random(SEED)
    scripts, drawn = [], []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rf.SceneWarning)
        for k in range(1000):
            scene, script = random_scene(dice)
            assert str(scene) == str(rf.parse(str(scene)))
            picture = scene.render()
            assert np.array_equal(picture, rf.parse(script).render()), f"seed {SEED}, scene {k}:\n{script}"
            scripts.append(str(scene))
            drawn.append(picture)
    # The command draws all of them at once, as the frames of a folder.
    folder = tmp_path / "scenes"
    folder.mkdir()
    for k, script in enumerate(scripts):
        (folder / f"{k}.txt").write_text(script)
    import subprocess

    subprocess.run(
        [rayfold, "render", str(folder), "-o", str(tmp_path / "out" / "%d.png"), "--quiet"], check=True
    )
    for k, picture in enumerate(drawn):
        file = (tmp_path / "out" / f"{k + 1}.png").read_bytes()
        assert np.array_equal(pixels(file), picture), f"seed {SEED}, scene {k}:\n{scripts[k]}"


def test_a_file_is_that_of_the_command(stage, render, tmp_path):
    stage.sphere(1, (0, 1, 0), diffuse="#c04020", mirror=0.2)
    stage.save(tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes() == render(stage)
    stage.save(tmp_path / "a.txt")
    assert (tmp_path / "a.txt").read_text() == str(stage)


def test_curves_and_frames_are_drawn_as_by_the_command(stage, render):
    x = rf.keys({1: -2, 5: 2}, "smooth")
    stage.sphere(rf.keys({1: 1, 5: 0.5}), (x, 1, 0), diffuse=rf.keys({1: "#ff0000", 5: "#0000ff"}))
    stage.frames(5)
    assert stage.frame_count == 5
    for frame in (1, 3, 5):
        assert np.array_equal(stage.render(frame), pixels(render(stage, "png", "--frame", str(frame))))
    assert rf.animation(stage, fps=25).gif(progress=False) == render(stage, "gif", "--fps", "25")


def test_a_picture_is_an_array_and_a_png(stage):
    picture = stage.render()
    assert (picture.shape, picture.dtype) == ((32, 48, 3), np.uint8)
    assert picture.flags.writeable
    assert np.array_equal(pixels(picture._repr_png_()), picture)
    assert picture[0, 0]._repr_png_() is None
    assert np.array_equal(pixels(stage._repr_png_()), picture)


@pytest.mark.parametrize("samples", [1, 16])
@pytest.mark.parametrize("tone", ["plain", "srgb"])
def test_light_is_the_picture_before_it_is_rounded(stage, samples, tone):
    stage.samples(samples)
    stage.tone(tone)
    stage.sphere(1, (0, 1, 0), diffuse=(0.9, 0.4, 0.1), mirror=0.2)
    light, picture = stage.render(linear=True), stage.render()
    assert (light.shape, light.dtype) == ((32, 48, 3), np.float32)
    shown = light.astype(float)
    if tone == "srgb":
        shown = np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * np.maximum(shown, 1e-9) ** (1 / 2.4) - 0.055)
    assert np.abs(255 * shown - picture).max() <= 1.01
    assert (np.abs(255 * shown - picture) > 0.51).mean() < 0.01
    assert len(np.unique(light)) > len(np.unique(picture))


def test_the_light_of_a_moving_scene_is_that_of_its_exposure(stage):
    stage.samples(64, 0)
    stage.shutter(1)
    stage.sphere(1, (rf.keys({1: -2, 3: 2}), 1, 0), diffuse=1)
    stage.frames(3)
    light, picture = stage.render(2, linear=True), stage.render(2)
    assert np.abs(255 * light - picture).max() <= 0.51
