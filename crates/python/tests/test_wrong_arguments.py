"""Wrong arguments of every kind, in the place of each parameter: an error in Python's terms that names the parameter, or a
scene that is right. Never a panic, and nothing is added by a call that fails."""

import datetime
import decimal
import fractions
import inspect
import itertools
import math
import random
import re
import warnings

import numpy as np
import pytest

import rayfold as rf
from random_scenes import seed
from rayfold import _rayfold
from test_language import CLAUSES, METHODS, attempts, surroundings


class Hostile:
    """Fails whatever it is asked for, also for its text."""

    def __float__(self):
        raise ZeroDivisionError("float")

    def __index__(self):
        raise ZeroDivisionError("index")

    def __repr__(self):
        raise ZeroDivisionError("repr")

    def __str__(self):
        raise ZeroDivisionError("str")


class Halfway(list):
    """A list whose length is not that of its items."""

    def __len__(self):
        return 3


#: The values as functions, since an iterator is used up.
WRONG = {
    "none": lambda: None,
    "true": lambda: True,
    "zero": lambda: 0,
    "minus": lambda: -1,
    "one and a half": lambda: 1.5,
    "nan": lambda: math.nan,
    "inf": lambda: math.inf,
    "minus inf": lambda: -math.inf,
    "largest": lambda: 1.7976931348623157e308,
    "smallest": lambda: 5e-324,
    "huge": lambda: 10**400,
    "minus huge": lambda: -(10**400),
    "64 bits": lambda: 2**64,
    "complex": lambda: 1j,
    "decimal": lambda: decimal.Decimal("sNaN"),
    "fraction": lambda: fractions.Fraction(10**400, 3),
    "empty text": lambda: "",
    "text": lambda: "abc",
    "number as text": lambda: "1",
    "colour": lambda: "#c04020",
    "half a colour": lambda: "#c0402",
    "long colour": lambda: "#c040201",
    "no colour": lambda: "#gggggg",
    "comment": lambda: "# a",
    "line": lambda: "a\nTrace",
    "zero byte": lambda: "a\0b",
    "surrogate": lambda: "\ud800",
    "wide text": lambda: "é" * 3,
    "long text": lambda: "x" * 100_000,
    "bytes": lambda: b"abc",
    "bytearray": lambda: bytearray(b"abc"),
    "memory": lambda: memoryview(b"abc"),
    "empty tuple": lambda: (),
    "two": lambda: (1, 2),
    "three": lambda: (1, 2, 3),
    "four": lambda: (1, 2, 3, 4),
    "zeros": lambda: (0, 0, 0),
    "texts": lambda: ("1", "2", "3"),
    "nans": lambda: (math.nan, 0, 0),
    "huges": lambda: (10**400, 0, 0),
    "nones": lambda: (None, None, None),
    "nested": lambda: ((1, 2, 3), (1, 2, 3), (1, 2, 3)),
    "list": lambda: [1, 2],
    "halfway": lambda: Halfway([1]),
    "dict": lambda: {1: 1, 2: 2, 3: 3},
    "empty dict": lambda: {},
    "set": lambda: {1, 2, 3},
    "frozen set": lambda: frozenset((1, 2, 3)),
    "range": lambda: range(10**9),
    "endless": lambda: itertools.count(),
    "array of nan": lambda: np.full(3, np.nan),
    "array of two": lambda: np.zeros(2),
    "array of rows": lambda: np.zeros((3, 3)),
    "array of nothing": lambda: np.zeros(0),
    "array of texts": lambda: np.array(["a", "b", "c"]),
    "array of objects": lambda: np.array([None, None, None]),
    "array of complex": lambda: np.array([1j, 0, 0]),
    "scalar array": lambda: np.array(np.nan),
    "array of ones": lambda: np.ones(3, np.int64),
    "array of bools": lambda: np.ones((3, 3), bool),
    "array of bytes": lambda: np.zeros((2, 2, 3), np.uint8),
    "array of levels": lambda: np.full((4, 4), 0.5),
    "array of two channels": lambda: np.zeros((2, 2, 2), np.uint8),
    "array of four dimensions": lambda: np.zeros((1, 2, 2, 3), np.uint8),
    "array of negatives": lambda: np.full((3, 3), -1),
    "array of large": lambda: np.full((3, 3), 2**62),
    "array of huge rows": lambda: np.broadcast_to(0.5, (10**9, 3)),
    "array of huge pixels": lambda: np.broadcast_to(np.uint8(1), (10**5, 10**5)),
    "array of no rows": lambda: np.zeros((0, 3)),
    "array of no columns": lambda: np.zeros((3, 0)),
    "array of gaps": lambda: np.ma.masked_array(np.ones((3, 3)), np.eye(3)),
    "array of fields": lambda: np.zeros(3, [("x", "f4"), ("y", "f4")]),
    "array of dates": lambda: np.zeros((3, 3), "datetime64[s]"),
    "array of rows of objects": lambda: np.array([[1, None, 2]] * 3, object),
    "array of big endian nans": lambda: np.full((3, 3), np.nan, ">f8"),
    "array of strides": lambda: np.ones((9, 9))[::3, ::3],
    "read only": lambda: np.frombuffer(bytes(72)).reshape(3, 3),
    "ragged": lambda: [(1, 2, 3), (1, 2), (1,)],
    "rows of texts": lambda: [("a", "b", "c")] * 3,
    "rows of nones": lambda: [(None, None, None)] * 3,
    "rows of hostiles": lambda: [(Hostile(), 0, 0)] * 3,
    "date": lambda: datetime.date(2026, 1, 1),
    "date of numpy": lambda: np.datetime64("2026-01-01"),
    "function": lambda: len,
    "class": lambda: int,
    "object": lambda: object(),
    "hostile": Hostile,
    "hostiles": lambda: (Hostile(), 0, 0),
    "material": lambda: rf.Material(diffuse=1),
    "unfit material": lambda: rf.Material(glass=(1, 1.5)),
    "curve": lambda: rf.keys({1: -1e300, 2: 1e300}),
    "curves": lambda: rf.keys({1: (-1, -1, -1), 2: (1, 1, 1)}),
    "scene": lambda: rf.Scene(8, 6),
    "ellipsis": lambda: ...,
}
ANSWERS = (TypeError, ValueError, IndexError)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """The current folder, with a model of the name that a right argument has."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "thing").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")


# Where one parameter bounds another, the message is about the one that is bounded.
BOUNDED = {("roundbox", "u"): "radius", ("roundbox", "v"): "radius"}


def is_named(message, call, parameter):
    """Whether a message says the function and the parameter."""
    bounded = BOUNDED.get((call, parameter))
    if bounded and is_named(message, call, bounded):
        return True
    return re.search(rf"\b{re.escape(parameter)}\b", message) and re.search(rf"\b{re.escape(call)}\b", message)


def check_answer(action, call, parameter, about):
    """Does something with a wrong argument. Returns whether it was refused, rightly."""
    try:
        action()
    except (rf.SceneError, OSError):
        # The text of a script has errors of its own, and so have files.
        return True
    except ANSWERS as error:
        message = str(error)
        assert is_named(message, call, parameter), f"{about}: {type(error).__name__}: {message}"
        assert len(message) < 1000, f"{about}: {message}"
        return True
    except Exception as error:
        # An object's own exception is its user's.
        assert isinstance(error, ZeroDivisionError), f"{about}: {type(error).__name__}: {error}"
        return True
    except BaseException as error:
        pytest.fail(f"{about}: a panic crosses: {error}")
    return False


def base_arguments(name):
    """Arguments of a command that are right."""
    doc, parameters, _ = METHODS[name]
    for values in attempts(parameters, doc):
        scene = surroundings(name)
        try:
            getattr(scene, name)(**values, **({"diffuse": 1} if name == "material" else {}))
        except ValueError:
            continue
        return values
    pytest.fail(f"no arguments reach {name}")


def check_scene(scene, before, refused, about):
    if refused:
        assert str(scene) == before, f"{about}: nothing is added by a call that fails"
        return
    errors = [d for d in scene.check() if d.severity == "error"]
    # What is open, in a file or of many frames is known at the drawing alone: groups, models and curves.
    late = [d for d in errors if not re.search("group|file|no font|no picture", d.message, re.I) and "(" not in about]
    assert not late, f"{about}: accepted, but {late[0]}"


@pytest.mark.parametrize("name", [name for name in METHODS if METHODS[name][1]])
def test_wrong_arguments_of_commands(name):
    values = base_arguments(name)
    word = {"diffuse": 1} if name == "material" else {}
    for parameter, (kind, make) in itertools.product(values, WRONG.items()):
        scene = surroundings(name)
        before = str(scene)
        given = {**values, parameter: make()}
        about = f"{name}({parameter}={kind})"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            refused = check_answer(lambda: getattr(scene, name)(**given, **word), name, parameter, about)
            check_scene(scene, before, refused, f"{name} {parameter} {kind}" + "(" * ("curve" in kind))


@pytest.mark.parametrize("name", CLAUSES)
def test_wrong_values_of_clauses(name):
    entries = CLAUSES[name]
    right = [rf.Material(diffuse=0.5) if entry == "other" else index + 1.5 for index, entry in enumerate(entries)]
    wrong = [(kind, make) for kind, make in WRONG.items() if kind != "none"]
    cases = [(f"{kind}", make) for kind, make in wrong]
    if len(entries) > 1:
        for place, (kind, make) in itertools.product(range(len(entries)), WRONG.items()):
            cases.append((f"{place} {kind}", lambda place=place, make=make: (*right[:place], make(), *right[place + 1 :])))
    for kind, make in cases:
        about = f"{name}={kind}"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for call in ("sphere", "Material", "material"):
                scene = rf.Scene(8, 6)
                before = str(scene)
                value = make()
                action = {
                    "sphere": lambda: scene.sphere(1, (0, 0, -5), **{name: value}),
                    "Material": lambda: scene.sphere(1, (0, 0, -5), rf.Material(**{name: value})),
                    "material": lambda: scene.material("a", **{name: value}),
                }[call]
                # A name that is not there yet is refused by the scene, which an object adds it to.
                refused = check_answer(action, "", name, f"{call} {about}")
                check_scene(scene, before, refused, about + "(" * ("curve" in kind))


#: A mesh of arrays that are right.
MESH = {
    "vertices": np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0)]),
    "faces": np.array([(0, 1, 2)]),
    "normals": np.ones((3, 3)),
    "colors": np.ones((3, 3)),
    "uv": np.zeros((3, 2)),
}


@pytest.mark.parametrize("parameter", MESH)
def test_wrong_arrays_of_a_mesh(parameter):
    for (kind, make), in_order in itertools.product(WRONG.items(), (False, True)):
        scene = rf.Scene(8, 6)
        before = str(scene)
        given = {**MESH, parameter: make()}
        about = f"mesh({parameter}={kind})"
        if in_order and parameter == "vertices" and (given[parameter] is None or isinstance(given[parameter], (str, bytes))):
            # That is a file.
            continue
        action = (lambda: scene.mesh(*given.values())) if in_order else (lambda: scene.mesh(**given))
        refused = check_answer(action, "mesh", parameter, about)
        check_scene(scene, before, refused, about.replace("(", " "))


def test_wrong_pictures():
    for (kind, make), map in itertools.product(WRONG.items(), ("ball", "flat")):
        scene = rf.Scene(8, 6)
        before = str(scene)
        image = (make(), map) if map == "ball" else (make(), map, 1.5, "xz")
        about = f"image={kind}, {map}"
        refused = check_answer(lambda: scene.sphere(1, (0, 0, -5), image=image, diffuse=1), "sphere", "image", about)
        check_scene(scene, before, refused, about)


def test_random_combinations_of_wrong_arrays():
    from_seed = seed()
    dice = random.Random(from_seed)
    kinds = list(WRONG.items())
    for k in range(2000):
        scene = rf.Scene(8, 6)
        before = str(scene)
        given = dict(MESH)
        for parameter in dice.sample(list(MESH), dice.randint(1, 3)):
            given[parameter] = dice.choice(kinds)[1]()
        about = f"RAYFOLD_SEED={from_seed}, call {k}"
        try:
            scene.mesh(**given)
        except (TypeError, ValueError, ZeroDivisionError):
            assert str(scene) == before, about
        except BaseException as error:
            pytest.fail(f"{about}: {type(error).__name__}: {error}")
        else:
            assert not [d for d in scene.check() if d.severity == "error"], about


def film():
    scene = rf.Scene(8, 6)
    scene.sphere(9, (0, 0, -20), ambient=1)
    return rf.animation([scene, scene.copy()])


def picture():
    return rf.Scene(8, 6, background=1).render()


#: The package's own functions, with the arguments that are right.
CALLS = {
    "Scene": (lambda: rf.Scene, {"width": 8, "height": 6}, {"width": "screen", "height": "screen"}),
    "Material": (lambda: rf.Material, {"name": "a", "diffuse": 1}, {}),
    "keys": (lambda: rf.keys, {"keys": {1: 0, 2: 1}, "mode": "linear", "cycle": False}, {}),
    "linear": (lambda: rf.linear, {"color": "#c04020"}, {}),
    "parse": (lambda: rf.parse, {"text": "Screen 8 6\nTrace\n", "name": "a"}, {}),
    "load": (lambda: rf.load, {"path": "none"}, {}),
    "animation": (
        lambda: rf.animation,
        {"scenes": film()[0], "frames": 1, "fps": 10, "loop": 0, "bounce": False, "durations": None}, {},
    ),
    "gif": (
        lambda: rf.gif,
        {"images": [np.zeros((4, 4), np.uint8)], "fps": 10, "path": None, "loop": 0, "exact": False}, {},
    ),
    "render": (lambda: rf.Scene(8, 6, background=1).render, {"frame": 1, "linear": False}, {}),
    "save": (lambda: rf.Scene(8, 6, background=1).save, {"path": "a.png", "frame": 1}, {}),
    "Animation.frames": (lambda: film().frames, {"progress": False, "linear": False}, {}),
    "Animation.gif": (lambda: film().gif, {"progress": False, "exact": False}, {}),
    "Animation.save": (lambda: film().save, {"path": "a.gif", "progress": False, "exact": False}, {}),
    "Animation.submit": (
        lambda: film().submit,
        {"address": "s3://films/wave", "path": None, "delete": False, "wait": False, "progress": False}, {},
    ),
    "Picture.save": (lambda: picture().save, {"path": "b.png"}, {}),
    "Curve.at": (lambda: rf.keys({1: 0, 2: 1}).at, {"frame": 1.5}, {}),
}


@pytest.mark.parametrize("name", CALLS)
def test_wrong_arguments_of_functions(name, monkeypatch):
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    for key in ("AWS_REGION", "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
        monkeypatch.setenv(key, "us-east-1")
    make_function, right, others = CALLS[name]
    for parameter, (kind, make) in itertools.product(right, WRONG.items()):
        if name == "Animation.submit" and parameter != "address" and kind in ("true", "none"):
            # These are right, and the store's answer would be waited for.
            continue
        call = others.get(parameter, name.split(".")[-1])
        about = f"{name}({parameter}={kind})"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            function = make_function()
            value = make()
            check_answer(lambda: function(**{**right, parameter: value}), call, parameter, about)


def test_every_parameter_of_the_package_is_tried():
    tried = {(name.split(".")[-1], parameter) for name, (_, right, _) in CALLS.items() for parameter in right}
    for name in rf.__all__:
        function = getattr(rf, name)
        if inspect.isfunction(function):
            for parameter in inspect.signature(function).parameters:
                assert (name, parameter) in tried, f"{name}({parameter})"
    for owner in (rf.Scene, rf.Animation, rf.Picture):
        for name, function in vars(owner).items():
            if name.startswith("_") or not inspect.isfunction(function) or owner is rf.Scene and name in METHODS:
                continue
            for parameter in list(inspect.signature(function).parameters)[1:]:
                assert (name, parameter) in tried, f"{owner.__name__}.{name}({parameter})"


def test_random_combinations_of_wrong_arguments():
    from_seed = seed()
    dice = random.Random(from_seed)
    kinds, names = list(WRONG.items()), [name for name in METHODS if METHODS[name][1]]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for k in range(3000):
            name = dice.choice(names)
            scene = surroundings(name)
            before = str(scene)
            given = {}
            chosen = []
            for parameter, *_ in METHODS[name][1]:
                kind, make = dice.choice(kinds)
                given[parameter] = make()
                chosen.append(f"{parameter}={kind}")
            if METHODS[name][2] and dice.random() < 0.3:
                kind, make = dice.choice(kinds)
                clause = dice.choice(list(CLAUSES))
                given[clause] = make()
                chosen.append(f"{clause}={kind}")
            about = f"RAYFOLD_SEED={from_seed}, call {k}: {name}({', '.join(chosen)})"
            try:
                getattr(scene, name)(**given)
            except (TypeError, ValueError, ZeroDivisionError):
                assert str(scene) == before, about
            except BaseException as error:
                pytest.fail(f"{about}: {type(error).__name__}: {error}")


def test_settings_of_a_scene_are_refused_by_name():
    for name, (kind, make) in itertools.product(sorted(_rayfold.settings()), WRONG.items()):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            check_answer(lambda: rf.Scene(8, 6, **{name: make()}), "", name, f"Scene({name}={kind})")
