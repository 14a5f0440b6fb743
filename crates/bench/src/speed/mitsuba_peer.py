"""Camera and shadow rays through a scene of one shape by Mitsuba 3, its LLVM variant, on one thread.

Reads a JSON object from standard input and prints processor seconds of the camera rays and of the shadow rays (the least
of several passes, compiled before), and how many shadow rays there are.
"""

import json
import sys
import time

import numpy

import drjit
import mitsuba

mitsuba.set_variant("llvm_ad_rgb")
drjit.set_thread_count(1)
from mitsuba import ScalarTransform4f as Transform  # noqa: E402 (there is none before the variant is set)


def shape(numbers):
    kind = numbers["kind"]
    if kind == "sphere":
        return {"type": "sphere", "center": numbers["center"], "radius": numbers["radius"]}
    if kind == "cylinder":
        return {"type": "cylinder", "p0": numbers["a"], "p1": numbers["b"], "radius": numbers["radius"]}
    center, normal = numpy.array(numbers["center"]), numpy.array(numbers["normal"])
    aside = [1.0, 0.0, 0.0] if abs(normal[0]) < 0.5 else [0.0, 1.0, 0.0]
    place = Transform().look_at(origin=center.tolist(), target=(center + normal).tolist(), up=aside)
    return {"type": "disk", "to_world": place @ Transform().scale(numbers["radius"])}


told = json.load(sys.stdin)
scene = mitsuba.load_dict(
    {"type": "scene", **{f"shape{k}": shape(numbers) for k, numbers in enumerate(told["shapes"])}}
)
width, height = told["size"]
across, along = numpy.meshgrid(numpy.arange(width), numpy.arange(height))
corner, right, up = (numpy.array(told[name]) for name in ("corner", "right", "up"))
directions = corner + across.reshape(-1, 1) * right + along.reshape(-1, 1) * up
directions /= numpy.linalg.norm(directions, axis=1, keepdims=True)
directions = mitsuba.Vector3f(numpy.ascontiguousarray(directions.T, dtype=numpy.float32))
origin = mitsuba.Point3f(*told["eye"])
rays = mitsuba.Ray3f(drjit.zeros(mitsuba.Point3f, width * height) + origin, directions)
drjit.eval(rays)


def timed(work):
    least = float("inf")
    for _ in range(told["rounds"] + 1):
        drjit.sync_thread()
        before = time.process_time()
        result = work()
        drjit.eval(result)
        drjit.sync_thread()
        took = time.process_time() - before
        # The first compiles.
        least = took if least == float("inf") else min(least, took)
    return least, result


seconds, _ = timed(lambda: scene.ray_intersect_preliminary(rays).t)
found = scene.ray_intersect(rays)
towards = mitsuba.Vector3f(*told["towards"])
lit = found.is_valid() & (drjit.dot(found.n, towards) > 0)
shadow_rays = found.spawn_ray(drjit.zeros(mitsuba.Vector3f, width * height) + towards)
drjit.eval(shadow_rays, lit)
shadow_seconds, _ = timed(lambda: scene.ray_test(shadow_rays, lit))
print(seconds, shadow_seconds, int(drjit.count(lit)[0]))
