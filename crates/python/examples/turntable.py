"""A product on a turntable: a perfume bottle, one turn in 48 frames."""

import sys

import rayfold as rf

FRAMES = 48


def table(samples: int = 32) -> rf.Scene:
    """The bottle, its stand and the light. It turns by one curve, so that one script is the whole animation."""
    scene = rf.Scene(320, 320, samples=samples, tone="srgb", depth=16)
    scene.look(eye=(0, 1.9, 5.2), at=(0, 0.75, 0), fov=32)
    scene.background((0.55, 0.6, 0.68), (0.9, 0.92, 0.95))
    scene.ilight((1.4, 1.3, 1.2), (-1, -1.6, -0.8), angle=6)
    scene.plight((0.5, 0.55, 0.7), (3, 2.5, 2), radius=0.4)
    scene.plane((0, 0, 0), (0, 1, 0), diffuse="#c8ccd2")

    gold = rf.Material(diffuse="#8a6420", mirror=(0.6, 0.45, 0.2), shine=(0.8, 120))
    glass = rf.Material(glass=((0.93, 0.97, 0.95), 1.5), shine=(0.6, 300))
    label = rf.Material(diffuse="#f4efe2")
    with scene.group("bottle"):
        scene.box((-0.6, 0.12, -0.3), (0.6, 1.15, 0.3), glass)
        scene.box((-0.36, 0.4, 0.301), (0.36, 0.8, 0.306), label)
        scene.cylinder(0.14, (0, 1.15, 0), (0, 1.3, 0), gold)
        scene.box((-0.22, 1.3, -0.22), (0.22, 1.62, 0.22), gold)
    scene.cylinder(1, (0, 0, 0), (0, 0.1, 0), diffuse="#30343a", mirror=0.15)
    scene.torus(1, 0.03, (0, 0.1, 0), (0, 1, 0), gold)

    angle = rf.keys({1: 0, FRAMES + 1: 360}, cycle=True)
    scene.use("bottle", rotation=(0, angle, 0))
    scene.frames(FRAMES)
    return scene


if __name__ == "__main__":
    rf.animation(table(), fps=24).save(sys.argv[1] if len(sys.argv) > 1 else "turntable.gif")
