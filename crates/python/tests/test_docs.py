"""The examples and the pages do what they say, and their types are right."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import rayfold as rf

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))


def module(path):
    names = {"__name__": path.stem}
    exec(compile(path.read_text(), path, "exec"), names)
    return names


def scenes(names):
    """The scene of an example, with few samples, and frames to look at."""
    if "table" in names:
        return names["table"](samples=2), [1, 24]
    if "molecule" in names:
        return names["molecule"](samples=2), [1, 30]
    if "chart" in names:
        return names["chart"](samples=2), [1, 60]
    if "terrain" in names:
        return names["terrain"](names["heights"](20), samples=2), [1]
    return names["frame"](3.0, samples=2), [1]


def test_there_are_five():
    assert len(EXAMPLES) == 5


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_draws_a_picture(path):
    scene, frames = scenes(module(path))
    drawn = [scene.render(frame) for frame in frames]
    for picture in drawn:
        assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 200, "there is something to see"
    if len(drawn) > 1:
        assert not np.array_equal(*drawn), "it moves"


def test_an_example_is_run_as_a_script(tmp_path):
    path = next(path for path in EXAMPLES if path.stem == "height_map")
    subprocess.run([sys.executable, str(path), str(tmp_path / "a.png")], check=True)
    assert Image.open(tmp_path / "a.png").size == (400, 260)


@pytest.mark.parametrize("page", ["docs/python.md", "docs/tutorial.md", "crates/python/README.md"])
def test_what_a_page_shows_is_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / page).read_text()
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
    blocks += [block.replace("\n    ", "\n") for block in re.findall(r"^    (import rayfold.*?)\n\n(?! )", text, re.M | re.S)]
    assert blocks, "the page shows nothing"
    for block in blocks:
        # The pages show many frames with many rays; a few say whether they are right.
        exec(compile(block.replace("samples=(16, 1)", "samples=2"), page, "exec"), {"__name__": "page"})


def test_the_tutorial_s_animation_is_that_of_its_folder(tmp_path, monkeypatch, rayfold):
    monkeypatch.chdir(tmp_path)
    block = re.search(r"^```python\n(.*?)^```", (ROOT / "docs/tutorial.md").read_text(), re.M | re.S)[1]
    exec(compile(block, "tutorial", "exec"), {})
    subprocess.run([rayfold, "render", "bounce", "-o", "command.gif", "--quiet"], check=True)
    assert Path("command.gif").read_bytes() == Path("bounce.gif").read_bytes()
    assert len(rf.load("bounce")) == 40
