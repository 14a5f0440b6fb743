"""Animations in a bucket: the store that is built in and the local invoker, as `rayfold dev` runs them."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import rayfold as rf
from test_animations import frame


@pytest.fixture(scope="module")
def environment(rayfold, tmp_path_factory):
    """What `rayfold dev` says that other programs must know, while it runs."""
    data = tmp_path_factory.mktemp("dev")
    here = {**os.environ, "RAYFOLD_MAX_PIXELS": "4000"}
    if (Path(rayfold).parent / "rayfold-render").exists():
        # Those that were built with the command, whatever has changed since.
        here.setdefault("RAYFOLD_FUNCTIONS", str(Path(rayfold).parent))
    log = (data / "log").open("w")
    process = subprocess.Popen(
        [rayfold, "dev", "--data", str(data / "data"), "--address", "127.0.0.1:0"],
        stdout=subprocess.PIPE, stderr=log, text=True, env=here,
    )
    try:
        settings = {}
        for line in process.stdout:
            if setting := re.match(r"export (\w+)=(.*)", line):
                settings[setting[1]] = setting[2]
            elif line.startswith("aws s3"):
                break
        if not settings:
            process.wait(timeout=20)
            said = (data / "log").read_text()
            if "renderer alone" in said:
                pytest.skip("NOT RUN: animations in a bucket: the command rayfold has no network: cargo build -p rayfold")
            pytest.fail(f"rayfold dev has not started: {said}")
        yield settings
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(timeout=30)
        except subprocess.TimeoutExpired:
            process.kill()
        log.close()


@pytest.fixture
def bucket(environment, monkeypatch):
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    return "s3://rayfold"


def film(frames=6, **settings):
    return rf.animation(frame, frames=frames, fps=20, **settings)


def test_the_gif_of_a_bucket_is_the_one_that_is_drawn_here(bucket, tmp_path):
    moving = film(bounce=True, durations={2: 0.4}, loop=3)
    expected = moving.gif(progress=False)
    assert moving.submit(f"{bucket}/wave", progress=False) == expected
    out = tmp_path / "wave.gif"
    assert moving.submit(f"{bucket}/shots/wave/", out, progress=False) is None
    assert out.read_bytes() == expected
    for output in ["webp", "apng"]:
        out, here = tmp_path / f"wave.{output}", tmp_path / f"here.{output}"
        moving.save(here, progress=False)
        assert moving.submit(f"{bucket}/wave", out, progress=False) is None
        assert out.read_bytes() == here.read_bytes()
    # Only the settings are uploaded again, and the command knows it.
    assert moving.submit(f"{bucket}/wave", progress=False) == expected


def test_the_files_that_scenes_name_go_with_them(bucket, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "corner.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")

    def of_a_model(t):
        scene = frame(t)
        scene.mesh("corner.obj", diffuse=(0.2 + 0.1 * t, 0.5, 0.3))
        return scene

    moving = rf.animation(of_a_model, frames=3, fps=20)
    assert moving.submit(f"{bucket}/model", progress=False) == moving.gif(progress=False)
    (tmp_path / "corner.obj").write_text("v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n")
    assert moving.submit(f"{bucket}/model", progress=False) == moving.gif(progress=False)


def test_meshes_and_pictures_from_arrays_go_with_them(bucket, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    pixels = np.random.default_rng(2).integers(0, 256, (4, 8, 3), np.uint8)

    def of_arrays(t):
        scene = frame(t)
        scene.mesh([(0, 0, 0), (1, 0, 0), (0, 1 + t, 0)], [(0, 1, 2)], diffuse="#c04020")
        scene.sphere(0.5, (1, 1, 0), diffuse=1, image=(pixels, "ball"))
        return scene

    moving = rf.animation(of_arrays, frames=3, fps=20)
    assert moving.submit(f"{bucket}/arrays", progress=False) == moving.gif(progress=False)
    assert list(tmp_path.iterdir()) == []
    # What is saved is what was sent.
    moving.save("arrays/")
    assert rf.load("arrays").submit(f"{bucket}/arrays", progress=False) == moving.gif(progress=False)


def test_the_command_goes_on_with_what_python_has_sent(bucket, rayfold, tmp_path):
    moving = film(7)
    assert moving.submit(f"{bucket}/sent", wait=False, progress=False) is None
    moving.save(f"{tmp_path}/sent/")
    out = tmp_path / "sent.gif"
    command = [rayfold, "submit", str(tmp_path / "sent"), "--bucket", "rayfold", "-o", str(out)]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stderr
    assert "up to date" in said
    assert out.read_bytes() == moving.gif(progress=False)


def test_scripts_of_others_are_deleted_only_if_asked(bucket):
    long = film(5).submit(f"{bucket}/others", progress=False)
    with pytest.raises(FileExistsError, match="0004.txt.*delete=True"):
        film(3).submit(f"{bucket}/others", progress=False)
    assert film(5).submit(f"{bucket}/others", progress=False) == long
    assert film(3).submit(f"{bucket}/others", delete=True, progress=False) == film(3).gif(progress=False)


def test_progress_is_shown(bucket):
    tqdm = pytest.importorskip("tqdm.auto", reason="NOT RUN: tqdm is not installed")
    seen = []

    class Bar(tqdm.tqdm):
        def update(self, n=1):
            seen.append((self.unit, self.n + n, self.total))
            return super().update(n)

    real, tqdm.tqdm = tqdm.tqdm, Bar
    try:
        film(9).submit(f"{bucket}/progress")
    finally:
        tqdm.tqdm = real
    assert (" scripts", 9, 9) in seen and seen[-1] == (" frames", 9, 9)


def test_a_report_that_fails_ends_the_run(bucket, monkeypatch):
    from rayfold import _animation

    def broken(self, what, done, total):
        raise ZeroDivisionError

    monkeypatch.setattr(_animation._Progress, "at", broken)
    with pytest.raises(ZeroDivisionError):
        film(3).submit(f"{bucket}/broken")


@pytest.mark.parametrize(
    "call, error, words",
    [
        (lambda f: f.submit(5), TypeError, "s3://films/wave"),
        (lambda f: f.submit("films/wave"), ValueError, "s3://films/wave"),
        (lambda f: f.submit("s3://films"), ValueError, "s3://films/wave"),
        (lambda f: f.submit("s3:///wave"), ValueError, "s3://films/wave"),
        (lambda f: f.submit("s3://films/a/../b"), ValueError, r"a/\.\./b"),
        (lambda f: f.submit("s3://films/wave", "a.mp4"), ValueError, "ends in .gif"),
        (lambda f: f.submit("s3://films/wave", "a.gif", wait=False), ValueError, "wait=False"),
        (lambda f: f.submit("s3://films/wave", "no/such/folder/a.gif"), OSError, "no/such/folder"),
        (lambda f: rf.animation(frame, frames=2, loop=-1).submit("s3://films/wave"), ValueError, "shown once"),
        (lambda f: rf.animation([frame(0), rf.Scene(8, 6)]).submit("s3://films/wave"), ValueError, "40 x 30.*8 x 6"),
        (lambda f: rf.animation([rf.parse("Screen 8 6\nTrace\n" * 2)], frames=1).submit("s3://films/w"), ValueError, "whole"),
    ],
)
def test_what_cannot_be_submitted_is_refused_at_the_call(monkeypatch, call, error, words):
    # There is no such server: a request would be another error.
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    with pytest.raises(error, match=words):
        call(film(2))


def test_a_faulty_script_is_not_uploaded(monkeypatch):
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    scene = rf.Scene(8, 6)
    scene.sphere(rf.keys({1: 1, 3: -1}), (0, 0, -5), diffuse=1)
    scene.frames(3)
    with pytest.raises(rf.SceneError, match="radius"):
        rf.animation(scene).submit("s3://films/wave")


def test_what_the_functions_refuse_is_an_error_with_the_reason(bucket):
    scene = rf.Scene(100, 50)
    scene.sphere(1, (0, 0, -5), ambient=1)
    with pytest.raises(rf.SceneError, match=r"limit is 4,000\s.*0001.txt:1:8"):
        rf.animation(scene).submit(f"{bucket}/large", progress=False)


def test_a_wrong_key_is_said_with_the_bucket(bucket, monkeypatch):
    with pytest.raises(OSError, match="bucket nowhere"):
        film(2).submit("s3://nowhere/wave", progress=False)
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "wrong")
    with pytest.raises(OSError, match="bucket rayfold.*SignatureDoesNotMatch"):
        film(2).submit(f"{bucket}/wave", progress=False)


WAITING = """
import sys, threading, time
import rayfold as rf
def frame(t):
    scene = rf.Scene(8, 6)
    scene.sphere(1, (t, 0, -5), ambient=1)
    return scene
