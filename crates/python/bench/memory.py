"""Memory while 10,000 frames are drawn and encoded, and whether it grows with their number."""

import gc
import os
import tempfile

import numpy as np

import rayfold as rf

FRAMES = 10_000


def frame(t):
    scene = rf.Scene(160, 120, background="#203040")
    scene.look((0, 2, 8), (0, 1, 0), 34)
    scene.ilight("#ffffff", (1, -1, -0.5))
    for i in range(20):
        scene.sphere(0.3, (i / 2 - 5, 1 + (t * (i + 1)) % 2, 0), rf.Material(diffuse=(i / 20, t % 1, 0.5)))
    return scene


def grid(side=20):
    x, z = np.meshgrid(np.linspace(-3, 3, side + 1), np.linspace(-3, 3, side + 1), indexing="ij")
    first = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)[:-1, :-1].ravel()
    faces = np.column_stack([first, first + 1, first + side + 2, first + side + 1])
    return np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()]), faces


PLACES, CELLS = grid()
PICTURE = np.random.default_rng(1).integers(0, 256, (32, 32, 3), np.uint8)


def of_a_mesh(t):
    """The same arrays in each frame."""
    scene = frame(t)
    scene.mesh(PLACES, CELLS, diffuse=0.5)
    scene.box((-1, 0, -1), (1, 1, 1), image=(PICTURE, "flat", 1), diffuse=1)
    return scene


def of_meshes(t):
    """A mesh and a picture of its own in each frame."""
    scene = frame(t)
    places = PLACES.copy()
    places[:, 1] = np.sin(places[:, 0] + t)
    scene.mesh(places, CELLS, diffuse=0.5)
    scene.box((-1, 0, -1), (1, 1, 1), image=(PICTURE + np.uint8(100 * t % 251), "flat", 1), diffuse=1)
    return scene


def resident():
    """The memory in use, in KiB."""
    gc.collect()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024


def drawn(frame=frame):
    for number, _ in enumerate(rf.animation(frame, frames=FRAMES, fps=100).frames(progress=False), 1):
        yield number


def encoded():
    def counted(t):
        counted.number += 1
        seen.append(counted.number)
        return frame(t)

    counted.number, seen = 0, []
    film = rf.animation(counted, frames=FRAMES, fps=50)
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "film.gif")
        encoder = None
        for number, image in enumerate(film._drawn(False), 1):
            encoder = encoder or rf._rayfold.Encoder(out, "gif", image.size, FRAMES, 50, 0, None, False)
            encoder.push(image, None)
            yield number
        encoder.finish()


def run():
    marks = (100, 1000, 2000, 4000, 6000, 8000, FRAMES)
    print("| KiB in use after frames | " + " | ".join(map(str, marks)) + " |")
    print("| --- |" + " ---: |" * len(marks))
    grown = []
    kinds = {
        "drawn": drawn,
        "encoded as GIF": encoded,
        "drawn, with a mesh and a picture from arrays": lambda: drawn(of_a_mesh),
        "drawn, with others in each frame": lambda: drawn(of_meshes),
    }
    for name, work in kinds.items():
        used = [resident() for number in work() if number in marks]
        grown.append(used[-1] - used[1])
        print(f"| {name} | " + " | ".join(f"{kib:,}" for kib in used) + " |")
    print(f"grown from frame 1,000 to {FRAMES:,}: " + ", ".join(f"{kib:,} KiB" for kib in grown))
    return int(max(grown) > 20_000)
