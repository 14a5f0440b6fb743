"""Draws a scene by Mitsuba 3's path tracer, its LLVM variant, on one thread: times and errors of its samplers.

Reads a JSON object from standard input; prints its version, the samples the error of its own truth (half of what two
halves of it differ by) and its mean level, and a line for each picture: sampler, samples a pixel, processor seconds (the least of several, compiled
before, without what a picture of 8 x 6 takes), root mean square over pixels and channels in levels, share of pixels off by more
than 4 levels.

The language has matter that scatters the light of suns alone and mirrors besides, and suns that are not seen themselves. Mitsuba
has neither: they are the two classes here, which it compiles into its kernels as it does its own.
"""

import json
import math
import os
import sys
import tempfile
import time

import numpy

import drjit
import mitsuba

mitsuba.set_variant("llvm_ad_rgb")
drjit.set_thread_count(1)
# Warnings go where the answer goes.
mitsuba.set_log_level(mitsuba.LogLevel.Error)
from mitsuba import ScalarTransform4f as Transform  # noqa: E402 (there is none before the variant is set)

SAMPLERS = ["independent", "stratified", "multijitter", "orthogonal", "ldsampler"]
COUNTS = [4, 16, 64, 256, 1024]
# With more samples than this only the best samplers go on.
ALL = 64
GO_ON = 2


class Matter(mitsuba.BSDF):
    """Scatters what lights send, on the side that is seen, and goes on as a mirror does."""

    def __init__(self, props):
        mitsuba.BSDF.__init__(self, props)
        self.diffuse = mitsuba.Color3f(props["diffuse"])
        self.mirror = mitsuba.Color3f(props["mirror"])
        drjit.make_opaque(self.diffuse, self.mirror)
        sides = mitsuba.BSDFFlags.FrontSide | mitsuba.BSDFFlags.BackSide
        self.m_components = [
            mitsuba.BSDFFlags.DiffuseReflection | sides,
            mitsuba.BSDFFlags.DeltaReflection | sides,
        ]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def sample(self, ctx, si, sample1, sample2, active):
        sample = drjit.zeros(mitsuba.BSDFSample3f)
        sample.wo = mitsuba.reflect(si.wi)
        sample.pdf = 1.0
        sample.eta = 1.0
        sample.sampled_type = mitsuba.UInt32(+mitsuba.BSDFFlags.DeltaReflection)
        sample.sampled_component = mitsuba.UInt32(1)
        return sample, self.mirror & active

    def eval(self, ctx, si, wo, active):
        same_side = active & (si.wi.z * wo.z > 0)
        return drjit.select(same_side, self.diffuse * (drjit.inv_pi * drjit.abs(wo.z)), 0.0)

    def pdf(self, ctx, si, wo, active):
        return mitsuba.Float(0)

    def eval_pdf(self, ctx, si, wo, active):
        return self.eval(ctx, si, wo, active), mitsuba.Float(0)


class Sun(mitsuba.Emitter):
    """Light from a disc of the sky, which rays pass."""

    def __init__(self, props):
        mitsuba.Emitter.__init__(self, props)
        self.color = mitsuba.Color3f(props["color"])
        self.frame = mitsuba.Frame3f(mitsuba.Vector3f(props["towards"]))
        self.cosine = mitsuba.Float(math.cos(math.radians(props["angle"] / 2)))
        drjit.make_opaque(self.color, self.frame, self.cosine)
        self.m_flags = mitsuba.EmitterFlags.Infinite | mitsuba.EmitterFlags.DeltaDirection

    def sample_direction(self, it, sample, active):
        towards = self.frame.to_world(mitsuba.warp.square_to_uniform_cone(sample, self.cosine))
        found = drjit.zeros(mitsuba.DirectionSample3f)
        found.d = towards
        found.dist = 1e3
        found.p = it.p + found.dist * towards
        found.n = -towards
        found.time = it.time
        found.pdf = 1.0
        found.delta = True
        found.emitter = mitsuba.EmitterPtr(self)
        return found, (drjit.pi * self.color) & active

    def pdf_direction(self, it, ds, active):
        return mitsuba.Float(0)

    def eval(self, si, active):
        return mitsuba.Color3f(0)


mitsuba.register_bsdf("matter", Matter)
mitsuba.register_emitter("sun", Sun)


def rgb(color):
    return {"type": "rgb", "value": color}


def light(sun):
    # The brighter one is asked the more often.
    weight = {"sampling_weight": sum(sun["color"])}
    if sun["angle"] > 0:
        return {"type": "sun", **sun, **weight}
    irradiance = rgb([math.pi * channel for channel in sun["color"]])
    direction = [-x for x in sun["towards"]]
    return {"type": "directional", "direction": direction, "irradiance": irradiance, **weight}


def surface_of(numbers):
    if numbers["rough"] > 0:
        return {"type": "roughconductor", "distribution": "ggx", "alpha": numbers["rough"], "material": "none",
                "specular_reflectance": rgb(numbers["mirror"])}
    if request["sampled"]:
        return {"type": "diffuse", "reflectance": rgb(numbers["diffuse"])}
    return {"type": "matter", "diffuse": numbers["diffuse"], "mirror": numbers["mirror"]}


