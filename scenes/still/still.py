"""Writes jug.ply, bowl.ply, pear.ply and apple.ply: bodies that a lathe could turn, each from the profile of one side."""

import math
import struct

AROUND = 40
# Radius and height, from the middle of the bottom to the middle of the top. A wall goes up outside and down inside.
PROFILES = {
    "jug": [
        (0, 0), (0.26, 0), (0.3, 0.012), (0.315, 0.04), (0.36, 0.16), (0.405, 0.32), (0.41, 0.46), (0.36, 0.6),
        (0.26, 0.73), (0.185, 0.83), (0.165, 0.92), (0.18, 1.01), (0.22, 1.09), (0.238, 1.11), (0.228, 1.115),
        (0.195, 1.07), (0.16, 1), (0.148, 0.92), (0.165, 0.83), (0.24, 0.72), (0.34, 0.58), (0.385, 0.45),
        (0.38, 0.32), (0.3, 0.08), (0.2, 0.04), (0, 0.035),
    ],
    "bowl": [
        (0, 0), (0.2, 0), (0.225, 0.012), (0.22, 0.035), (0.2, 0.05), (0.3, 0.085), (0.45, 0.17), (0.56, 0.29),
        (0.615, 0.4), (0.625, 0.41), (0.618, 0.418), (0.59, 0.4), (0.54, 0.3), (0.43, 0.19), (0.28, 0.11), (0, 0.08),
    ],
    "pear": [
        (0, 0.03), (0.04, 0.015), (0.09, 0), (0.16, 0.025), (0.215, 0.09), (0.238, 0.18), (0.225, 0.27), (0.18, 0.36),
        (0.13, 0.44), (0.1, 0.51), (0.075, 0.57), (0.04, 0.6), (0.016, 0.598), (0.012, 0.62), (0.016, 0.72), (0, 0.725),
    ],
    "apple": [
        (0, 0.04), (0.03, 0.02), (0.08, 0), (0.15, 0.03), (0.215, 0.12), (0.235, 0.22), (0.215, 0.32), (0.15, 0.39),
        (0.09, 0.395), (0.04, 0.365), (0.014, 0.34), (0.012, 0.38), (0.016, 0.46), (0, 0.465),
    ],
}  # fmt: skip


def halfway(p, k):
    """The point between two of a profile, on a curve through four (Catmull-Rom)."""
    a, b, c, d = p[max(k - 1, 0)], p[k], p[k + 1], p[min(k + 2, len(p) - 1)]
    return [(9 * (y + z) - x - w) / 16 for x, y, z, w in zip(a, b, c, d)]


for name, profile in PROFILES.items():
    rings = [profile[1]]
    for k in range(1, len(profile) - 2):
        rings += [halfway(profile, k), profile[k + 1]]
    points = [(0, profile[0][1], 0), (0, profile[-1][1], 0)]
    for r, y in rings:
        turns = (2 * math.pi * k / AROUND for k in range(AROUND))
        points += [(r * math.sin(turn), y, r * math.cos(turn)) for turn in turns]
    ring = lambda j, k: 2 + j * AROUND + k % AROUND
    last = len(rings) - 1
    faces = [(0, ring(0, k + 1), ring(0, k)) for k in range(AROUND)]
    faces += [(ring(last, k), ring(last, k + 1), 1) for k in range(AROUND)]
    for j in range(last):
        faces += [(ring(j, k), ring(j, k + 1), ring(j + 1, k + 1), ring(j + 1, k)) for k in range(AROUND)]
    head = f"""ply
format binary_little_endian 1.0
comment made by still.py
element vertex {len(points)}
property float x
property float y
property float z
element face {len(faces)}
property list uchar ushort vertex_indices
end_header
"""
    with open(f"{name}.ply", "wb") as file:
        file.write(head.encode())
        for place in points:
            file.write(struct.pack("<3f", *place))
        for face in faces:
            file.write(struct.pack(f"<B{len(face)}H", len(face), *face))
