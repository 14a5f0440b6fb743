"""Meshes: the models of files, beside a script or in the current folder."""

import numpy as np
import pytest

import rayfold as rf

CORNER = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\nf 1 4 2\n"


@pytest.fixture(autouse=True)
def corner(tmp_path, monkeypatch):
    """The current folder has a model."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "corner.obj").write_text(CORNER)


def test_a_mesh_has_a_material_numbers_or_the_colours_of_its_file(stage):
    stage.mesh("corner.obj")
    stage.mesh("corner.obj", rf.Material(diffuse="#c04020"))
    stage.mesh("corner.obj", "#c04020", smooth=40)
    stage.mesh("corner.obj", mirror=0.5, flat=True)
    lines = [line for line in str(stage).splitlines() if line.startswith("Mesh")]
    assert lines == [
        'Mesh "corner.obj"',
        'Mesh "corner.obj" m2',
        'Mesh "corner.obj" m2 smooth 40',
        'Mesh "corner.obj" m3 flat',
    ]
    assert [d for d in stage.check() if d.severity == "error"] == []


def test_a_mesh_is_drawn_as_by_the_command(stage, render):
    from io import BytesIO

    from PIL import Image

    empty = stage.render()
    with stage.group("g"):
        stage.mesh("corner.obj", own=True, diffuse=1)
    stage.use("g", (0, 1, 0), scale=2)
    picture = stage.render()
    assert not np.array_equal(picture, empty)
    drawn = np.asarray(Image.open(BytesIO(render(stage))).convert("RGB"))
    assert np.array_equal(picture, drawn)


def test_scripts_are_saved_with_their_files(stage, tmp_path):
    stage.mesh("corner.obj")
    stage.frames(2)
    rf.animation(stage, fps=5).save("film/")
    assert (tmp_path / "film" / "corner.obj").read_text() == CORNER
    (tmp_path / "corner.obj").unlink()
    loaded = rf.load("film")
    assert np.array_equal(loaded[0].render(), rf.load("film/0001.txt")[0].render())
    (tmp_path / "copy").mkdir()
    loaded[0].save(tmp_path / "copy" / "a.txt")
    assert (tmp_path / "copy" / "corner.obj").read_text() == CORNER


def test_what_is_wrong_with_a_mesh_is_said(stage):
    with pytest.raises(ValueError, match="in the script's own folder"):
        stage.mesh("models/corner.obj")
    with pytest.raises(ValueError, match="from 0 to 180"):
        stage.mesh("corner.obj", smooth=181)
    with pytest.raises(TypeError, match="degrees"):
        stage.mesh("corner.obj", smooth="much")
    with pytest.raises(TypeError, match="either smooth or flat"):
        stage.mesh("corner.obj", smooth=3, flat=True)
    stage.mesh("none.obj")
    with pytest.raises(rf.SceneError, match="there is no file `none.obj`"):
        stage.render()
