"""Every command is a method and every clause a keyword, as the table of the language says."""

import inspect
import itertools
import pathlib
import re

import pytest

import rayfold as rf
from rayfold import _rayfold

METHODS = {
    name: (_rayfold.method_doc(index), parameters, clauses)
    for index, (name, parameters, clauses) in enumerate(_rayfold.methods())
}
CLAUSES = dict(_rayfold.clauses())


def usage(doc):
    """The names of the numbers in the syntax that a docstring shows."""
    syntax = re.search(r"In a script: `(.*?)( or \w+)?`", doc)[1].replace(" or flat]", "]").replace(" or centre or right]", "]")
    return syntax.replace("[", "").replace("]", "").split()


def numbers(step, first):
    values = itertools.count()
    return lambda: round(first + step * next(values), 6)


def arguments(parameters, doc, next_number):
    """A value for each parameter, by its type in the docstring."""
    values = {}
    for name, _, count in parameters:
        kind = re.search(rf"^{name} : (.*?)(, optional)?$", doc, re.M)[1]
        if name == "material":
            values[name] = rf.Material(diffuse=0.5)
        elif words := re.findall(r'"(.*?)"', kind):
            values[name] = words[-1]
        elif kind.split(" | ")[0] == "str":
            values[name] = "thing"
        elif kind == "bool":
            values[name] = False
        elif kind == "int":
            values[name] = max(int(next_number()), 1)
        else:
            values[name] = tuple(next_number() for _ in range(count)) if count > 1 else next_number()
    return values


def attempts(parameters, doc):
    """Arguments of which some are valid, whatever is to be greater than what."""
    for step, first in [(1, 1), (-1, 40), (0.01, 0.1), (0.7, 2.3), (1, -5)]:
        yield arguments(parameters, doc, numbers(step, first))


def surroundings(name):
    """A scene in which a command may stand, and what comes after it."""
    scene = rf.Scene(8, 6)
    if name in ("use", "end"):
        scene.group("thing")
        scene.sphere(1, (0, 0, -5), diffuse=1)
    if name == "use":
        scene.end()
    return scene


@pytest.mark.parametrize("name", METHODS)
def test_every_command_is_reached_with_all_its_parameters(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "thing").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    doc, parameters, _ = METHODS[name]
    refused = []
    for values in attempts(parameters, doc):
        scene = surroundings(name)
        try:
            getattr(scene, name)(**values, **({"diffuse": 1} if name == "material" else {}))
            if name == "group":
                scene.end()
        except ValueError as error:
            refused.append(str(error))
            continue
        # The file is a model, and neither a font nor a picture.
        errors = [d for d in scene.check() if d.severity == "error" and not re.search("no (font|picture)", d.message)]
        if not errors:
            break
        refused.extend(map(str, errors))
    else:
        pytest.fail(f"no arguments reach {name}: {refused}")
    command = usage(doc)[0]
    line = next(line for line in str(scene).splitlines() if line.startswith(command))
    written = len(line.split()) - 1
    surface = [word for word in usage(doc) if word in ("ar", "ag", "ab", "rr", "rg", "rb", "sr", "sg", "sb")]
    expected = len(usage(doc)) - 1 - max(len(surface) - 1, 0)
    assert written == expected + (name == "material") * 4, line


@pytest.mark.parametrize("name", CLAUSES)
def test_every_clause_is_reached(name, tmp_path, monkeypatch):
    if name == "image":
        monkeypatch.chdir(tmp_path)
        pixel = pathlib.Path(__file__).parents[2] / "scene/tests/pixel.png"
        (tmp_path / "pixel.png").write_bytes(pixel.read_bytes())
        scene = rf.Scene(8, 6)
        scene.sphere(1, (0, 0, -5), image=("pixel.png", "ball"))
        assert [d for d in scene.check() if d.severity == "error"] == []
        assert ' image "pixel.png" ball' in str(scene)
        return
    entries = CLAUSES[name]
    refused = []
    for step, first in [(1, 1), (-1, 40), (0.01, 0.1)]:
        next_number = numbers(step, first)
        values = [rf.Material(diffuse=0.5) if entry == "other" else next_number() for entry in entries]
        value = True if not entries else values[0] if len(entries) == 1 else tuple(values)
        for make in (lambda clauses: clauses, lambda clauses: {"material": rf.Material(**clauses)}):
            scene = rf.Scene(8, 6)
            try:
                scene.sphere(1, (0, 0, -5), **make({name: value}))
            except ValueError as error:
                refused.append(str(error))
                break
            errors = [d for d in scene.check() if d.severity == "error"]
            if errors:
                refused.extend(map(str, errors))
                break
            assert f" {name} " in str(scene).replace("\n", " "), str(scene)
        else:
            return
    pytest.fail(f"no value reaches {name}: {refused}")


@pytest.mark.parametrize("name", METHODS)
def test_names_are_those_of_python(name):
    _, parameters, clauses = METHODS[name]
    signature = inspect.signature(getattr(rf.Scene, name))
    names = [parameter for parameter, *_ in parameters] + (list(CLAUSES) if clauses else [])
    assert list(signature.parameters) == ["self", *names]
    assert all(name.isidentifier() for name in names)
    assert len(set(names)) == len(names)
    assert getattr(rf.Scene, name).__doc__.startswith(METHODS[name][0][:20])


def test_the_types_are_those_of_the_table():
    from pathlib import Path

    stub = Path(rf.__file__).with_name("__init__.pyi").read_text()
    assert stub == _rayfold.stub(), "python -m rayfold.stub writes the types anew"


def test_what_the_package_has_is_what_its_types_say():
    import ast
    from pathlib import Path

    tree = ast.parse(Path(rf.__file__).with_name("__init__.pyi").read_text())
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            of = getattr(rf, node.name)
            for member in node.body:
                if isinstance(member, ast.FunctionDef):
                    assert hasattr(of, member.name), f"{node.name}.{member.name}"
        elif isinstance(node, ast.FunctionDef):
            assert callable(getattr(rf, node.name)), node.name
    listed = {node.name for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    assert set(rf.__all__) - {"__version__"} == listed


def test_docstrings_have_units_ranges_and_defaults():
    assert "length in world units, at least 0" in rf.Scene.sphere.__doc__
    assert "by default 0" in rf.Scene.ilight.__doc__
    assert "whole, from 1" in rf.Scene.samples.__doc__
    assert "the index of refraction" in rf.Material.__doc__
    assert "smooth" in rf.keys.__doc__
