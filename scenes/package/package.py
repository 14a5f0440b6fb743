"""Writes carton.obj, a box with rounded edges and texture coordinates, and label.png, the picture that goes twice around it."""

import math
import struct
import zlib

WIDE, HIGH, DEEP = 1.2, 1.7, 0.7
EDGE = 0.025
# The picture: half of the way around, and above it a strip for the lid.
SCALE = 300
PART = WIDE + DEEP
LID = 0.2
COLUMNS, ROWS = round(PART * SCALE), round((HIGH + LID) * SCALE)

LAYERS = [  # height of the ridge, its waves, its colour
    (0.98, ((3, 0.085, 0.4), (5, 0.05, 2.0), (11, 0.018, 1.0), (23, 0.008, 3.0)), (226, 150, 118)),
    (0.79, ((2, 0.075, 2.2), (7, 0.04, 0.3), (13, 0.016, 2.0), (29, 0.006, 1.0)), (176, 112, 108)),
    (0.6, ((3, 0.06, 3.9), (4, 0.05, 1.2), (17, 0.012, 0.5), (31, 0.005, 2.0)), (96, 88, 98)),
    (0.43, ((2, 0.05, 5.6), (5, 0.03, 4.0), (19, 0.008, 1.5)), (40, 68, 74)),
    (0.27, ((1, 0.02, 1.0), (4, 0.016, 2.0)), (16, 42, 44)),
]
GREEN, GOLD = (16, 42, 44), (222, 176, 98)


def colour(s, y):
    """The colour at a place: s along the side from the middle of the front, y above the table, in units of the box."""
    cover = lambda d: min(1.0, max(0.0, 0.5 + d * SCALE))
    over = lambda a, b, t: [p + (q - p) * t for p, q in zip(a, b)]
    c = over((250, 222, 172), (92, 138, 150), min(1, max(0, (y - 0.95) / 0.75)) ** 0.8)
    across, up = s, y - 1.1
    far = math.hypot(across, up)
    # The sun, and rings around it.
    for ring in (0.5, 0.41):
        c = over(c, (255, 236, 190), 0.28 * cover(ring - far))
    c = over(c, (255, 244, 214), cover(0.3 - far))
    for height, waves, tint in LAYERS:
        ridge = height + sum(a * math.sin(n * 2 * math.pi * s / PART + p) for n, a, p in waves)
        misty = min(1.0, max(0.0, (ridge - y) / 0.32)) if tint != GREEN else 0
        c = over(c, over(tint, (250, 214, 176), 0.3 * misty), cover(ridge - y))
    for line, wide in ((HIGH - 0.075, 0.012), (HIGH - 0.105, 0.004), (0.075, 0.012), (0.105, 0.004)):
        c = over(c, GOLD, cover(wide - abs(y - line)))
    return over(c, GREEN, max(cover(y - HIGH + 0.063), cover(0.063 - y)))


rows = []
for row in range(ROWS):
    y = HIGH + LID - (row + 0.5) / SCALE
    line = [colour(((x + 0.5) / SCALE + PART / 2) % PART - PART / 2, y) for x in range(COLUMNS)]
    rows.append(bytes(min(255, round(c / 4) * 4) for pixel in line for c in pixel))
data, above = bytearray(), bytes(3 * COLUMNS)
for row in rows:
    data += b"\2" + bytes(a - b & 255 for a, b in zip(row, above))
    above = row
part = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
with open("label.png", "wb") as file:
    file.write(b"\x89PNG\r\n\x1a\n" + part(b"IHDR", struct.pack(">2I5B", COLUMNS, ROWS, 8, 2, 0, 0, 0)))
    file.write(part(b"IDAT", zlib.compress(bytes(data), 9)) + part(b"IEND", b""))

# The box: three points near each corner, one on each face there. The faces are flat; edges and corners are smooth.
lines = ["# made by package.py"]
HALF = (WIDE / 2, HIGH / 2, DEEP / 2)
SIGNS = [(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]
index, places, marks = {}, {}, {}
for signs in SIGNS:
    for axis in range(3):
        x, y, z = (s * (h - EDGE * (k != axis)) for k, (s, h) in enumerate(zip(signs, HALF)))
        y += HIGH / 2
        normal = [s * (k == axis) for k, s in enumerate(signs)]
        # The way along the side from the middle of the front, to the right.
        if axis == 1:
            u, v = x / 8, HIGH + LID / 2 + z / 8 if y > HIGH / 2 else 0.02
        else:
            right = {(1, 1): (0, 0), (1, -1): (1, 1), (-1, -1): (2, 2), (-1, 1): (3, 3)}[signs[0], signs[2]]
            corner = WIDE / 2 + right[0] * PART / 2 + (DEEP - WIDE) / 2 * (right[0] % 2)
            turn = {(0, 0): 1, (0, 2): -1, (1, 0): -1, (1, 2): 1, (2, 0): 1, (2, 2): -1, (3, 0): -1, (3, 2): 1}
            u, v = corner + EDGE * turn[right[0], axis], y
        index[signs, axis] = len(index) + 1
        places[signs, axis] = u, v
        lines.append(f"v {x:.4f} {y:.4f} {z:.4f}")
        lines.append("vn " + " ".join(str(a) for a in normal))


def face(*corners):
    # Outwards: in the direction in which the corners lie.
    points = [[s * (h - EDGE * (k != axis)) for k, (s, h) in enumerate(zip(signs, HALF))] for signs, axis in corners]
    (a, b, c), middle = points[:3], [sum(p) for p in zip(*points)]
    p, q = [y - x for x, y in zip(a, b)], [y - x for x, y in zip(a, c)]
    out = (p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0])
    if sum(x * y for x, y in zip(out, middle)) < 0:
        corners = corners[::-1]
    # The front goes on to the left of its middle where the left side has ended.
    least = min(places[corner][0] for corner in corners)
    words = []
    for corner in corners:
        u, v = places[corner]
        mark = (u - 2 * PART * (u - least > PART)) / PART, v / (HIGH + LID)
        if mark not in marks:
            marks[mark] = len(marks) + 1
            lines.append(f"vt {mark[0]:.5f} {mark[1]:.5f}")
        words.append(f"{index[corner]}/{marks[mark]}/{index[corner]}")
    lines.append("f " + " ".join(words))


def at(axis, side, a, b):
    signs = [a, b]
    signs.insert(axis, side)
    return tuple(signs)


for axis in range(3):
    for side in (-1, 1):
        face(*(((at(axis, side, a, b)), axis) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))))
    first, second = (k for k in range(3) if k != axis)
    for a in (-1, 1):
        for b in (-1, 1):
            low, high = at(axis, -1, a, b), at(axis, 1, a, b)
            face((low, first), (low, second), (high, second), (high, first))
for signs in SIGNS:
    face((signs, 0), (signs, 1), (signs, 2))
with open("carton.obj", "w", encoding="ascii") as file:
    file.write("\n".join(lines) + "\n")
