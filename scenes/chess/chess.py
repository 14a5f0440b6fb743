"""Writes queen.ply, the queen of a game of chess as a lathe turns it, closed and with normals, and studio.png, the light around it."""

import math
import struct
import zlib

# Radius and height of the profile, from the middle of the foot to the top. The third number is how deep the crown is cut there.
PROFILE = [
    (0.3, 0, 0), (0.49, 0, 0), (0.53, 0.02, 0), (0.545, 0.07, 0), (0.53, 0.125, 0), (0.48, 0.155, 0),
    (0.45, 0.175, 0), (0.455, 0.205, 0), (0.44, 0.24, 0), (0.36, 0.3, 0), (0.275, 0.4, 0), (0.215, 0.56, 0),
    (0.178, 0.78, 0), (0.163, 1.02, 0), (0.17, 1.2, 0), (0.2, 1.3, 0), (0.26, 1.335, 0), (0.29, 1.36, 0),
    (0.26, 1.39, 0), (0.205, 1.405, 0), (0.22, 1.435, 0), (0.24, 1.455, 0), (0.22, 1.48, 0), (0.168, 1.5, 0),
    (0.17, 1.56, 0), (0.2, 1.68, 0), (0.255, 1.82, 0.3), (0.308, 1.945, 1), (0.296, 1.965, 1), (0.262, 1.945, 1),
    (0.2, 1.9, 0.25), (0.12, 1.89, 0), (0.06, 1.905, 0), (0.05, 1.925, 0), (0.082, 1.96, 0), (0.092, 2, 0),
    (0.07, 2.05, 0), (0.03, 2.075, 0),
]  # fmt: skip
AROUND = 48
CUT = 0.06


def between(s):
    """A curve through the points of the profile (Catmull-Rom); s counts points."""
    k = min(int(s), len(PROFILE) - 2)
    a, b, c, d = (PROFILE[min(max(k + i, 0), len(PROFILE) - 1)] for i in (-1, 0, 1, 2))
    t = s - k
    return [
        q + t / 2 * (r - p + t * (2 * p - 5 * q + 4 * r - e + t * (3 * (q - r) + e - p)))
        for p, q, r, e in zip(a, b, c, d)
    ]


def point(turn, s):
    r, y, cut = between(s)
    return r * math.sin(turn), y - CUT * cut * (0.5 - 0.5 * math.cos(8 * turn)), r * math.cos(turn)


def normal(turn, s):
    e = 1e-4
    last = len(PROFILE) - 1
    a = [q - p for p, q in zip(point(turn - e, s), point(turn + e, s))]
    b = [q - p for p, q in zip(point(turn, max(0, s - e)), point(turn, min(last, s + e)))]
    n = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    length = math.sqrt(sum(x * x for x in n))
    return tuple(x / length for x in n)


# A ring at each point of the profile, and halfway between those that are far apart or where the curve is tight.
rings = [k / 2 for k in range(2 * len(PROFILE) - 1) if k % 2 == 0 or 2 < k < 60]
points = [((0, 0, 0), (0, -1, 0))]
for s in rings:
    points += [(point(turn, s), normal(turn, s)) for turn in (2 * math.pi * k / AROUND for k in range(AROUND))]
points += [((0, PROFILE[-1][1] + 0.004, 0), (0, 1, 0))]

ring = lambda j, k: 1 + j * AROUND + k % AROUND
faces = [(0, ring(0, k + 1), ring(0, k)) for k in range(AROUND)]
for j in range(len(rings) - 1):
    faces += [(ring(j, k), ring(j, k + 1), ring(j + 1, k + 1), ring(j + 1, k)) for k in range(AROUND)]
faces += [(ring(len(rings) - 1, k), ring(len(rings) - 1, k + 1), len(points) - 1) for k in range(AROUND)]

head = f"""ply
format binary_little_endian 1.0
comment made by chess.py
element vertex {len(points)}
property float x
property float y
property float z
property float nx
property float ny
property float nz
element face {len(faces)}
property list uchar ushort vertex_indices
end_header
"""
with open("queen.ply", "wb") as file:
    file.write(head.encode())
    for place, across in points:
        file.write(struct.pack("<6f", *place, *across))
    for face in faces:
        file.write(struct.pack(f"<B{len(face)}H", len(face), *face))
print(len(points), "points,", len(faces), "faces")


def box(x, y, left, right, low, high, soft):
    """The share of light of a bright panel, soft at its edges. All in degrees."""
    edge = lambda a: min(1.0, max(0.0, a / soft))
    return edge(x - left) * edge(right - x) * edge(y - low) * edge(high - y)


# The studio, 2 degrees a pixel: a spot on the wall behind the queen, and three panels out of the picture.
WIDTH = 180
data = bytearray()
for row in range(WIDTH // 2):
    data.append(0)
    for column in range(WIDTH):
        x, y = 2 * column + 1 - 180, 90 - 2 * row - 1
        spot = math.exp(-((x / 17) ** 2) - ((y + 1) / 13) ** 2)
        colour = [a + b * spot for a, b in zip((0.02, 0.05, 0.1), (0.5, 0.35, 0.26))]
        for light, tint in (
            (box(x, y, -105, -50, -5, 62, 9), (1, 0.9, 0.76)),
            (box(x, y, 58, 78, -10, 70, 6), (0.62, 0.78, 1)),
            (box(x, y, 120, 170, 20, 75, 12), (0.5, 0.46, 0.42)),
        ):
            colour = [a + light * b for a, b in zip(colour, tint)]
        data += bytes(round(255 * min(1, a)) for a in colour)
part = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
with open("studio.png", "wb") as file:
    file.write(b"\x89PNG\r\n\x1a\n" + part(b"IHDR", struct.pack(">2I5B", WIDTH, WIDTH // 2, 8, 2, 0, 0, 0)))
    file.write(part(b"IDAT", zlib.compress(bytes(data), 9)) + part(b"IEND", b""))
