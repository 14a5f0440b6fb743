"""What the tests share: the command `rayfold`, and scenes."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import rayfold as rf

ROOT = Path(__file__).resolve().parents[3]
sys.path.append(str(ROOT / "crates" / "python" / "bench"))


@pytest.fixture(scope="session")
def rayfold():
    """The command, which draws the same pictures: `RAYFOLD`, or what cargo has built, or on the PATH."""
    built = [ROOT / "target" / profile / "rayfold" for profile in ("release", "debug")]
    places = [os.environ.get("RAYFOLD"), *built, shutil.which("rayfold")]
    for place in places:
        if place and Path(place).exists():
            return str(place)
    pytest.fail("the command rayfold is not there: cargo build -p rayfold --no-default-features, or set RAYFOLD")


@pytest.fixture
def render(rayfold, tmp_path):
    """Draws a script by the command, and returns the bytes of the file."""

    def render(text, ending="png", *flags):
        script = tmp_path / "script.txt"
        script.write_text(str(text))
        out = tmp_path / f"out.{ending}"
        subprocess.run([rayfold, "render", str(script), "-o", str(out), "--quiet", *flags], check=True)
        return out.read_bytes()

    return render


@pytest.fixture
def stage():
    """A scene with a floor, a sun and a camera, of few pixels."""
    scene = rf.Scene(48, 32, background="#8cb4e6")
    scene.look(eye=(0, 2, 8), at=(0, 1, 0), fov=34)
    scene.ilight("#fff8e0", (-1, -2, -1))
    scene.plane((0, 0, 0), (0, 1, 0), diffuse=0.6)
    return scene