def shape(numbers, folder):
    surface = {"bsdf": surface_of(numbers)}
    if max(numbers["glow"]) > 0:
        surface["emitter"] = {"type": "area", "radiance": rgb(numbers["glow"])}
    elif max(numbers["ambient"]) > 0:
        # What is seen, not sampled as a light.
        surface["emitter"] = {"type": "area", "radiance": rgb(numbers["ambient"]), "sampling_weight": 0.0}
    if numbers["kind"] == "sphere":
        return {"type": "sphere", "center": numbers["center"], "radius": numbers["radius"], **surface}
    if numbers["kind"] == "cube":
        low, high = numpy.array(numbers["low"]), numpy.array(numbers["high"])
        place = Transform().translate(((low + high) / 2).tolist()).scale(((high - low) / 2).tolist())
        return {"type": "cube", "to_world": place, **surface}
    if numbers["kind"] == "disk":
        towards = (numpy.array(numbers["center"]) + numpy.array(numbers["normal"])).tolist()
        aside = [1, 0, 0] if abs(numbers["normal"][1]) > 0.5 else [0, 1, 0]
        place = Transform().look_at(origin=numbers["center"], target=towards, up=aside).scale(numbers["radius"])
        return {"type": "disk", "to_world": place, **surface}
    handle, path = tempfile.mkstemp(".ply", dir=folder)
    with os.fdopen(handle, "w") as file:
        axes = "".join(f"property float {axis}\n" for axis in "xyz")
        file.write(f"ply\nformat ascii 1.0\nelement vertex 3\n{axes}element face 1\n")
        file.write("property list uchar int vertex_indices\nend_header\n")
        file.writelines(" ".join(map(str, corner)) + "\n" for corner in numbers["corners"])
        file.write("3 0 1 2\n")
    return {"type": "ply", "filename": path, "face_normals": True, **surface}


request = json.load(sys.stdin)
# A light that is sampled where surfaces scatter all light.
sky = {"sampling_weight": 1.0 if request["sampled"] else 0.0}
if isinstance(request["sky"][0], list):
    panorama = numpy.array(request["sky"], dtype=numpy.float32)
    # The middle of a panorama is at -z here, and at +z there.
    panorama = numpy.roll(panorama, panorama.shape[1] // 2, axis=1)
    sky |= {"type": "envmap", "bitmap": mitsuba.Bitmap(panorama)}
else:
    sky |= {"type": "constant", "radiance": rgb(request["sky"])}
path = {"type": "path", "max_depth": request["bounces"] + 2, "rr_depth": 1000}
with tempfile.TemporaryDirectory() as folder:
    suns = {f"sun{k}": light(sun) for k, sun in enumerate(request["suns"])}
    shapes = {f"shape{k}": shape(numbers, folder) for k, numbers in enumerate(request["shapes"])}
    scene = mitsuba.load_dict({"type": "scene", "integrator": path, "sky": sky, **suns, **shapes})


def camera(sampler, count, size):
    width, height = size
    lens = {"type": "perspective"}
    if request["lens"] > 0:
        lens = {"type": "thinlens", "aperture_radius": request["lens"], "focus_distance": request["focus"]}
    return mitsuba.load_dict(
        {
            **lens,
            "fov": request["fov"],
            "fov_axis": "x",
            "to_world": Transform().look_at(origin=request["eye"], target=request["target"], up=request["up"]),
            "film": {
                "type": "hdrfilm",
                "width": width,
                "height": height,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
            "sampler": {"type": sampler, "sample_count": count},
        }
    )


def drawn(sampler, count, size, seeds):
    """The samples a pixel, which some samplers round up; seconds and levels before rounding, seed by seed."""
    seen = camera(sampler, count, size)
    count = seen.sampler().sample_count()

    def draw(seed):
        drjit.sync_thread()
        before = time.process_time()
        image = mitsuba.render(scene, sensor=seen, spp=count, seed=seed)
        drjit.eval(image)
        drjit.sync_thread()
        took = time.process_time() - before
        return took, 255 * numpy.clip(numpy.array(image, dtype=numpy.float64), 0, 1)

    return count, [draw(seed) for seed in seeds]


def least(pictures):
    # The first compiles.
    return min(seconds for seconds, _ in pictures[1:])


def root_mean_square(errors):
    return math.sqrt((errors**2).mean())


count, halves = drawn("multijitter", request["truth"] // 2, request["size"], [1000, 1001])
truth = (halves[0][1] + halves[1][1]) / 2
print(mitsuba.__version__, 2 * count, root_mean_square(halves[0][1] - halves[1][1]) / 2, truth.mean(), flush=True)

seeds = range(request["rounds"] + 1)
# What Python does for a picture, however small.
start = {sampler: least(drawn(sampler, COUNTS[0], [8, 6], seeds)[1]) for sampler in SAMPLERS}
samplers = SAMPLERS
for count in COUNTS:
    errors = {}
    for sampler in samplers:
        taken, pictures = drawn(sampler, count, request["size"], seeds)
        seconds = least(pictures) - start[sampler]
        off = pictures[-1][1] - truth
        if request["pairs"]:
            off = (pictures[-1][1] - pictures[-2][1]) / math.sqrt(2)
        errors[sampler] = root_mean_square(off)
        share = (abs(off).max(axis=2) > 4).mean()
        print(sampler, taken, seconds, errors[sampler], share, flush=True)
    if count >= ALL:
        samplers = sorted(errors, key=errors.get)[:GO_ON]
        if errors[samplers[0]] < request["enough"]:
            break
