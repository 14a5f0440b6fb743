"""A pendulum wave: fifteen pendulums, each a little shorter than the one before. After 30 seconds they meet again."""

import colorsys
import math
import sys

import rayfold as rf

PENDULUMS = 15
SECONDS = 30.0
AMPLITUDE = math.radians(32)


def frame(t: float, samples: int = 16) -> rf.Scene:
    scene = rf.Scene(360, 240, samples=samples, background="#dfe6ee")
    scene.look(eye=(3.2, 0.4, 7.5), at=(0, -1.05, 0), fov=28)
    scene.ilight("#fff4e0", (-0.6, -1.5, -1), angle=2)
    scene.plane((0, -2.6, 0), (0, 1, 0), diffuse="#9aa4b0", ambient="#20242a")
    scene.box((-0.15, 0, -2.1), (0.15, 0.12, 2.1), diffuse="#6b4a2b", ambient="#1a120b")
    thread = rf.Material(diffuse="#303438", ambient="#181a1c")
    for i in range(PENDULUMS):
        # It swings 30 + i times in 30 seconds; its length follows from that.
        swings = 30 + i
        length = 2.1 * (30 / swings) ** 2
        angle = AMPLITUDE * math.cos(2 * math.pi * swings * t / SECONDS)
        z = 1.9 - 3.8 * i / (PENDULUMS - 1)
        ball = (length * math.sin(angle), -length * math.cos(angle), z)
        scene.cylinder(0.008, (0, 0, z), ball, thread)
        color = colorsys.hsv_to_rgb(0.95 * i / PENDULUMS, 0.75, 0.9)
        ambient = tuple(0.2 * channel for channel in color)
        scene.sphere(0.12, ball, diffuse=color, ambient=ambient, shine=(0.5, 60))
    return scene


if __name__ == "__main__":
    film = rf.animation(frame, frames=150, fps=10)
    film.save(sys.argv[1] if len(sys.argv) > 1 else "pendulum_wave.gif")
