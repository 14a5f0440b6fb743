"""Measurements of the Python package, for docs/reports/python.md.

    python crates/python/bench overhead         the time that Python adds to a scene of 100 objects
    python crates/python/bench random [COUNT]   random scenes by methods and by texts, compared byte for byte
    python crates/python/bench arrays           the time in which 1.3 million triangles are handed over
    python crates/python/bench memory           memory while 10,000 frames are drawn and encoded
    python crates/python/bench hello            the 50 frames of scenes/hello, by Python and by the command

The package must be built for release: maturin develop --release -m crates/python/Cargo.toml. The command is
target/release/rayfold, or RAYFOLD.
"""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "tests")]

if __name__ == "__main__":
    import arrays
    import hello
    import memory
    import overhead
    import random_scenes

    COMMANDS = {
        "arrays": arrays.run, "overhead": overhead.run, "random": random_scenes.run, "memory": memory.run, "hello": hello.run,
    }
    if len(sys.argv) < 2 or sys.argv[1] not in COMMANDS:
        sys.exit(__doc__)
    sys.exit(COMMANDS[sys.argv[1]](*sys.argv[2:]))
