"""A height map from an array: a grid of quadrilaterals, coloured by height."""

import sys

import numpy as np
from numpy.typing import NDArray

import rayfold as rf

SIDE = 240
# Heights, and the colours there, as levels from 0 to 255.
HEIGHTS = [0.0, 0.04, 0.12, 0.32, 0.5, 0.66, 0.8]
COLORS = [(216, 200, 144), (216, 200, 144), (90, 143, 60), (80, 124, 56), (122, 106, 80), (140, 136, 128), (244, 246, 248)]


def heights(side: int = SIDE, seed: int = 7) -> NDArray[np.float64]:
    """Mountains: a sum of waves, each half as high and twice as fine as the one before."""
    dice = np.random.default_rng(seed)
    x, z = np.meshgrid(np.linspace(-1, 1, side), np.linspace(-1, 1, side), indexing="ij")
    height = np.zeros_like(x)
    for octave in range(6):
        a, b, c = dice.uniform(-1, 1, 3)
        waves = np.sin(2**octave * (1.7 * x + a) + b) * np.cos(2**octave * (1.9 * z + c))
        height += np.abs(waves) * 0.5**octave
    mountains: NDArray[np.float64] = 0.6 * (height - height.min()) * np.exp(-0.8 * (x**2 + z**2))
    return mountains


def grid(height: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The vertices of a height map, and its cells as the indices of their corners, counterclockwise seen from above."""
    rows, columns = height.shape
    x, z = np.meshgrid(np.linspace(-1.4, 1.4, rows), np.linspace(-1.4, 1.4, columns), indexing="ij")
    vertices = np.column_stack([x.ravel(), height.ravel(), z.ravel()])
    row, column = np.indices((rows - 1, columns - 1)).reshape(2, -1)
    first: NDArray[np.int64] = row * columns + column
    faces = np.column_stack([first, first + 1, first + columns + 1, first + columns])
    return vertices, faces


def terrain(height: NDArray[np.float64], samples: int = 16) -> rf.Scene:
    scene = rf.Scene(400, 260, samples=samples, background=("#dfe9f2", "#6fa0d8"))
    scene.look(eye=(1.9, 1.5, 2.6), at=(0, 0.1, 0), fov=36)
    scene.ilight("#fff0d8", (-1, -0.9, -0.35), angle=1)
    scene.plane((0, 0.02, 0), (0, 1, 0), diffuse="#2a5a88", ambient="#0a1826", mirror=0.25)
    vertices, faces = grid(height)
    channels = [np.interp(height.ravel(), HEIGHTS, [color[k] / 255 for color in COLORS]) for k in range(3)]
    scene.mesh(vertices, faces, colors=np.column_stack(channels), smooth=30)
    return scene


if __name__ == "__main__":
    terrain(heights()).save(sys.argv[1] if len(sys.argv) > 1 else "height_map.png")
