"""Memory while 10,000 frames are drawn and encoded, and whether it grows with their number."""

import gc
import os
import tempfile

import rayfold as rf

FRAMES = 10_000


def frame(t):
    scene = rf.Scene(160, 120, background="#203040")
    scene.look((0, 2, 8), (0, 1, 0), 34)
    scene.ilight("#ffffff", (1, -1, -0.5))
    for i in range(20):
        scene.sphere(0.3, (i / 2 - 5, 1 + (t * (i + 1)) % 2, 0), rf.Material(diffuse=(i / 20, t % 1, 0.5)))
    return scene


def resident():
    """The memory in use, in KiB."""
    gc.collect()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024


def drawn():
    for number, _ in enumerate(rf.animation(frame, frames=FRAMES, fps=100).frames(progress=False), 1):
        yield number


def encoded():
    def counted(t):
        counted.number += 1
        seen.append(counted.number)
        return frame(t)

    counted.number, seen = 0, []
    film = rf.animation(counted, frames=FRAMES, fps=50)
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "film.gif")
        encoder = None
        for number, image in enumerate(film._drawn(False), 1):
            encoder = encoder or rf._rayfold.Encoder(out, "gif", image.size, FRAMES, 50, 0, None, False)
            encoder.push(image, None)
            yield number
        encoder.finish()


def run():
    marks = (100, 1000, 2000, 4000, 6000, 8000, FRAMES)
    print("| KiB in use after frames | " + " | ".join(map(str, marks)) + " |")
    print("| --- |" + " ---: |" * len(marks))
    grown = []
    for name, work in (("drawn", drawn), ("encoded as GIF", encoded)):
        used = [resident() for number in work() if number in marks]
        grown.append(used[-1] - used[1])
        print(f"| {name} | " + " | ".join(f"{kib:,}" for kib in used) + " |")
    print(f"grown from frame 1,000 to {FRAMES:,}: " + ", ".join(f"{kib:,} KiB" for kib in grown))
    return int(max(grown) > 20_000)
