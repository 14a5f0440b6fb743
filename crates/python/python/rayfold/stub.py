"""Writes the types of the package anew: `python -m rayfold.stub` in a checkout."""

from pathlib import Path

from . import _rayfold

if __name__ == "__main__":
    Path(__file__).with_name("__init__.pyi").write_text(_rayfold.stub())