ticks = []
def tick():
    while True:
        ticks.append(time.perf_counter())
        time.sleep(.01)
threading.Thread(target=tick, daemon=True).start()
print("waiting", flush=True)
try:
    rf.animation(frame, frames=2).submit("s3://{bucket}", progress=False)
except KeyboardInterrupt:
    # Other threads ran all the time.
    print("interrupted", max(b - a for a, b in zip(ticks, ticks[1:])) < .5, flush=True)
    sys.exit(7)
"""


def interrupt(text, environment):
    process = subprocess.Popen(
        [sys.executable, "-c", text], stdout=subprocess.PIPE, text=True, env={**os.environ, **environment}
    )
    try:
        assert process.stdout.readline() == "waiting\n"
        time.sleep(1.5)
        assert process.poll() is None, "it waits"
        start = time.perf_counter()
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=20)
        assert (out, process.returncode) == ("interrupted True\n", 7)
        assert time.perf_counter() - start < 1
    finally:
        process.kill()


def test_ctrl_c_stops_the_wait_for_a_server_that_does_not_answer():
    import socket

    with socket.socket() as deaf:
        deaf.bind(("127.0.0.1", 0))
        deaf.listen()
        port = deaf.getsockname()[1]
        environment = {
            "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}", "AWS_REGION": "us-east-1", "AWS_ACCESS_KEY_ID": "a",
            "AWS_SECRET_ACCESS_KEY": "b",
        }
        interrupt(WAITING.replace("{bucket}", "films/wave"), environment)
