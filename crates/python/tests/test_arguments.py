"""A wrong argument is answered at the call, with the parameter's name and range."""

import math
import warnings

import numpy as np
import pytest

import rayfold as rf


@pytest.fixture
def scene():
    return rf.Scene(8, 6)


@pytest.mark.parametrize(
    "call, error, words",
    [
        (lambda s: s.sphere(-1, (0, 0, 0), diffuse=1), ValueError, ["sphere(radius=-1)", "at least 0"]),
        (lambda s: s.sphere("1", (0, 0, 0), diffuse=1), TypeError, ["sphere(): radius", "a number", "'1'"]),
        (lambda s: s.sphere(None, (0, 0, 0), diffuse=1), TypeError, ["sphere()", "radius"]),
        (lambda s: s.sphere(1, (0, 0), diffuse=1), TypeError, ["sphere(): center", "3 numbers", "(0, 0)"]),
        (lambda s: s.sphere(1, (0, 0, 0, 0), diffuse=1), TypeError, ["center", "3 numbers"]),
        (lambda s: s.sphere(1, "abc", diffuse=1), TypeError, ["center", "3 numbers"]),
        (lambda s: s.sphere(1, 5, diffuse=1), TypeError, ["center", "3 numbers"]),
        (lambda s: s.sphere(1, (0, "0", 0), diffuse=1), TypeError, ["center"]),
        (lambda s: s.sphere(math.nan, (0, 0, 0), diffuse=1), ValueError, ["radius", "finite"]),
        (lambda s: s.sphere(1, (0, math.inf, 0), diffuse=1), ValueError, ["center", "finite"]),
        (lambda s: s.sphere(1), TypeError, ["sphere() lacks center"]),
        (lambda s: s.sphere(1, (0, 0, 0)), TypeError, ["sphere() lacks a material"]),
        (lambda s: s.sphere(1, (0, 0, 0), 5), TypeError, ["sphere(): material", "5"]),
        (lambda s: s.sphere(1, (0, 0, 0), "red"), ValueError, ["no material has the name", "red"]),
        (lambda s: s.sphere(1, (0, 0, 0), "#12345"), ValueError, ["#c04020"]),
        (lambda s: s.sphere(1, (0, 0, 0), "#gggggg"), ValueError, ["#c04020"]),
        (lambda s: s.sphere(1, (0, 0, 0), diffuse="red"), ValueError, ["diffuse", "#c04020"]),
        (lambda s: s.sphere(1, (0, 0, 0), rf.Material(), 7), TypeError, ["3 arguments at most"]),
        (lambda s: s.sphere(1, (0, 0, 0), radus=1), TypeError, ["no parameter", "radus", "diffuse"]),
        (lambda s: s.sphere(1, (0, 0, 0), radius=2, diffuse=1), TypeError, ["two values for radius"]),
        (lambda s: s.sphere(1, (0, 0, 0), rf.Material(), diffuse=1), TypeError, ["either `material` or"]),
        (lambda s: s.sphere(1, (0, 0, 0), glass=1.5), TypeError, ["glass", "(color, ior)"]),
        (lambda s: s.sphere(1, (0, 0, 0), glass=(1, -1)), ValueError, ["glass", "ior=-1"]),
        (lambda s: s.sphere(1, (0, 0, 0), shine=(1, 0.5)), ValueError, ["exponent=0.5", "at least 1"]),
        (lambda s: s.sphere(1, (0, 0, 0), checker=(1, 5)), TypeError, ["checker", "other material"]),
        (lambda s: s.sphere(1, (0, 0, 0), checker=(1, "nix")), ValueError, ["nix"]),
        (lambda s: s.look((0, 0, 0), (0, 0, 0), 40), ValueError, ["look(", "must differ"]),
        (lambda s: s.look((0, 0, 1), (0, 0, 0), 180), ValueError, ["fov=180", "above 0 and below 180"]),
        (lambda s: s.look((0, 0, 1), (0, 0, 0), 40, (0, 0, 1)), ValueError, ["parallel"]),
        (lambda s: s.look(eye=(0, 0, 1), at=(0, 0, 0), fov=40, eey=1), TypeError, ["eey", "eye, at, fov, up"]),
        (lambda s: s.samples(0), ValueError, ["samples(n=0)", "whole"]),
        (lambda s: s.samples(1.5), ValueError, ["samples(n=1.5)"]),
        (lambda s: s.samples(4, -1), ValueError, ["error=-1"]),
        (lambda s: s.samples(rf.keys({1: 1, 2: 2})), TypeError, ["samples(): n", "takes no curve"]),
        (lambda s: s.tone("linear"), ValueError, ['"plain" or "srgb"']),
        (lambda s: s.tone(1), TypeError, ['"plain" or "srgb"']),
        (lambda s: s.depth(65), ValueError, ["bounces=65"]),
        (lambda s: s.shutter(1.5), ValueError, ["open=1.5", "from 0 to 1"]),
        (lambda s: s.fog("nun"), TypeError, ["fog() lacks distance"]),
        (lambda s: s.fog("#ffffff", 0), ValueError, ["distance=0"]),
        (lambda s: s.frames(7, 3), ValueError, ["a=7", "b=3"]),
        (lambda s: s.torus(1, 2, (0, 0, 0), (0, 1, 0), diffuse=1), ValueError, ["thickness"]),
        (lambda s: s.cylinder(1, (0, 0, 0), (0, 0, 0), diffuse=1), ValueError, ["differ"]),
        (lambda s: s.sphere(rf.keys({1: 1, 2: -1}), (0, 0, 0), diffuse=1), None, []),
        (lambda s: s.sphere(rf.keys({1: -1, 2: 1}), (0, 0, 0), diffuse=1), ValueError, ["radius=-1"]),
        (lambda s: s.material("1a", diffuse=1), ValueError, ["a name is made of letters", "1a"]),
        (lambda s: s.material(5, diffuse=1), TypeError, ["a str"]),
        (lambda s: s.group("a b"), ValueError, ["a name is made of letters"]),
        (lambda s: s.use("leg"), ValueError, ["no group has the name", "leg"]),
        (lambda s: s.end(), ValueError, ["no group is open"]),
        (lambda s: rf.Scene(0, 5), ValueError, ["width=0"]),
        (lambda s: rf.Scene(5), TypeError, ["screen() lacks height"]),
        (lambda s: rf.Scene(5, 5, sphere=1), TypeError, ["no parameter 'sphere'", "background"]),
        (lambda s: rf.Material(colour=1), TypeError, ["colour", "ambient, diffuse"]),
        (lambda s: rf.Material(1), TypeError, []),
        (lambda s: rf.Material(checker=(1, "a"), stripes=(1, "b")), TypeError, ["one pattern"]),
        (lambda s: rf.keys({}), ValueError, ["at least one key"]),
        (lambda s: rf.keys({1: 0, 2: (1, 2)}), ValueError, ["as many numbers in each"]),
        (lambda s: rf.keys({1: 0, 2: 1}, "smoth"), ValueError, ['"smooth"', "smoth"]),
        (lambda s: rf.keys({1: 0}, cycle=True), ValueError, ["at least two keys"]),
        (lambda s: rf.keys({1: 0, 2: 1}, ("bezier", 2, 0, 0, 0)), ValueError, ["from 0 to 1"]),
        (lambda s: rf.keys({"a": 0}), TypeError, ["a frame is a number"]),
        (lambda s: rf.animation(lambda t: s), TypeError, ["needs frames"]),
        (lambda s: rf.animation([s, 5]), TypeError, ["expected a Scene"]),
        (lambda s: rf.animation("abc"), TypeError, ["abc"]),
        (lambda s: rf.animation([s], frames=0), ValueError, ["from 1"]),
        (lambda s: rf.animation([s], fps=0), ValueError, ["fps"]),
        (lambda s: rf.animation([s], loop=-2), ValueError, ["loop"]),
        (lambda s: rf.animation([s]).save("a.mp4"), ValueError, [".gif"]),
        (lambda s: rf.animation([s]).save("a.png"), ValueError, ["%04d"]),
        (lambda s: rf.gif([]), ValueError, ["at least one frame"]),
        (lambda s: rf.gif([np.zeros((4, 4, 2), np.uint8)]), ValueError, ["frame 1", "(4, 4, 2)"]),
        (lambda s: rf.gif([np.zeros((4, 4, 3), np.int64)]), TypeError, ["int64", "uint8"]),
        (lambda s: rf.gif([np.zeros((4, 4), np.uint8), np.zeros((5, 4), np.uint8)]), ValueError, ["frame 2"]),
        (lambda s: rf.gif([np.zeros((4, 4), np.uint8)], fps=0), ValueError, ["fps"]),
        (lambda s: rf.linear("red"), ValueError, ["red"]),
        (lambda s: s.render(0), ValueError, ["from 1"]),
        (lambda s: s.render(2), IndexError, ["frame is from 1 to 1"]),
        (lambda s: s.save("a.jpg"), ValueError, [".png"]),
    ],
)
def test_it_is_refused_in_python_s_terms(scene, call, error, words):
    before = str(scene)
    if error is None:
        call(scene)
        return
    with pytest.raises(error) as caught:
        call(scene)
    assert type(caught.value) is error
    for word in words:
        assert word in str(caught.value)
    assert str(scene) == before, "nothing is added by a call that fails"


