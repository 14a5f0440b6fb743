"""Meshes and pictures from arrays: drawn as by the command once they are saved, and faults said at the call."""

import array
import copy
import pickle
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import rayfold as rf

VERTICES = np.array([(-1, 0, 0), (1, 0, 0), (1, 2, 0), (-1, 2, 0), (0, 1, 1)], np.float64)
FACES = np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
NORMALS = VERTICES - (0, 1, -1)
COLORS = np.array([(255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 0), (255, 255, 255)], np.uint8)
UV = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0.5)])
#: A picture of which no part is as another.
PIXELS = np.random.default_rng(5).integers(0, 256, (6, 12, 3), np.uint8)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def drawn_by_command(rayfold, tmp_path):
    """Saves a scene as a script, and returns its picture as the command draws it."""

    def drawn(scene):
        folder = tmp_path / "saved"
        folder.mkdir(exist_ok=True)
        scene.save(folder / "a.txt")
        assert (folder / "a.txt").read_text() == str(scene)
        subprocess.run([rayfold, "render", str(folder / "a.txt"), "-o", "a.png", "--quiet"], check=True)
        return np.asarray(Image.open("a.png"))

    return drawn


def files_of(folder):
    return sorted(path.name for path in folder.iterdir() if path.suffix not in (".txt", ".json"))


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"normals": NORMALS},
        {"colors": COLORS},
        {"colors": COLORS.astype(np.float32) / 255},
        {"colors": COLORS.astype(np.uint16) * 257},
        {"colors": [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 1, 1)]},
        {"colors": np.column_stack([COLORS, np.full(5, 255, np.uint8)])},
        {"colors": COLORS, "own": True, "diffuse": 0.7, "shine": (0.4, 30)},
        {"uv": UV, "image": (PIXELS, "uv"), "diffuse": 1},
        {"normals": NORMALS, "colors": COLORS, "uv": UV, "own": True, "image": (PIXELS[:, :, 0], "uv"), "diffuse": 1},
        {"normals": NORMALS, "flat": True},
        {"smooth": 80, "material": "#c04020"},
    ],
    ids=lambda given: ", ".join(given) or "alone",
)
def test_a_mesh_is_drawn_as_the_command_draws_its_files(stage, drawn_by_command, given):
    empty = stage.render()
    stage.mesh(VERTICES, FACES, **given)
    picture = stage.render()
    assert not np.array_equal(picture, empty)
    assert np.array_equal(picture, drawn_by_command(stage))


