"""Animations: drawn ahead, encoded, saved as scripts, shown in a notebook."""

import io
import math
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from PIL import Image

import rayfold as rf


def frame(t):
    scene = rf.Scene(40, 30, background="#102030")
    scene.look(eye=(0, 2, 8), at=(0, 1, 0), fov=34)
    scene.ilight("#ffffff", (1, -1, -0.5))
    scene.sphere(0.8, (3 * math.sin(2 * t), 1, 0), diffuse="#c04020", mirror=0.1)
    return scene


def frames_of(file):
    image = Image.open(io.BytesIO(file))
    for k in range(image.n_frames):
        image.seek(k)
        yield np.asarray(image.convert("RGB"))


@pytest.mark.parametrize("ending", ["gif", "apng", "webp"])
def test_a_function_becomes_the_file_of_the_command(ending, rayfold, tmp_path):
    film = rf.animation(frame, frames=12, fps=20)
    assert len(film) == 12
    out = tmp_path / f"film.{ending}"
    film.save(out, progress=False)
    film.save(f"{tmp_path}/film/")
    by_command = tmp_path / f"command.{ending}"
    subprocess.run([rayfold, "render", str(tmp_path / "film"), "-o", str(by_command), "--quiet"], check=True)
    assert out.read_bytes() == by_command.read_bytes()
    drawn = list(frames_of(out.read_bytes()))
    assert len(drawn) == 12
    if ending != "gif":
        assert all(np.array_equal(a, b) for a, b in zip(drawn, film.frames(progress=False)))


def test_lists_iterators_and_scenes_of_many_frames(stage):
    scenes = [frame(t / 10) for t in range(4)]
    expected = rf.animation(scenes).gif(progress=False)
    assert rf.animation(iter(scenes)).gif(progress=False) == expected
    assert rf.animation((scene for scene in [*scenes, frame(9)]), frames=4).gif(progress=False) == expected
    assert rf.animation(lambda t: frame(t), frames=4, fps=10).gif(progress=False) == expected
    used = rf.animation(iter(scenes))
    list(used.frames(progress=False))
    with pytest.raises(ValueError, match="used up"):
        used.gif(progress=False)
    with pytest.raises(TypeError, match="iterator"):
        len(used)
    with pytest.raises(ValueError, match="frames="):
        rf.animation(iter(scenes)).save("a.apng", progress=False)
    stage.sphere(1, (rf.keys({1: -1, 3: 1}), 1, 0), diffuse=1)
    stage.frames(3)
    both = rf.animation([stage, stage.copy()])
    assert len(both) == 6 and len(list(both.frames(progress=False))) == 6
    assert len(rf.animation([stage, stage], frames=4)) == 4


def test_pictures_and_scripts(tmp_path):
    film = rf.animation(frame, frames=3, fps=12.5, loop=2, bounce=True, durations={2: 0.5})
    film.save(tmp_path / "pictures" / "%03d.png", progress=False)
    assert sorted(os.listdir(tmp_path / "pictures")) == ["001.png", "002.png", "003.png"]
    first = np.asarray(Image.open(tmp_path / "pictures" / "001.png"))
    assert np.array_equal(first, frame(0).render())
    film.save(f"{tmp_path}/film/")
    again = rf.load(tmp_path / "film")
    assert (again.fps, again.loop, again.bounce, again.durations, len(again)) == (12.5, 2, True, {2: 0.5}, 3)
    assert [str(scene) for scene in again] == [str(scene) for scene in film]
    assert again.gif(progress=False) == film.gif(progress=False)
    assert len(list(frames_of(film.gif(progress=False)))) == 4
    (tmp_path / "film" / "other.txt").write_text("Screen 1 1\nTrace\n")
    with pytest.raises(FileExistsError, match="other.txt"):
        film.save(f"{tmp_path}/film/")


def test_a_folder_of_the_command_is_loaded(rayfold, tmp_path):
    from conftest import ROOT

    film = rf.load(ROOT / "scenes" / "hello")
    assert len(film) == 50
    with pytest.raises(OSError):
        rf.load(tmp_path / "none")
    (tmp_path / "a.txt").write_text("Screen 4 3\nSpere\nTrace\n")
    with pytest.raises(rf.SceneError, match="a.txt:2:1"):
        rf.load(tmp_path)


def test_faults_of_frames_are_said_where_they_are():
    with pytest.raises(TypeError, match="frame 1"):
        rf.animation(lambda t: None, frames=3).gif(progress=False)
    sizes = [rf.Scene(8, 6), rf.Scene(8, 7)]
    for scene in sizes:
        scene.sphere(1, (0, 0, -5), ambient=1)
    with pytest.raises(ValueError, match="frame 1 is 8 x 6 and frame 2 is 8 x 7"):
        rf.animation(sizes).gif(progress=False)
    with pytest.raises(ZeroDivisionError):
        rf.animation(lambda t: 1 / 0, frames=3).gif(progress=False)


