"""What Python draws is what `rayfold render` draws of the same text, bit for bit."""

import io
import warnings

import numpy as np
import pytest
from PIL import Image

import random_scenes
import rayfold as rf

def pixels(file):
    return np.asarray(Image.open(io.BytesIO(file)).convert("RGB"))


def test_random_scenes_are_those_of_their_texts(rayfold):
    # `python crates/python/bench random` compares any number of them.
    seed = random_scenes.seed()
    print(f"RAYFOLD_SEED={seed}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rf.SceneWarning)
        assert random_scenes.compare(1000, seed, rayfold) >= 1000


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
    brighter = picture - 255 * shown
    # The curve darkens the means of few samples, so the picture is raised where samples differ. The light is not.
    raised = tone == "srgb" and samples > 1
    assert brighter.min() >= -1.01 and brighter.max() <= (4 if raised else 1.01)
    assert (np.abs(brighter) > 0.51).mean() < (0.1 if raised else 0.01)
    assert len(np.unique(light)) > len(np.unique(picture))


def test_the_light_of_a_moving_scene_is_that_of_its_exposure(stage):
    stage.samples(64, 0)
    stage.shutter(1)
    stage.sphere(1, (rf.keys({1: -2, 3: 2}), 1, 0), diffuse=1)
    stage.frames(3)
    light, picture = stage.render(2, linear=True), stage.render(2)
    assert np.abs(255 * light - picture).max() <= 0.51