def test_colours_are_the_same_in_each_type(stage):
    pictures = []
    for colors in (COLORS, COLORS.astype(np.uint16) * 257, COLORS / 255, (COLORS // 255).tolist()):
        scene = stage.copy()
        scene.mesh(VERTICES, FACES, colors=colors)
        pictures.append(scene.render())
    assert all(np.array_equal(pictures[0], other) for other in pictures[1:])


def test_triangles_written_out_are_the_same_picture(stage):
    """The numbers arrive as they are, and the faces in their order."""
    vertices = VERTICES + np.random.default_rng(3).normal(0, 0.1, VERTICES.shape)
    by_lines, by_arrays = stage.copy(), stage.copy()
    for face in FACES:
        by_lines.triangle(*vertices[face], diffuse="#c04020")
    by_arrays.mesh(vertices, FACES, diffuse="#c04020")
    assert np.array_equal(by_lines.render(), by_arrays.render())


def arrays_of(kind):
    """The same vertices and faces in the many ways in which they come."""
    small = VERTICES.astype(np.float32)
    frozen = VERTICES.copy()
    frozen.flags.writeable = False
    wide = np.zeros((10, 6))
    wide[::2, ::2] = VERTICES
    return {
        "lists": (VERTICES.tolist(), FACES.tolist()),
        "tuples of arrays": (tuple(VERTICES), list(FACES)),
        "float32": (small, FACES.astype(np.int32)),
        "float16": (VERTICES.astype(np.float16), FACES.astype(np.uint8)),
        "long double": (VERTICES.astype(np.longdouble), FACES.astype(np.uint64)),
        "integers": (VERTICES.astype(np.int8), FACES.astype(np.int16)),
        "big endian": (VERTICES.astype(">f8"), FACES.astype(">i4")),
        "big endian, small": (VERTICES.astype(">f4"), FACES.astype(">u2")),
        "columns first": (np.asfortranarray(VERTICES), np.asfortranarray(FACES)),
        "strides": (wide[::2, ::2], np.repeat(FACES, 2, axis=0)[::2]),
        "backwards": (VERTICES[::-1][::-1], FACES[::-1][::-1]),
        "read only": (frozen, FACES),
        "matrix": (np.asmatrix(VERTICES), FACES),
        "masked without gaps": (np.ma.masked_array(VERTICES), FACES),
        "memory": (memoryview(VERTICES), memoryview(FACES)),
        "buffer": (memoryview(array.array("d", VERTICES.ravel())).cast("B").cast("d", (5, 3)), FACES),
    }[kind]


@pytest.mark.parametrize(
    "kind",
    ["lists", "tuples of arrays", "float32", "float16", "long double", "integers", "big endian", "big endian, small",
     "columns first", "strides", "backwards", "read only", "matrix", "masked without gaps", "memory", "buffer"],
)
def test_arrays_of_every_kind_are_the_same_mesh(stage, kind):
    expected, found = stage.copy(), stage.copy()
    expected.mesh(VERTICES, FACES, diffuse=0.5)
    vertices, faces = arrays_of(kind)
    found.mesh(vertices, faces, diffuse=0.5)
    assert np.array_equal(expected.render(), found.render())


def test_quadrilaterals_are_two_triangles_each(stage):
    quad, triangles = stage.copy(), stage.copy()
    corners = [(-1, 0, 0), (1, 0, 0), (1, 2, 0), (-1, 2, 0)]
    quad.mesh(corners, [(0, 1, 2, 3)], diffuse=0.5)
    triangles.mesh(corners, [(0, 1, 2), (0, 2, 3)], diffuse=0.5)
    assert np.array_equal(quad.render(), triangles.render())


@pytest.mark.parametrize(
    "pixels",
    [
        PIXELS,
        PIXELS[:, :, :1],
        PIXELS[:, :, 0],
        np.dstack([PIXELS, PIXELS[:, :, :1]]),
        PIXELS.astype(np.uint16) * 257,
        PIXELS.astype(">u2") * 200,
        PIXELS / 255,
        (PIXELS / 255).astype(np.float32),
        PIXELS[::-1, ::2],
        (PIXELS / 255).tolist(),
        rf.Scene(6, 4, background="#4080c0").render(),
    ],
    ids=["bytes", "one channel", "grey", "alpha", "words", "big endian", "double", "float", "strides", "lists", "picture"],
)
def test_a_picture_is_drawn_as_the_command_draws_its_file(stage, drawn_by_command, pixels):
    empty = stage.render()
    stage.sphere(1, (0, 1, 0), diffuse=0.9, image=(pixels, "ball"))
    stage.box((-3, 0, -2), (3, 2, -1.9), rf.Material(diffuse=1, image=(pixels, "flat", 0.7, "xy")))
    picture = stage.render()
    assert not np.array_equal(picture, empty)
    assert np.array_equal(picture, drawn_by_command(stage))
    assert len(files_of(Path("saved"))) == 1, "two objects share it"


def test_levels_of_a_picture_arrive_as_they_are():
    """A box that shows it in its own light, pixel by pixel."""
    for pixels in (PIXELS, PIXELS / 255):
        scene = rf.Scene(12, 6)
        scene.ilight(1, (0, 0, -1))
        with scene.group("wall"):
            scene.box((0, 0, -2), (12, 6, -1), ambient=1, image=(pixels, "flat", 12))
        # Whole numbers are the middles of pixels.
        scene.use("wall", (-0.5, -0.5, 0))
        assert np.array_equal(scene.render(), PIXELS)


@pytest.mark.parametrize("kind", ["float32", "float64", "uint8", "uint16", "grey"])
def test_a_sky_of_an_array(drawn_by_command, kind):
    light = np.random.default_rng(8).exponential(0.5, (8, 16, 3))
    sky = {
        "float32": light.astype(np.float32), "float64": light, "uint8": (50 * light).clip(0, 255).astype(np.uint8),
        "uint16": (9000 * light).clip(0, 65535).astype(np.uint16), "grey": light[:, :, 0],
    }[kind]
    scene = rf.Scene(40, 30, tone="srgb")
    scene.look((0, 0, 0), (0, 0, -1), 90)
    scene.sky_picture(sky, 1.5, 20)
    scene.ilight(1, (-1, -2, -1))
    scene.sphere(1, (0, 0, -3), mirror=0.9)
    picture = scene.render()
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 20
    assert np.array_equal(picture, drawn_by_command(scene))


def test_light_of_a_sky_arrives_as_it_is():
    sky = np.full((2, 4, 3), (0.25, 0.5, 0.125), np.float32)
    scene = rf.Scene(4, 4)
    scene.sky_picture(sky)
    assert np.array_equal(scene.render(linear=True), np.broadcast_to(sky[0, 0], (4, 4, 3)))


def of_a_mesh(t):
    scene = rf.Scene(40, 30, background="#8cb4e6")
    scene.look((0, 2, 8), (0, 1, 0), 34)
    scene.ilight("#ffffff", (-1, -2, -1))
    with scene.group("fan"):
        scene.mesh(VERTICES, FACES, colors=COLORS)
    scene.use("fan", (t, 0, 0))
    scene.sphere(0.4, (1, 2, -t), image=(PIXELS, "ball"), diffuse=1)
    return scene


def test_frames_share_one_file_and_the_command_draws_the_same(rayfold, tmp_path):
    film = rf.animation(of_a_mesh, frames=4, fps=10)
    film.save("film/")
    files = files_of(tmp_path / "film")
    assert len(files) == 2 and re.fullmatch(r"mesh-[0-9a-f]{20}\.ply", files[0]), files
    assert re.fullmatch(r"picture-[0-9a-f]{20}\.png", files[1])
    subprocess.run([rayfold, "render", "film", "-o", "command.gif", "--quiet"], check=True)
    film.save("python.gif", progress=False)
    assert (tmp_path / "python.gif").read_bytes() == (tmp_path / "command.gif").read_bytes()
    assert rf.load("film").gif(progress=False) == (tmp_path / "python.gif").read_bytes()
    # Saved again, nothing is written anew; a file that was damaged is.
    before = (tmp_path / "film" / files[0]).stat().st_mtime_ns
    (tmp_path / "film" / files[1]).write_bytes(b"")
    film.save("film/")
    assert (tmp_path / "film" / files[0]).stat().st_mtime_ns == before
    assert rf.load("film").gif(progress=False) == (tmp_path / "python.gif").read_bytes()


def test_names_depend_on_the_content_alone():
    def named(vertices):
        scene = rf.Scene(8, 6)
        scene.mesh(vertices, FACES)
        return re.search('"(.*)"', str(scene))[1]

    assert named(VERTICES) == named(VERTICES.tolist()) == named(np.asfortranarray(VERTICES))
    assert named(VERTICES) != named(VERTICES + 1e-9)
    assert named(VERTICES) == "mesh-be07ee94fd72c24aaaf9.ply"


def test_text_copies_and_pickles_draw_the_same(stage):
    stage.mesh(VERTICES, FACES, image=(PIXELS, "ball"), diffuse=1)
    picture = stage.render()
    for other in (rf.parse(str(stage)), stage.copy(), copy.deepcopy(stage), pickle.loads(pickle.dumps(stage))):
        assert str(other) == str(stage)
        assert np.array_equal(other.render(), picture)
        # What it names can be added to, and goes with it.
        other.sphere(0.1, (0, 0, 0), diffuse=1)
        assert len(other._files()[2]) == 2


def test_a_pickle_is_read_by_another_process(stage, tmp_path):
    stage.mesh(VERTICES, FACES, diffuse=1)
    (tmp_path / "scene").write_bytes(pickle.dumps(stage))
    code = "import pickle, sys; pickle.load(open('scene', 'rb')).save('b.png')"
    subprocess.run([sys.executable, "-c", code], check=True)
    assert np.array_equal(np.asarray(Image.open("b.png")), stage.render())


def test_a_pickle_whose_content_is_another_is_refused(stage):
    from rayfold import _rayfold

    stage.mesh(VERTICES, FACES, diffuse=1)
    make, (name, content) = stage._given[0].__reduce__()
    assert make(name, content).name == name
    for other in (name.replace("mesh", "../mesh"), "mesh-0.ply", "a.txt"):
        with pytest.raises(ValueError, match="another content"):
            _rayfold.Given(other, content)
    with pytest.raises(ValueError, match="another content"):
        make(name, content + b" ")


def test_a_text_whose_file_is_nowhere_is_an_error():
    with pytest.raises(rf.SceneError, match="there is no file `mesh-0123456789abcdef0123.ply`"):
        rf.parse('Mesh "mesh-0123456789abcdef0123.ply"\nTrace\n')


def test_a_file_of_the_folder_comes_before_one_in_memory(tmp_path):
    """A folder is drawn as it stands, also by the process that has written it."""
    film = rf.animation(of_a_mesh, frames=2, fps=10)
    film.save("film/")
    ours = film.gif(progress=False)
    (mesh,) = (tmp_path / "film").glob("mesh-*")
    mesh.write_bytes(b"ply\nformat ascii 1.0\nelement vertex 3\nproperty int x\nproperty int y\nproperty int z\n"
                     b"element face 1\nproperty list int int vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    assert rf.load("film").gif(progress=False) != ours
    assert film.gif(progress=False) == ours


def test_files_on_disk_and_in_memory_go_together(stage, drawn_by_command, tmp_path):
    (tmp_path / "corner.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    stage.mesh("corner.obj", diffuse="#20c040")
    stage.mesh(VERTICES, FACES, diffuse="#c04020")
    assert np.array_equal(stage.render(), drawn_by_command(stage))
    assert "corner.obj" in files_of(tmp_path / "saved") and len(files_of(tmp_path / "saved")) == 2


def test_a_material_with_an_array_is_for_any_scene(stage):
    material = rf.Material(name="globe", diffuse=1, image=(PIXELS, "ball"))
    pictures = []
    for scene in (stage.copy(), stage.copy()):
        scene.sphere(1, (0, 1, 0), material)
        pictures.append(scene.render())
    other = stage.copy()
    other.material("globe", diffuse=1, image=(PIXELS, "ball"))
    other.sphere(1, (0, 1, 0), "globe")
    assert np.array_equal(pictures[0], pictures[1]) and np.array_equal(pictures[0], other.render())


def test_arrays_may_change_after_the_call(stage):
    vertices = VERTICES.copy()
    stage.mesh(vertices, FACES, diffuse=1)
    before = stage.render()
    vertices += 5
    assert np.array_equal(stage.copy().render(), before)


def test_what_no_scene_has_is_freed():
    from rayfold import _rayfold

    rng = np.random.default_rng(1)
    names = []
    for _ in range(20):
        scene = rf.Scene(8, 6)
        scene.ilight(1, (-1, -2, -1))
        scene.mesh(rng.normal(size=(3, 3)), [(0, 1, 2)], diffuse=1)
        scene.render()
        names.append(scene._given[0].name)
    # Some of the latest stay.
    alive = [name for name in names if rf.parse(f'Screen 8 6\n# "{name}"\nTrace\n')._given]
    assert alive == names[-8:]
    assert _rayfold.Given is type(scene._given[0])


def test_a_scene_has_as_many_files_as_a_script():
    scene = rf.Scene(8, 6)
    scene.ilight(1, (-1, -2, -1))
    for k in range(64):
        scene.mesh(VERTICES + k, FACES)
    scene.mesh(VERTICES, FACES)
    with pytest.raises(ValueError, match=r"mesh\(\): file: a scene has at most 64 meshes"):
        scene.mesh(VERTICES - 1, FACES)
    with pytest.raises(ValueError, match=r"sphere\(\): image: a scene has at most 64 meshes and pictures"):
        scene.sphere(1, (0, 0, 0), image=(PIXELS, "ball"))
    scene.render()


#: What is wrong, as functions, and words of the answer.
FAULTS = [
    (lambda s: s.mesh(VERTICES), TypeError, "mesh() lacks faces: an array of three indices"),
    (lambda s: s.mesh(faces=FACES), TypeError, "mesh() lacks vertices"),
    (lambda s: s.mesh(VERTICES, None), TypeError, "lacks faces"),
    (lambda s: s.mesh("a.obj", faces=FACES), TypeError, "either file, or vertices and faces"),
    (lambda s: s.mesh(VERTICES, FACES, file="a.obj"), TypeError, "either file, or vertices and faces"),
    (lambda s: s.mesh(VERTICES, FACES, vertices=VERTICES), TypeError, "two values for vertices"),
    (lambda s: s.mesh(VERTICES, FACES, None, None, None, None, None, None, 1), TypeError, "takes 8 arguments at most, not 9"),
    (lambda s: s.mesh(VERTICES, FACES, radius=2), TypeError, "no parameter \"radius\""),
    (lambda s: s.mesh(VERTICES, FACES, smooth=200), ValueError, "from 0 to 180"),
    (lambda s: s.mesh(5, FACES), TypeError, "vertices is an array of (x, y, z), not 5"),
    (lambda s: s.mesh(VERTICES[:0], FACES), ValueError, "vertices is empty"),
    (lambda s: s.mesh([], FACES), ValueError, "vertices is empty"),
    (lambda s: s.mesh(VERTICES.ravel(), FACES), ValueError, "vertices has the shape (15,): expected (n, 3)"),
    (lambda s: s.mesh(VERTICES[None], FACES), ValueError, "vertices has the shape (1, 5, 3)"),
    (lambda s: s.mesh(VERTICES[:, :2], FACES), ValueError, "vertices has the shape (5, 2)"),
    (lambda s: s.mesh([(0, 0, 0), (1, 0), (0, 1, 0)], FACES), ValueError, "vertices[1] is (1, 0), but row 0 has 3 numbers"),
    (lambda s: s.mesh([(0, 0, 0), (1, 0, None), (0, 1, 0)], FACES), TypeError, "vertices[1, 2] is None"),
    (lambda s: s.mesh([("0", "0", "0")] * 3, FACES), TypeError, "vertices has the type <U1"),
    (lambda s: s.mesh(range(10**9), FACES), TypeError, "vertices[0] is 0"),
    (lambda s: s.mesh(VERTICES.astype(complex), FACES), TypeError, "vertices has the type complex128"),
    (lambda s: s.mesh(VERTICES > 0, FACES), TypeError, "vertices has the type bool"),
    (lambda s: s.mesh(VERTICES.astype(object), FACES), TypeError, "vertices has the type object"),
    (lambda s: s.mesh(np.where(VERTICES == 2, np.nan, VERTICES), FACES), ValueError, "vertices[2] is (1.0, nan, 0.0): expected finite"),
    (lambda s: s.mesh(np.where(VERTICES == 2, np.inf, VERTICES), FACES), ValueError, "vertices[2] is (1.0, inf, 0.0)"),
    (lambda s: s.mesh([(10**400, 0, 0)] * 3, FACES), TypeError, "vertices"),
    (lambda s: s.mesh(np.ma.masked_less(VERTICES, -0.5), FACES), ValueError, "vertices[0] is masked"),
    (lambda s: s.mesh(np.broadcast_to(np.zeros(3), (10**9, 3)), FACES), ValueError, "1000000000 rows: expected at most 30000000"),
    (lambda s: s.mesh(np.broadcast_to(0.0, (12_000_000, 3)), FACES), ValueError, "at most 256 MiB"),
    (lambda s: s.mesh(VERTICES, FACES[:0]), ValueError, "faces is empty"),
    (lambda s: s.mesh(VERTICES, []), ValueError, "faces is empty"),
    (lambda s: s.mesh(VERTICES, FACES.ravel()), ValueError, "faces has the shape (12,): expected (n, 3) or (n, 4)"),
    (lambda s: s.mesh(VERTICES, FACES.astype(float)), TypeError, "faces has the type float64: expected integers"),
    (lambda s: s.mesh(VERTICES, FACES > 0), TypeError, "faces has the type bool"),
    (lambda s: s.mesh(VERTICES, FACES + 1), ValueError, "faces[0] is (1, 2, 5): expected indices from 0 to 4, for 5 vertices"),
    (lambda s: s.mesh(VERTICES, FACES - 1), ValueError, "faces[0] is (-1, 0, 3): expected indices from 0 to 4"),
    (lambda s: s.mesh(VERTICES, [(0, 1, 2), (0, 1, 2**40)]), ValueError, "faces[1] is (0, 1, 1099511627776)"),
    (lambda s: s.mesh(VERTICES, [(0, 1, 2), (0, 1, 2**70)]), (TypeError, ValueError), "faces"),
    (lambda s: s.mesh(VERTICES, np.broadcast_to(0, (10**9, 3))), ValueError, "faces has 1000000000 rows"),
    (lambda s: s.mesh(VERTICES, np.broadcast_to(0, (6_000_000, 4))), ValueError, "twice as many triangles"),
    (lambda s: s.mesh(VERTICES, [(0, 0, 1)] * 9000), ValueError, "none of the 9000 faces has an area"),
    (lambda s: s.mesh([(0, 0, 0), (1, 1, 1), (3, 3, 3)], [(0, 1, 2)]), ValueError, "has an area"),
    (lambda s: s.mesh(VERTICES, FACES, NORMALS[:4]), ValueError, "normals has 4 rows: expected 5, one for each vertex"),
    (lambda s: s.mesh(VERTICES, FACES, NORMALS * 1e300), ValueError, "expected finite numbers of 32 bits"),
    (lambda s: s.mesh(VERTICES, FACES, normals="#c04020"), TypeError, "normals is an array"),
    (lambda s: s.mesh(VERTICES, FACES, colors="#c04020"), TypeError, "colors is an array of (red, green, blue), not '#c04020'"),
    (lambda s: s.mesh(VERTICES, FACES, colors=FACES), ValueError, "colors has 4 rows: expected 5"),
    (lambda s: s.mesh(VERTICES, FACES, colors=COLORS / 100), ValueError, "colors[0] is (2.55, 0.0, 0.0): expected channels from 0 to 1"),
    (lambda s: s.mesh(VERTICES, FACES, colors=COLORS.astype(int)), ValueError, "of the type int64: expected uint8"),
    (lambda s: s.mesh(VERTICES, FACES, colors=np.full((5, 3), np.nan)), ValueError, "colors[0] is (nan, nan, nan)"),
    (lambda s: s.mesh(VERTICES, FACES, colors=np.full((5, 4), 0.5)), ValueError, "colors[0] has the alpha 0.5: expected 1"),
    (lambda s: s.mesh(VERTICES, FACES, uv=VERTICES), ValueError, "uv has the shape (5, 3): expected (n, 2)"),
    (lambda s: s.mesh(VERTICES, FACES, uv=UV * np.nan), ValueError, "uv[0] is (nan, nan)"),
    (lambda s: s.sphere(1, (0, 0, 0), image=(PIXELS.astype(int), "ball")), TypeError, "image has the type int64: expected uint8"),
    (lambda s: s.sphere(1, (0, 0, 0), image=(PIXELS[:, :, :2], "ball")), ValueError, "image has the shape (6, 12, 2)"),
    (lambda s: s.sphere(1, (0, 0, 0), image=(PIXELS[0, 0], "ball")), ValueError, "image has the shape (3,)"),
    (lambda s: s.sphere(1, (0, 0, 0), image=(PIXELS[:0], "ball")), ValueError, "image has the shape (0, 12, 3)"),
    (lambda s: s.sphere(1, (0, 0, 0), image=(PIXELS / 100, "ball")), ValueError, "image[0, "),
    (lambda s: s.sphere(1, (0, 0, 0), image=(np.broadcast_to(np.uint8(0), (10**5, 10**5)), "ball")), ValueError, "pixels: expected at most"),
    (lambda s: s.sphere(1, (0, 0, 0), image=(5, "ball")), TypeError, "image takes a tuple"),
    (lambda s: s.sphere(1, (0, 0, 0), image=(PIXELS, "box")), TypeError, "image takes a tuple"),
    (lambda s: s.sphere(1, (0, 0, 0), image=PIXELS), TypeError, "image takes a tuple"),
    (lambda s: s.sky_picture(PIXELS / -255.0), ValueError, "expected finite light from 0"),
    (lambda s: s.sky_picture(PIXELS * np.nan), ValueError, "sky_picture(): file[0, 0] is (nan, nan, nan)"),
    (lambda s: s.sky_picture(PIXELS.astype(str)), TypeError, "file has the type <U3"),
    (lambda s: s.sky_picture(np.broadcast_to(np.float32(0), (5000, 5000, 3))), ValueError, "at most 256 MiB"),
    (lambda s: s.sky_picture(5), TypeError, "file is a str"),
]


@pytest.mark.parametrize("case", range(len(FAULTS)), ids=lambda case: FAULTS[case][2][:40])
def test_what_is_wrong_is_said_at_the_call(stage, case):
    call, error, words = FAULTS[case]
    before = str(stage)
    with pytest.raises(error, match=re.escape(words)) as raised:
        call(stage)
    assert len(str(raised.value)) < 400
    assert str(stage) == before
