"""A height map from an array: two triangles for each cell, coloured by height."""

import sys

import numpy as np
from numpy.typing import NDArray

import rayfold as rf

SIDE = 48
# Heights up to which a colour is used, and the colour.
BANDS = [(0.04, "#d8c890"), (0.3, "#5a8f3c"), (0.55, "#7a6a50"), (0.75, "#8c8880"), (9.0, "#f4f6f8")]


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


def terrain(height: NDArray[np.float64], samples: int = 16) -> rf.Scene:
    scene = rf.Scene(400, 260, samples=samples, background=("#dfe9f2", "#6fa0d8"))
    scene.look(eye=(1.9, 1.5, 2.6), at=(0, 0.1, 0), fov=36)
    scene.ilight("#fff0d8", (-1, -0.9, -0.35), angle=1)
    scene.plane((0, 0.02, 0), (0, 1, 0), diffuse="#2a5a88", ambient="#0a1826", mirror=0.25)
    surfaces = [rf.Material(diffuse=color, ambient=0.04) for _, color in BANDS]
    rows, columns = height.shape
    x, z = np.linspace(-1.4, 1.4, rows), np.linspace(-1.4, 1.4, columns)
    for i in range(rows - 1):
        for j in range(columns - 1):
            corners = [(x[i + k], height[i + k, j + m], z[j + m]) for k, m in [(0, 0), (0, 1), (1, 1), (1, 0)]]
            for u, v, w in [corners[:3], [corners[0], *corners[2:]]]:
                middle = (u[1] + v[1] + w[1]) / 3
                band = next(k for k, (top, _) in enumerate(BANDS) if middle < top)
                scene.triangle(u, v, w, surfaces[band])
    return scene


if __name__ == "__main__":
    terrain(heights()).save(sys.argv[1] if len(sys.argv) > 1 else "height_map.png")
