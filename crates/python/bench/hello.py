"""The 50 frames of scenes/hello as a GIF: by Python and by the command, in turn, as whole processes and within one."""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rayfold as rf

ROOT = Path(__file__).resolve().parents[3]
FOLDER = ROOT / "scenes" / "hello"
PAIRS = 15
#: The goal: Python's time over the command's.
GOAL = 1.03

SCRIPT = f"""
import rayfold as rf
rf.load({str(FOLDER)!r}).save("OUT", progress=False)
"""


def timed(work):
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def run():
    command = os.environ.get("RAYFOLD", str(ROOT / "target" / "release" / "rayfold"))
    with tempfile.TemporaryDirectory() as place:
        ours, theirs = Path(place, "python.gif"), Path(place, "command.gif")
        by_command = [command, "render", str(FOLDER), "-o", str(theirs), "--quiet"]
        by_python = [sys.executable, "-c", SCRIPT.replace("OUT", str(ours))]
        kinds = {
            "the process": lambda: subprocess.run(by_python, check=True),
            "load and save, in a process that runs": lambda: rf.load(FOLDER).save(ours, progress=False),
        }
        print("| 50 frames of hello | Python, ms | the command, ms | ratio (least to most of the pairs) | goal |")
        print("| --- | ---: | ---: | ---: | ---: |")
        missed = False
        for name, work in kinds.items():
            work(), subprocess.run(by_command, check=True)
            pairs = []
            for k in range(PAIRS):
                both = [lambda: timed(work), lambda: timed(lambda: subprocess.run(by_command, check=True))]
                # Each goes first as often as the other.
                first, second = (0, 1) if k % 2 == 0 else (1, 0)
                times = [0.0, 0.0]
                times[first] = both[first]()
                times[second] = both[second]()
                pairs.append(times)
            assert ours.read_bytes() == theirs.read_bytes(), "the files differ"
            python, rayfold = (statistics.median(times) for times in zip(*pairs))
            ratios = sorted(a / b for a, b in pairs)
            ratio = statistics.median(ratios)
            missed |= ratio > GOAL
            print(
                f"| {name} | {1000 * python:.0f} | {1000 * rayfold:.0f} | {ratio:.3f} ({ratios[0]:.2f} to {ratios[-1]:.2f})"
                f" | {GOAL} |"
            )
    return int(missed)