def test_a_file_appears_whole_or_not_at_all(tmp_path):
    def broken(t):
        if t > 0.3:
            raise ZeroDivisionError
        return frame(t)

    out = tmp_path / "film.gif"
    out.write_bytes(b"before")
    with pytest.raises(ZeroDivisionError):
        rf.animation(broken, frames=9).save(out, progress=False)
    assert out.read_bytes() == b"before" and os.listdir(tmp_path) == ["film.gif"]


def test_a_notebook_shows_it():
    film = rf.animation(frame, frames=2)
    bundle = film._repr_mimebundle_()
    assert bundle["text/html"].startswith('<img src="data:image/gif;base64,R0lGOD')
    assert film._repr_html_() == bundle["text/html"]


def test_anyone_s_frames_become_a_gif(tmp_path):
    grey = [np.full((8, 9), level, np.uint8) for level in (0, 100, 200)]
    assert [int(f[0, 0, 0]) for f in frames_of(rf.gif(grey, fps=25))] == [0, 100, 200]
    light = [np.full((8, 9, 3), level) for level in (0.0, 0.5, 1.0)]
    assert [int(f[0, 0, 0]) for f in frames_of(rf.gif(light))] == [0, 128, 255]
    assert rf.gif(iter(grey), 25, tmp_path / "a.gif") is None
    assert (tmp_path / "a.gif").read_bytes() == rf.gif(grey, fps=25)
    part = np.zeros((20, 20, 3), np.uint8)[::2, 4:, :]
    assert next(frames_of(rf.gif([part]))).shape == (10, 16, 3)


def test_progress_is_shown_by_tqdm():
    tqdm = pytest.importorskip("tqdm.auto", reason="NOT RUN: tqdm is not installed")
    seen = []

    class Bar(tqdm.tqdm):
        def update(self, n=1):
            seen.append((self.n + n, self.total))
            return super().update(n)

    real, tqdm.tqdm = tqdm.tqdm, Bar
    try:
        rf.animation(frame, frames=5).gif()
    finally:
        tqdm.tqdm = real
    assert seen[0] == (0, 5) and seen[-1] == (5, 5)


def test_other_threads_run_while_a_frame_is_drawn():
    scene = rf.Scene(400, 300, samples=(200, 0))
    scene.look((0, 0, 5), (0, 0, 0), 40)
    scene.ilight(1, (0, -1, -1))
    scene.sphere(1, (0, 0, 0), diffuse=0.5, mirror=0.5)
    ticks, stop = [], threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.perf_counter()
    scene.render()
    end = time.perf_counter()
    stop.set()
    thread.join()
    assert sum(start < tick < end for tick in ticks) > 5


SLOW = """
import rayfold as rf, sys
scene = rf.Scene(2000, 2000, samples=(100000, 0))
scene.look((0, 0, 5), (0, 0, 0), 40)
scene.ilight(1, (0, -1, -1))
scene.sphere(1, (0, 0, 0), diffuse=.5, mirror=.5)
print("drawing", flush=True)
try:
    {what}
except KeyboardInterrupt:
    print("interrupted", flush=True)
    sys.exit(7)
"""


@pytest.mark.parametrize("what", ["scene.render()", "rf.animation([scene, scene]).gif(progress=False)"])
def test_ctrl_c_stops_at_once(what):
    process = subprocess.Popen(
        [sys.executable, "-c", SLOW.replace("{what}", what)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "drawing\n"
    time.sleep(0.5)
    start = time.perf_counter()
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=20)
    assert (out, process.returncode) == ("interrupted\n", 7)
    assert time.perf_counter() - start < 5


MEMORY = """
import resource, rayfold as rf
def frame(t):
    scene = rf.Scene(64, 48)
    scene.sphere(9, (20 + t, 20, -20), ambient="#c04020")
    return scene
def used():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
list(rf.animation(frame, frames=300, fps=100).frames(progress=False))[:0]
before = used()
for _ in rf.animation(frame, frames=2000, fps=100).frames(progress=False):
    pass
rf.animation(frame, frames=1000, fps=50).gif(progress=False)
print(used() - before)
"""


def test_memory_does_not_grow_with_the_frames():
    grown = subprocess.run([sys.executable, "-c", MEMORY], capture_output=True, text=True, check=True).stdout
    assert int(grown) < 30_000, f"{grown} KiB"
