"""Writes earth.png, the map of a world that does not exist, and sky.png, an evening around it. Takes half a minute."""

import math
import random
import struct
import zlib

random.seed(23)
ORDER = list(range(256))
random.shuffle(ORDER)
ORDER += ORDER
SLOPES = [(a, b, c) for a in (-1, 0, 1) for b in (-1, 0, 1) for c in (-1, 0, 1) if abs(a) + abs(b) + abs(c) == 2]


def noise(x, y, z):
    """Perlin's noise, about -1 to 1."""
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    x, y, z = x - i, y - j, z - k
    u, v, w = (t * t * t * (t * (t * 6 - 15) + 10) for t in (x, y, z))
    i, j, k = i & 255, j & 255, k & 255
    ends = []
    for a in (0, 1):
        for b in (0, 1):
            at = ORDER[ORDER[i + a & 255] + j + b & 255]
            g, h = SLOPES[ORDER[at + k] % 12], SLOPES[ORDER[at + (k + 1 & 255)] % 12]
            low = g[0] * (x - a) + g[1] * (y - b) + g[2] * z
            high = h[0] * (x - a) + h[1] * (y - b) + h[2] * (z - 1)
            ends.append(low + w * (high - low))
    near, far = ends[0] + v * (ends[1] - ends[0]), ends[2] + v * (ends[3] - ends[2])
    return near + u * (far - near)


def clouds(p, octaves, rough=0.5):
    total, size = 0.0, 1.0
    for _ in range(octaves):
        total += size * noise(*p)
        p, size = [2.03 * a + 7.1 for a in p], size * rough
    return total


def write(name, width, rows, palette=None):
    """Writes a PNG of indices into a palette, or of colours."""
    part = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">2I5B", width, len(rows), 8, 3 if palette else 2, 0, 0, 0)
    colours = part(b"PLTE", bytes(c for colour in palette for c in colour)) if palette else b""
    # Colours as differences from the row above, which are small numbers.
    data, above = bytearray(), bytes(3 * width)
    for row in rows:
        data += b"\0" + row if palette else b"\2" + bytes(a - b & 255 for a, b in zip(row, above))
        above = row
    with open(name, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + colours)
        file.write(part(b"IDAT", zlib.compress(bytes(data), 9)) + part(b"IEND", b""))


def direction(width, column, row):
    """The direction of a pixel as `ball` and `Sky` have it, up to the turn around y."""
    a, b = 2 * math.pi * (column + 0.5) / width, math.pi * (row + 0.5) / (width / 2)
    return -math.sin(b) * math.sin(a), math.cos(b), -math.sin(b) * math.cos(a)


# Heights of land and sea, and the tints of an atlas from one to the next.
TINTS = [
    (-9.0, (13, 47, 92)),
    (-0.62, (20, 66, 118)),
    (-0.4, (33, 92, 145)),
    (-0.2, (62, 129, 173)),
    (-0.07, (112, 172, 200)),
    (-0.012, (58, 84, 82)),
    (0.008, (128, 152, 92)),
    (0.11, (170, 178, 112)),
    (0.24, (214, 198, 134)),
    (0.38, (206, 162, 98)),
    (0.53, (166, 112, 68)),
    (0.68, (118, 78, 54)),
    (0.95, (240, 238, 232)),
]
ICE = (233, 240, 244)
STEPS = 4


def height(p):
    bend = [a + 0.45 * noise(1.7 * b + 3, 1.7 * c - 5, 1.7 * a + 9) for a, b, c in zip(p, p[1:] + p[:1], p[2:] + p[:2])]
    base = clouds([1.25 * a + 11 for a in bend], 7, 0.54) - 0.1
    ridge = 1 - 2.4 * abs(noise(*(2.6 * a + 31 for a in bend)))
    return 1.15 * base + max(0.0, base + 0.05) * max(0.0, ridge) * 1.1


def earth(width):
    palette = []
    for (_, low), (_, high) in zip(TINTS, TINTS[1:] + [(0, ICE)]):
        palette += [tuple(round(a + (b - a) * k / STEPS) for a, b in zip(low, high)) for k in range(STEPS)]
    palette += [ICE]
    lines = [tuple(round(0.72 * c) for c in colour) for colour in palette]
    rows = []
    for y in range(width // 2):
        row = bytearray()
        for x in range(width):
            p = list(direction(width, x, y))
            h = height(p)
            tint = max(k for k, (low, _) in enumerate(TINTS) if h >= low)
            level = STEPS * tint
            if tint + 1 < len(TINTS):
                # Within a pixel of the next tint they mix.
                level += max(0, STEPS - 1 - int((TINTS[tint + 1][0] - h) / 0.0022))
            cold = abs(p[1]) + 0.05 * noise(*(5 * a for a in p)) + 0.06 * (h > 0) + 0.03 * noise(*(17 * a for a in p))
            if cold > (1.0 if p[1] > 0 else 0.985):
                level = len(palette) - 1
            # A line for each 15 degrees, but not up to the poles.
            step = width // 24
            on_line = (x % step == 0 and abs(p[1]) < 0.97) or (y % step == 0 and y > 0)
            row.append(level + len(palette) * on_line)
        rows.append(bytes(row))
    write("earth.png", width, rows, palette + lines)


def sky(width):
    """Blue above, gold at the horizon, clouds that are lit from below, and a dark land."""
    mix = lambda a, b, t: [p + (q - p) * min(1, max(0, t)) for p, q in zip(a, b)]
    rows = []
    for y in range(width // 2):
        row = bytearray()
        for x in range(width):
            d = direction(width, x, y)
            sun = max(0.0, d[0] * -0.72 + d[1] * 0.16 + d[2] * -0.67)
            up = max(0.0, d[1])
            c = mix([0.98, 0.62, 0.36], [0.5, 0.52, 0.68], up / 0.32)
            c = mix(c, [0.1, 0.19, 0.42], (up - 0.12) / 0.7)
            c = [a + b * sun**6 for a, b in zip(c, (0.45, 0.28, 0.08))]
            flat = [2.2 * d[0] / (up + 0.25), 1.2, 2.2 * d[2] / (up + 0.25)]
            thick = clouds(flat, 5) - 0.02
            lit = mix([0.62, 0.42, 0.46], [1.0, 0.72, 0.5], sun * 1.2 + 0.25 - up)
            c = mix(c, lit, 1.9 * thick * min(1.0, 9 * up))
            if d[1] < 0:
                c = mix([0.5, 0.36, 0.36], [0.16, 0.14, 0.17], -d[1] / 0.3)
            row += bytes(round(255 * min(1, max(0, a))) for a in c)
        rows.append(bytes(row))
    write("sky.png", width, rows)


earth(1024)
sky(400)
