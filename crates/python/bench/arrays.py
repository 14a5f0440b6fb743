"""The time in which 1.3 million triangles are handed over, and in which they are read."""

import statistics
import time

import numpy as np

import rayfold as rf

#: The goal, in milliseconds.
GOAL = 100
ROUNDS = 15
#: The cells of the grid in each direction, of two triangles each.
SIDE = 807


def grid(kind, index):
    x, z = np.meshgrid(np.linspace(-2, 2, SIDE + 1), np.linspace(-2, 2, SIDE + 1), indexing="ij")
    vertices = np.column_stack([x.ravel(), 0.2 * np.sin(5 * x * z).ravel(), z.ravel()]).astype(kind)
    first = np.arange((SIDE + 1) ** 2).reshape(SIDE + 1, SIDE + 1)[:-1, :-1].ravel()
    a, b, c, d = first, first + 1, first + SIDE + 2, first + SIDE + 1
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]).astype(index)
    return vertices, faces


def stage():
    scene = rf.Scene(8, 6)
    scene.ilight(1, (-1, -2, -1))
    return scene


def timed(work):
    """Milliseconds by the clock and of all processors. Other programs disturb the first more."""
    start, before = time.perf_counter(), time.process_time()
    work()
    return 1e3 * (time.perf_counter() - start), 1e3 * (time.process_time() - before)


def run():
    print("Medians by the clock, the least in parentheses, and medians of processor time, in ms.\n")
    print(f"| {2 * SIDE**2:,} triangles | handed over | processor | read | processor | both again | goal |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    missed = False
    for kind, index in (("float32", "int32"), ("float64", "int64")):
        vertices, faces = grid(kind, index)
        normals = np.zeros_like(vertices) + (0, 1, 0)
        colors = (127 * (1 + vertices / 2)).astype(np.uint8)
        for name, more in {"alone": {}, "with normals and colours": {"normals": normals.astype(kind), "colors": colors}}.items():
            given, read, again = [], [], []
            for k in range(ROUNDS):
                # Another mesh each time, so that nothing is known of it.
                vertices[0, 1] = k
                scene, other = stage(), stage()
                given.append(timed(lambda: scene.mesh(vertices, faces, **more)))
                read.append(timed(lambda: scene.frame_count))
                again.append(timed(lambda: (other.mesh(vertices, faces, **more), other.frame_count)))
            shown = []
            for times in (given, read, again):
                clock, processor = zip(*times)
                shown += [f"{statistics.median(clock):.0f} ({min(clock):.0f})", f"{statistics.median(processor):.0f}"]
            missed |= statistics.median(clock for clock, _ in given) > GOAL
            print(f"| {kind}, {index}, {name} | {' | '.join(shown[:5])} | {GOAL} |")
    return int(missed)
