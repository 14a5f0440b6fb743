"""Texts: letters as solids, with the font of the program or one of the current folder."""

import numpy as np
import pytest

import rayfold as rf


def test_a_text_has_words_a_size_a_depth_and_options(stage):
    stage.text("Hi", 1, 0.2)
    stage.text("two\nlines", 2, 0, "#c04020", align="centre")
    stage.text('say "no"', 1, depth=0.5, mirror=0.5, font="mine.ttf")
    lines = [line for line in str(stage).splitlines() if line.startswith("Text")]
    assert lines == [
        'Text "Hi" 1 0.2',
        'Text "two\\nlines" 2 0 m2 centre',
        'Text "say \\"no\\"" 1 0.5 m3 font "mine.ttf"',
    ]


def test_a_text_is_drawn_as_by_the_command(stage, render):
    from io import BytesIO

    from PIL import Image

    empty = stage.render()
    with stage.group("g"):
        stage.text("o", 2, 0.5, diffuse=0.8)
    stage.use("g", (0, 0, 0), scale=2)
    picture = stage.render()
    assert not np.array_equal(picture, empty)
    drawn = np.asarray(Image.open(BytesIO(render(stage))).convert("RGB"))
    assert np.array_equal(picture, drawn)


def test_what_is_wrong_with_a_text_is_said(stage):
    with pytest.raises(ValueError, match="greater than zero|greater than 0"):
        stage.text("a", 0, 0)
    with pytest.raises(ValueError, match="left, centre, right"):
        stage.text("a", 1, 0, align="center")
    with pytest.raises(ValueError, match="control character U\\+0009"):
        stage.text("a\tb", 1, 0)
    with pytest.raises(TypeError, match="takes no curve"):
        stage.text("a", rf.keys({1: 1, 5: 2}), 0)
    with pytest.raises(TypeError, match="is a str"):
        stage.text(5, 1, 0)
    stage.text("\u65e5", 1, 0)
    with pytest.raises(rf.SceneError, match="has no letter"):
        stage.render()
