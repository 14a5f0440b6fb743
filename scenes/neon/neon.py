"""Writes bricks.png, a wall of bricks that repeats: eight courses of four."""

import random
import struct
import zlib

random.seed(5)
LONG, HIGH, JOINT = 48, 16, 2
WIDTH, HEIGHT = 4 * LONG, 8 * HIGH
tints = [(112, 60, 48), (126, 68, 52), (98, 54, 46), (136, 80, 60), (88, 50, 46), (118, 72, 58)]
bricks = {(i, j): random.choice(tints) for i in range(4) for j in range(8)}
data = bytearray()
for y in range(HEIGHT):
    data.append(0)
    for x in range(WIDTH):
        j = y // HIGH
        along, up = (x + LONG // 2 * (j % 2)) % WIDTH, y % HIGH
        if along % LONG < JOINT or up < JOINT:
            colour = (70, 66, 64)
        else:
            # Darker at the lower edge, as if it stood out, and a little of its own everywhere.
            light = 1 + 0.05 * random.uniform(-1, 1) - 0.22 * (up == HIGH - 1) + 0.12 * (up == JOINT)
            colour = [light * c for c in bricks[along // LONG, j]]
        data += bytes(round(c / 4) * 4 for c in colour)
part = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
with open("bricks.png", "wb") as file:
    file.write(b"\x89PNG\r\n\x1a\n" + part(b"IHDR", struct.pack(">2I5B", WIDTH, HEIGHT, 8, 2, 0, 0, 0)))
    file.write(part(b"IDAT", zlib.compress(bytes(data), 9)) + part(b"IEND", b""))
