"""Writes pendulum.txt to standard output: python3 pendulum.py > pendulum.txt"""

FRAMES, FIRST, COUNT = 112, 7, 11
# Half the angle of a swing in degrees, and the length of the longest thread.
ANGLE, LONGEST = 24, 2.35
# The colours from the first ball to the last, as linear light.
COLOURS = [
    (0.78, 0.05, 0.05),
    (0.85, 0.2, 0.03),
    (0.85, 0.5, 0.05),
    (0.1, 0.45, 0.16),
    (0.03, 0.4, 0.45),
    (0.05, 0.14, 0.6),
    (0.3, 0.06, 0.5),
]


def number(value, digits=4):
    return f"{value:.{digits}f}".rstrip("0").rstrip(".")


materials, groups, uses = [], [], []
lines = "\n".join
for i in range(COUNT):
    swings = FIRST + i
    length = LONGEST * (FIRST / swings) ** 2
    x = i * (len(COLOURS) - 1) / (COUNT - 1)
    j = min(int(x), len(COLOURS) - 2)
    colour = [number(a + (b - a) * (x - j), 3).removeprefix("0") for a, b in zip(COLOURS[j], COLOURS[j + 1])]
    dim = " ".join(number(0.05 * float(c), 3).removeprefix("0") or "0" for c in colour)
    name = "abcdefghijk"[i]
    materials.append(f"Material {name}   ambient {dim}   diffuse {' '.join(colour)}   mirror .06 .06 .06   shine .9 .9 .9 160")
    groups += [
        f"Group {name}",
        f"Cylinder .011   0 0 0   0 {-length:.3f} 0   thread",
        f"Sphere .19   0 {-length - 0.17:.3f} 0   {name}",
        "Sphere .035   0 0 0   brass",
        "End",
    ]
    period = FRAMES / swings
    keys = f"1:{ANGLE} {number(1 + period / 2)}:-{ANGLE} {number(1 + period)}:{ANGLE}"
    uses.append(f"Use {name}   0 2.9 {number(1.75 - i * 0.46)}   0 0 (smooth cycle {keys})")

print(
    f"""# pendulum: eleven pendulums. The first swings {FIRST} times in {FRAMES} frames, each other once more than the one before it. So they
# go apart in waves, meet in two rows, and are together again. The lengths are those of real pendulums: as one over the square.

Screen 240 180
Tone srgb
Samples 32 2
Depth 3
Look  1.3 2.15 6.3   .02 1.42 -.4   34
Background  .03 .032 .055
Fog  .03 .032 .055  30
Ilight  2.5 2.2 1.8   -1 -1.35 -.55   3

Material floor    ambient .022 .023 .03   diffuse .16 .15 .15
Material walnut   ambient .006 .003 .002   diffuse .16 .07 .035   mirror .03 .03 .03   shine .3 .3 .3 60
Material brass    diffuse .35 .24 .09   mirror .4 .3 .14   shine 1 .85 .5 100
Material thread   ambient .05 .05 .05   diffuse .6 .58 .52
{lines(materials)}

Plane  0 0 0   0 1 0   floor
Box  -.12 2.9 -3.35   .12 3.02 2.05   walnut
Cylinder .035   0 3 1.4   0 6 1.4   brass
Cylinder .035   0 3 -2.7   0 6 -2.7   brass

{lines(groups)}

{lines(uses)}

Frames {FRAMES}
Trace"""
)
