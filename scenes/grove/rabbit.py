"""Writes rabbit.ply: a rabbit of balls that flow into one another, as triangles with normals."""

import math
import struct

# Centre and radii of each ball, then its turn around x in degrees.
BALLS = [
    ((0, 0.52, -0.1), (0.4, 0.46, 0.55), 0),  # body
    ((0, 0.62, 0.3), (0.27, 0.36, 0.27), 0),  # chest
    ((0, 1.06, 0.42), (0.27, 0.26, 0.31), 0),  # head
    ((0, 0.98, 0.66), (0.13, 0.12, 0.12), 0),  # nose
    ((0.12, 1.5, 0.28), (0.07, 0.36, 0.1), -14),  # ears
    ((-0.12, 1.5, 0.28), (0.07, 0.36, 0.1), -14),
    ((0.3, 0.3, -0.25), (0.18, 0.3, 0.32), 0),  # thighs
    ((-0.3, 0.3, -0.25), (0.18, 0.3, 0.32), 0),
    ((0.27, 0.09, 0.08), (0.11, 0.1, 0.32), 0),  # feet
    ((-0.27, 0.09, 0.08), (0.11, 0.1, 0.32), 0),
    ((0.13, 0.24, 0.44), (0.09, 0.26, 0.1), 8),  # forelegs
    ((-0.13, 0.24, 0.44), (0.09, 0.26, 0.1), 8),
    ((0, 0.42, -0.68), (0.15, 0.15, 0.15), 0),  # tail
]
FLOW = 0.06
STEP = 0.062
LOW, SIZE = (-0.62, -0.1, -0.95), (21, 35, 31)


def distance(p):
    """About the distance from the rabbit, below 0 within."""
    total = 0.0
    for center, radii, turn in BALLS:
        x, y, z = (a - b for a, b in zip(p, center))
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        y, z = c * y + s * z, c * z - s * y
        scaled = math.sqrt(sum((a / r) ** 2 for a, r in zip((x, y, z), radii)))
        slope = math.sqrt(sum((a / r**2) ** 2 for a, r in zip((x, y, z), radii)))
        near = scaled * (scaled - 1) / slope if slope > 0 else -min(radii)
        total += math.exp(min(-near / FLOW, 600))
    return -FLOW * math.log(max(total, 1e-250))


def normal(p):
    e = 1e-4
    g = [distance([a + e * (i == k) for i, a in enumerate(p)]) - distance([a - e * (i == k) for i, a in enumerate(p)]) for k in range(3)]
    length = math.sqrt(sum(a * a for a in g))
    return [a / length for a in g]


def mesh():
    """Surface nets: a point in each cell that the surface crosses, then moved onto it; two triangles for each crossed edge."""
    at = lambda i: [LOW[k] + STEP * i[k] for k in range(3)]
    cells = [(i, j, k) for i in range(SIZE[0]) for j in range(SIZE[1]) for k in range(SIZE[2])]
    value = {i: distance(at(i)) for i in cells}
    points, index = [], {}
    for i in cells:
        corners = [(i[0] + a, i[1] + b, i[2] + c) for a in (0, 1) for b in (0, 1) for c in (0, 1)]
        if any(c not in value for c in corners):
            continue
        crossings = []
        for a in corners:
            for axis in range(3):
                b = tuple(a[k] + (k == axis) for k in range(3))
                if b in corners and (value[a] < 0) != (value[b] < 0):
                    t = value[a] / (value[a] - value[b])
                    crossings.append([x + t * (y - x) for x, y in zip(at(a), at(b))])
        if crossings:
            p = [sum(c) / len(crossings) for c in zip(*crossings)]
            for _ in range(3):
                n, d = normal(p), distance(p)
                p = [x - d * y for x, y in zip(p, n)]
            index[i] = len(points)
            points.append(p)
    faces = []
    for i in cells:
        for axis in range(3):
            j = tuple(i[k] + (k == axis) for k in range(3))
            if j not in value or (value[i] < 0) == (value[j] < 0):
                continue
            u, v = [k for k in range(3) if k != axis]
            if axis == 1:
                u, v = v, u
            around = [tuple(i[k] - a * (k == u) - b * (k == v) for k in range(3)) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
            if any(c not in index for c in around):
                continue
            quad = [index[c] for c in around]
            if value[i] >= 0:
                quad.reverse()
            faces += [quad[:3], [quad[0], quad[2], quad[3]]]
    return points, faces


points, faces = mesh()
head = f"""ply
format binary_little_endian 1.0
comment made by rabbit.py
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
with open("rabbit.ply", "wb") as file:
    file.write(head.encode())
    for p in points:
        file.write(struct.pack("<6f", *p, *normal(p)))
    for face in faces:
        file.write(struct.pack("<B3H", 3, *face))
print(len(points), "points,", len(faces), "triangles")
