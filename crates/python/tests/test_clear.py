"""Scenes without background: arrays with alpha, and animations of them."""

import io
import warnings

import numpy as np
import pytest
from PIL import Image, ImageSequence

import rayfold as rf


def ball(x=0.0, background="none"):
    scene = rf.Scene(48, 32, background=background, samples=16)
    scene.look(eye=(0, 2, 8), at=(0, 1, 0), fov=34)
    scene.ilight("#fff8e0", (-1, -2, -1))
    scene.sphere(1, (x, 1, 0), diffuse="#c04020")
    return scene


def opened(file):
    return Image.open(io.BytesIO(file))


def frames_of(file):
    return [np.asarray(frame.convert("RGBA")) for frame in ImageSequence.Iterator(opened(file))]


def saved(animation, ending, folder):
    path = folder / f"saved.{ending}"
    animation.save(path, progress=False)
    return path.read_bytes()


def test_a_picture_has_alpha_and_is_the_command_s(render, tmp_path):
    scene = ball()
    picture = scene.render()
    assert (picture.shape, picture.dtype) == ((32, 48, 4), np.uint8)
    file = opened(render(scene))
    assert file.mode == "RGBA" and np.array_equal(np.asarray(file), picture)
    assert (picture[0, 0] == 0).all() and picture[16, 24, 3] == 255
    scene.save(tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes() == render(scene)
    assert opened(picture._repr_png_()).mode == "RGBA"
    scene.background("#000000")
    assert scene.render().shape == (32, 48, 3)


def test_light_is_premultiplied(tmp_path):
    light, picture = ball().render(linear=True), ball().render()
    assert (light.shape, light.dtype) == ((32, 48, 4), np.float32)
    assert (light[..., :3].max(axis=2) <= light[..., 3] + 1e-6).all()
    saved = np.asarray(opened(light.png()))
    assert np.abs(saved.astype(int) - picture).max() <= 1


@pytest.mark.parametrize("ending", ["gif", "apng", "webp"])
def test_animations_are_the_command_s(ending, render, tmp_path):
    scene = ball(rf.keys({1: -1, 4: 1}))
    scene.frames(4)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rf.SceneWarning)
        file = saved(rf.animation(scene, fps=10), ending, tmp_path)
    assert file == render(scene, ending)
    assert all((frame[0, 0] == 0).all() for frame in frames_of(file))


def test_frames_with_and_without_a_background(tmp_path):
    scenes = [ball(-0.5, "#102030"), ball(0.5)]
    for ending in ("gif", "apng", "webp"):
        first, second = frames_of(saved(rf.animation(scenes), ending, tmp_path))
        assert (first[..., 3] == 255).all() and second[0, 0, 3] == 0
    # Of an iterator the second is not known when the file begins.
    with pytest.raises(ValueError, match="frame 2 has no background, but frame 1 has one"):
        rf.animation(iter(scenes)).save(tmp_path / "a.webp", progress=False)


def test_anyone_s_arrays_may_have_alpha():
    frames = []
    for x in (5, 15):
        frame = np.zeros((32, 48, 4), np.uint8)
        frame[8:24, x : x + 16] = (200, 60, 20, 255)
        frames.append(frame)
    shown = frames_of(rf.gif(frames))
    assert all(np.array_equal(seen, frame) for seen, frame in zip(shown, frames))
    with pytest.raises(ValueError, match="expected"):
        rf.gif([np.zeros((4, 4, 2), np.uint8)])