def test_values_may_be_of_any_kind_of_number():
    def script(*values):
        scene = rf.Scene(8, 6)
        scene.sphere(*values, diffuse=1)
        return str(scene)

    expected = script(1.5, (1.0, 2.0, -0.5))
    for radius in (np.float64(1.5), np.float32(1.5), np.array(1.5)):
        assert script(radius, (1, 2, -0.5)) == expected
    for center in ([1, 2, -0.5], np.array([1, 2, -0.5]), np.array([1, 2, -0.5], np.float32), iter([1, 2, -0.5])):
        assert script(1.5, center) == expected


def test_colours_may_be_written_in_each_way():
    def script(color):
        scene = rf.Scene(8, 6)
        scene.background(color)
        return str(scene)

    assert script(0.5) == script([0.5, 0.5, 0.5])
    assert script("#ff8000").splitlines()[1] == "Background #ff8000"
    assert script("#FF8000").splitlines()[1] == "Background #FF8000"
    pictures = []
    for color in ("#ff8000", "#FF8000", (1, 128 / 255, 0)):
        scene = rf.Scene(8, 6, background=color)
        pictures.append(scene.render().tobytes())
    assert len(set(pictures)) == 1
    assert rf.linear("#ff8000")[0] == 1
    assert rf.linear("#000a80")[1] < 0.0031308


