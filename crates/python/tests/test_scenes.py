"""Scenes as scripts: materials, groups, copies, and the way back from a text."""

import copy
import pickle

import numpy as np
import pytest

import rayfold as rf

TEXT = """# A ball.
Screen 24 16
Background .1 .2 .3
Material m1 ambient 1 0 0
Sphere 4 12 8 -9 m1
Trace
"""


def test_a_material_is_defined_where_it_is_used_first():
    scene = rf.Scene(8, 6)
    red = rf.Material(diffuse="#ff0000")
    board = rf.Material(diffuse=1, checker=(0.5, red))
    for x in range(3):
        scene.sphere(1, (x, 0, 0), red)
    scene.sphere(1, (9, 0, 0), board)
    scene.sphere(1, (10, 0, 0), diffuse="#ff0000")
    scene.sphere(1, (11, 0, 0), "#ff0000")
    assert str(scene).splitlines() == [
        "Screen 8 6",
        "Material m1 diffuse #ff0000",
        "Sphere 1 0 0 0 m1",
        "Sphere 1 1 0 0 m1",
        "Sphere 1 2 0 0 m1",
        "Material m2 diffuse 1 1 1 checker 0.5 m1",
        "Sphere 1 9 0 0 m2",
        "Sphere 1 10 0 0 m1",
        "Sphere 1 11 0 0 m1",
        "Trace",
    ]


def test_a_name_of_its_own_is_used_once():
    scene = rf.Scene(8, 6)
    red = scene.material("red", diffuse="#ff0000")
    assert red.name == "red"
    scene.sphere(1, (0, 0, 0), red)
    scene.sphere(1, (0, 0, 0), "red")
    scene.sphere(1, (0, 0, 0), rf.Material(name="red", diffuse="#ff0000"))
    assert str(scene).count("Material") == 1
    with pytest.raises(ValueError, match="another material with the name"):
        scene.sphere(1, (0, 0, 0), rf.Material(name="red", diffuse="#00ff00"))
    with pytest.raises(ValueError, match="already"):
        scene.material("red", diffuse=1)


def test_materials_of_a_group_are_defined_before_it():
    scene = rf.Scene(8, 6)
    with scene.group("stool") as group:
        assert group is scene
        scene.cylinder(0.5, (0, 0, 0), (0, 1, 0), diffuse="#804020")
        scene.sphere(1, (0, 1, 0), diffuse="#402010")
    scene.use("stool", (1, 0, 0), scale=0.5)
    lines = str(scene).splitlines()
    assert [line.split()[0] for line in lines] == (
        "Screen Material Material Group Cylinder Sphere End Use Trace".split()
    )
    assert lines[-2] == "Use stool 1 0 0 0 0 0 0.5"
    assert not [d for d in scene.check() if d.severity == "error"]
    with pytest.raises(ZeroDivisionError), scene.group("other"):
        raise ZeroDivisionError
    with pytest.raises(ValueError, match="a group is open"):
        scene.group("third")


def test_settings_may_be_keywords():
    scene = rf.Scene(
        8, 6, samples=(64, 1), background=(0.1, 0.2, 0.3), tone="srgb", lens={"radius": 0.1}, ilight=(1, (0, -1, 0)),
        look=((0, 0, 5), (0, 0, 0), 40), shutter=None,
    )
    assert str(scene).splitlines() == [
        "Screen 8 6", "Samples 64 1", "Background 0.1 0.2 0.3", "Tone srgb", "Lens 0.1", "Ilight 1 1 1 0 -1 0",
        "Look 0 0 5 0 0 0 40", "Trace",
    ]


def test_a_text_is_kept_as_it_is_and_continued():
    scene = rf.parse(TEXT)
    assert str(scene) == TEXT
    before = scene.render()
    scene.sphere(3, (3, 3, -5), ambient="#00ff00")
    assert str(scene) == TEXT.replace("Trace\n", "Material m2 ambient #00ff00\nSphere 3 3 3 -5 m2\nTrace\n")
    assert not np.array_equal(scene.render(), before)
    scene.sphere(1, (20, 3, -5), "m1")
    assert scene.frame_count == 1


def test_several_frames_are_kept():
    scene = rf.Scene(8, 6)
    scene.sphere(1, (1, 1, -5), ambient=1)
    scene.trace()
    scene.clear()
    scene.trace()
    assert scene.frame_count == 2 and str(scene).count("Trace") == 2
    assert scene.render(1).max() == 255 and scene.render(2).max() == 0


def test_copies_go_their_own_ways(stage):
    other, pickled, deep = stage.copy(), pickle.loads(pickle.dumps(stage)), copy.deepcopy(stage)
    before = str(stage)
    other.sphere(1, (0, 1, 0), diffuse=1)
    assert str(stage) == str(pickled) == str(deep) == before != str(other)


def test_a_word_may_stand_in_place_of_all_arguments():
    scene = rf.Scene(8, 6)
    scene.fog("#ffffff", 10)
    scene.fog("none")
    assert str(scene) == "Screen 8 6\nFog #ffffff 10\nFog none\nTrace\n"


def test_curves_are_written_and_evaluated():
    curve = rf.keys({25: 3, 1: 0}, "smooth")
    assert str(curve) == "(smooth 1:0 25:3)" and curve.at(13) == 1.5
    assert str(rf.keys({1: 0, 9: 1}, ("bezier", 0.2, 0, 0.4, 1), cycle=True)).startswith("(bezier 0.2 0 0.4 1 cycle 1:0")
    x, y, z = rf.keys({1: (0, 1, 2), 5: np.array([3, 4, 5])})
    assert str(z) == "(1:2 5:5)"
    scene = rf.Scene(8, 6)
    scene.sphere(rf.keys({1: 1, 25: 3}, "smooth"), (x, y, z), ambient=rf.keys({1: "#000000", 5: "#ffffff"}))
    assert "Sphere (smooth 1:1 25:3) (1:0 5:3) (1:1 5:4) (1:2 5:5)" in str(scene)
