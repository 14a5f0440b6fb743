"""The 50 frames of scenes/hello as a GIF: by Python and by the command, in turn, as whole processes and within one."""

import os
import resource
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


def used():
    """The processor time of this process and of those that it waited for, in seconds."""
    return time.process_time(), sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])


def timed(work):
    """Seconds by the clock and of all processors. Other programs disturb the first more."""
    before, start = used(), time.perf_counter()
    work()
    wall, after = time.perf_counter() - start, used()
    return wall, sum(after) - sum(before)


def ratios(pairs, figure):
    """The middle of the ratios of the pairs, the least and the most."""
    found = sorted(python[figure] / command[figure] for python, command in pairs)
    return f"{statistics.median(found):.3f} ({found[0]:.2f} to {found[-1]:.2f})", statistics.median(found)


def run():
    command = os.environ.get("RAYFOLD", str(ROOT / "target" / "release" / "rayfold"))
    with tempfile.TemporaryDirectory() as place:
        ours, theirs = Path(place, "python.gif"), Path(place, "command.gif")
        by_command = [command, "render", str(FOLDER), "-o", str(theirs), "--quiet"]
        by_python = [sys.executable, "-c", SCRIPT.replace("OUT", str(ours))]

        def render():
            subprocess.run(by_command, check=True)

        kinds = {
            "load and save, in a process that runs": lambda: rf.load(FOLDER).save(ours, progress=False),
            "a process, with the start of Python": lambda: subprocess.run(by_python, check=True),
        }
        print("| 50 frames of hello | Python, ms | the command, ms | ratio by the clock | ratio of processor time | goal |")
        print("| --- | ---: | ---: | ---: | ---: | ---: |")
        missed = False
        for name, work in kinds.items():
            work()
            render()
            pairs = []
            for k in range(PAIRS):
                # Each goes first as often as the other.
                if k % 2 == 0:
                    python, rayfold = timed(work), timed(render)
                else:
                    rayfold, python = timed(render), timed(work)
                pairs.append((python, rayfold))
            assert ours.read_bytes() == theirs.read_bytes(), "the files differ"
            python, rayfold = (1000 * statistics.median(times[0] for times in side) for side in zip(*pairs))
            wall, _ = ratios(pairs, 0)
            processor, middle = ratios(pairs, 1)
            missed |= middle > GOAL
            print(f"| {name} | {python:.0f} | {rayfold:.0f} | {wall} | {processor} | {GOAL} |")
    return int(missed)
