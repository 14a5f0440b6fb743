"""The time that Python adds to a scene of 100 objects: to make it, beyond parsing its text and drawing it."""

import statistics
import time

import rayfold as rf

#: The goal, in microseconds.
GOAL = 200
OBJECTS = 100
ROUNDS = 300


def points():
    return [(0.37 * i - 18.0, 0.1 * (i % 7), -5.0 - 0.3 * (i % 11)) for i in range(OBJECTS)]


def stage():
    scene = rf.Scene(64, 48)
    scene.look((0, 2, 8), (0, 1, 0), 34)
    scene.ilight("#ffffff", (1, -1, -0.5))
    return scene


def one_material():
    scene, clay = stage(), rf.Material(diffuse="#c04020", mirror=0.1)
    for at in POINTS:
        scene.sphere(0.3, at, clay)
    return scene


def a_clause_each():
    scene = stage()
    for at in POINTS:
        scene.sphere(0.3, at, diffuse="#c04020", mirror=0.1)
    return scene


def a_new_material_each():
    scene = stage()
    for i, at in enumerate(POINTS):
        scene.sphere(0.3, at, rf.Material(diffuse=(i / 100, 0.5, 0.25), mirror=0.1))
    return scene


def a_new_colour_each():
    scene = stage()
    for i, at in enumerate(POINTS):
        scene.sphere(0.3, at, rf.Material(diffuse=COLOURS[i], mirror=0.1))
    return scene


def curves():
    scene = stage()
    for x, y, z in POINTS:
        scene.sphere(0.3, (x, KEYS, z), diffuse="#c04020", mirror=0.1)
    scene.frames(2)
    return scene


POINTS = points()
COLOURS = [f"#{i:02x}4020" for i in range(OBJECTS)]
KEYS = rf.keys({1: 0, 50: 3}, "smooth")
KINDS = [one_material, a_clause_each, a_new_material_each, a_new_colour_each, curves]


def median_us(work):
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        work()
        times.append(1e6 * (time.perf_counter() - start))
    return statistics.median(times), min(times)


def run():
    print("| 100 objects | made, us (least) | its text parsed, us | goal |")
    print("| --- | ---: | ---: | ---: |")
    missed = False
    for kind in KINDS:
        text = str(kind())
        made, least = median_us(lambda: str(kind()))
        parsed, _ = median_us(lambda: rf.parse(text))
        missed |= made > GOAL
        print(f"| {kind.__name__.replace('_', ' ')} | {made:.0f} ({least:.0f}) | {parsed:.0f} | {GOAL} |")
    return int(missed)