def test_a_colour_looks_the_same_under_both_tones():
    def levels(tone):
        scene = rf.Scene(8, 6, tone=tone, background="#6fa0d8")
        return scene.render()[0, 0].tolist()

    assert levels("plain") == levels("srgb") == [0x6F, 0xA0, 0xD8]


def test_a_colour_that_cannot_stand_as_a_text_is_refused():
    scene = rf.Scene(8, 6)
    scene.background("#ffffff", "#6fa0d8")
    scene.background("#ffffff", (0, 0.5, 1))
    assert str(scene).splitlines()[1:3] == ["Background #ffffff #6fa0d8", "Background #ffffff 0 0.5 1"]
    # In the script it would begin a comment; as numbers it would mean something else under `Tone srgb`.
    with pytest.raises(ValueError, match=r"background\(\): top.*give both as texts"):
        scene.background(1, "#6fa0d8")
    red = rf.Material(diffuse="#c04020", shine=("#ffffff", 60))
    scene.sphere(1, (0, 0, -5), red)
    assert "Material m1 diffuse #c04020 shine #ffffff 60" in str(scene)


def test_numbers_are_kept_bit_for_bit():
    values = [0.1, -0.0, 1e-320, 1.7976931348623157e308, 1 / 3, 123456789.0, 1e15 + 0.5, 1e16, 2.5e-5, -7.0]
    for value in values:
        scene = rf.Scene(8, 6)
        scene.plane((value, 0, 0), (0, 1, 0), diffuse=1)
        written = float(next(line for line in str(scene).splitlines() if line.startswith("Plane")).split()[1])
        assert math.copysign(1, written) == math.copysign(1, value) and written == value


def test_errors_of_a_script_have_their_places():
    with pytest.raises(rf.SceneError) as caught:
        rf.parse("Screen 4 3\nSpere 1 0 0 0 1 1 1 1 1 1\nSphere -1 0 0 0 1 1 1 1 1 1\nTrace\n", "film.txt")
    first, second = caught.value.diagnostics
    assert (first.line, first.column, first.span, first.code) == (2, 1, (11, 16), "unknown-command")
    assert first.help == "did you mean `Sphere`?" and first.severity == "error" and first.file == "film.txt"
    assert (second.line, second.code) == (3, "invalid-value")
    assert "film.txt:2:1" in str(caught.value) and "film.txt:3:8" in str(caught.value)
    assert isinstance(caught.value, ValueError)


def test_what_depends_on_all_frames_is_a_scene_error_when_it_is_drawn(scene):
    scene.sphere(rf.keys({1: 1, 3: -1}), (0, 0, -5), diffuse=1)
    scene.frames(3)
    with pytest.raises(rf.SceneError) as caught:
        scene.render()
    assert "radius" in str(caught.value)
    scene = rf.Scene()
    scene.sphere(1, (0, 0, 0), ambient=1)
    with pytest.raises(rf.SceneError, match="Screen"):
        scene.render()


def test_a_warning_is_one_of_python(scene):
    scene.sphere(1, (0, 0, -5), diffuse=1)
    with pytest.warns(rf.SceneWarning):
        scene.render()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(rf.SceneWarning):
            rf.parse(str(scene) + "# again")
