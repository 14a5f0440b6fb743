"""Writes marbles.txt: marbles on four ramps and a lift, by the equations of motion.

    python3 marbles.py > marbles.txt

A marble that rolls on two rails is slower than one that slides: it touches them beside its middle, and has to turn.
Where a ramp ends it flies, hits the wall, and falls on the next. All marbles do the same, one after the other, so that
each shows another part of the way, and frame 49 would be frame 1.
"""

from math import atan, cos, degrees, pi, sin, sqrt

R, RAIL, HALF_GAP = 0.3, 0.06, 0.17  # the marble, a rail, and half of what is between the rails' middles
ABOVE = sqrt((R + RAIL) ** 2 - HALF_GAP**2)  # the marble's middle above the rails'
ROLLING = ABOVE * R / (R + RAIL)  # how far it goes in a radian
SLOW = 1 / (1 + 0.4 * (R / ROLLING) ** 2)  # share of gravity along a ramp that moves it
GRAVITY = 9.81
SLOPE = 0.14
REACH, WALL, LIFT = 2.2, 2.85, 3.65  # where ramps end, where walls stop the marble's middle, where the lift is
TOPS = [3.75, 2.55, 1.35, 0.15]  # height of the marble's middle on each ramp at its beginning, REACH beside the middle
FRAMES, MARBLES, LIFTED = 48, 5, 60  # of the animation; of a marble in the lift


def ramp(number, x):
    """Height of a marble's middle on a ramp."""
    return TOPS[number] - SLOPE * (side(number) * x + REACH)


def side(number):
    """Where a ramp leads: to the right or to the left."""
    return 1 if number % 2 == 0 else -1


def way_down():
    """(x, y, angle) at equal steps of time, from the lift's top to its bottom."""
    dt = 0.0005
    x, y, vx, vy, angle, way = -LIFT, ramp(0, -LIFT), 0.0, 0.0, 0.0, []
    for number in range(4):
        to, spin = side(number), 0.0
        while to * x < (LIFT if number == 3 else REACH):  # on the ramp
            vx += to * SLOW * GRAVITY * sin(atan(SLOPE)) * cos(atan(SLOPE)) * dt
            x += vx * dt
            y, spin = ramp(number, x), -vx * sqrt(1 + SLOPE**2) / ROLLING
            angle += spin * dt
            way.append((x, y, angle))
        if number == 3:
            return way
        vy = -SLOPE * abs(vx)
        while y > ramp(number + 1, x):  # in the air
            vy -= GRAVITY * dt
            x, y, angle = x + vx * dt, y + vy * dt, angle + spin * dt
            if to * x > WALL and to * vx > 0:
                vx *= -0.3
            way.append((x, y, angle))


def frames():
    """(x, y, angle) of all frames from one top to the next, the first one again at the end."""
    down, count = way_down(), FRAMES * MARBLES - LIFTED
    way = [down[k * (len(down) - 1) // count] for k in range(count + 1)]
    (_, low, spun), high = way[-1], way[0][1]
    turns = 2 * pi * round(spun / (2 * pi))
    for k in range(1, LIFTED + 1):  # upwards
        share = k / LIFTED
        way.append((-LIFT, low + (high - low) * share, spun + (turns - spun) * share))
    return [(x, y, degrees(angle)) for x, y, angle in way]


def number(x):
    text = f"{x:.3f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def curve(values):
    return "(smooth " + " ".join(f"{1 + 2 * k}:{number(x)}" for k, x in enumerate(values[::2])) + ")"


def rails():
    for n in range(4):
        start, end = -side(n) * (LIFT if n == 0 else 3.1), side(n) * (LIFT if n == 3 else REACH + 0.1)
        low, high = (number(ramp(n, x) - ABOVE) for x in (end, start))
        for z in (-HALF_GAP, HALF_GAP):
            yield f"Cylinder {RAIL}   {number(start)} {high} {z}   {number(end)} {low} {z}   steel"
        for share in (0.08, 0.36, 0.64, 0.92):
            x = start + share * (end - start)
            yield f"Use tie  {number(x)} {number(ramp(n, x) - ABOVE)} 0"
        if n < 3:
            x, y = side(n) * (WALL + R), ramp(n + 1, side(n) * WALL)
            x, wide = (x, 0.09) if n != 1 else (x, -0.09)
            yield f"Box  {number(x)} {number(y - 0.45)} -0.4   {number(x + wide)} {number(y + 1)} 0.4   wall"


STAGE = """\
# marbles: five of them roll down four ramps, fall from each to the next, and are lifted again.
#
# Written by marbles.py, which knows the equations of motion.

Screen 320 240
Tone srgb
Samples 32 1.5
Shutter 0.4
Look  2.6 3.7 11.5   -0.15 1.72 0   34
Background  0.5 0.48 0.45   0.3 0.42 0.6
Ilight  1.3 1.15 0.95   -0.55 -1.5 -0.75   3

Material grain   diffuse 0.22 0.09 0.035
Material wood    ambient 0.01 0.006 0.004   diffuse 0.4 0.21 0.09   mirror 0.04 0.04 0.04   noise 0.13 grain
Material wall    ambient 0.01 0.006 0.004   diffuse 0.42 0.1 0.05   shine 0.3 0.3 0.3 40
Material plaster ambient 0.11 0.14 0.15      diffuse 0.3 0.4 0.42
Material steel   ambient 0.03 0.03 0.035   diffuse 0.16 0.17 0.19     mirror 0.45 0.45 0.47   shine 0.9 0.9 0.9 120
Material brass   diffuse 0.35 0.22 0.06     mirror 0.3 0.22 0.1     shine 1 0.8 0.4 80
Material cream   ambient 0.06 0.055 0.045   diffuse 0.85 0.78 0.62     mirror 0.06 0.06 0.06
Material marble  ambient 0.06 0.01 0.005   diffuse 0.75 0.09 0.04   mirror 0.06 0.06 0.06   shine 0.9 0.9 0.9 120   stripes 0.15 cream

Plane  0 0 -2.6   0 0 1   plaster
Box  -4.6 -1.3 -1.7   4 -0.95 1.5   wood
Cylinder 0.12   3.35 -0.95 -0.62   3.35 4.1 -0.62   wood
Cylinder 0.12   -2.95 -0.95 -0.62   -2.95 4.6 -0.62   wood
Sphere 0.2      3.35 4.2 -0.62   brass
Sphere 0.2      -2.95 4.7 -0.62   brass

Group tie
Cylinder 0.045   0 -0.03 -0.62   0 -0.03 0.25   brass
End

Group cup
Cone 0.09 0.26   0 -0.16 0   0 -0.02 0   brass
Torus 0.24 0.035   0 0 0   0 1 0   brass
Cylinder 0.03   0 -0.1 0   0 -0.1 -0.6   steel
End

Group marble
Sphere 0.3   0 0 0   marble
End
"""

print(STAGE)
print("\n".join(rails()))
way = frames()
low = way[FRAMES * MARBLES - LIFTED][1] - R
high = way[-1][1] - R
print(f"\n# The lift: cups go up in front and down behind.\nCylinder 0.06   {-LIFT} -0.95 -0.62   {-LIFT} 4.7 -0.62   steel")
start = (FRAMES * MARBLES - LIFTED) % FRAMES
loop = 3 * FRAMES
for cup in range(3):
    keys_y, keys_z = [], []
    first = 1 + start - FRAMES * cup
    for again in (-loop, 0, loop):
        t = first + again
        keys_y += [(t, low), (t + LIFTED, high), (t + LIFTED + 8, high), (t + loop - 8, low)]
        keys_z += [(t, 0), (t + LIFTED, 0), (t + LIFTED + 8, -1.0), (t + loop - 8, -1.0)]
    y, z = (" ".join(f"{t}:{number(v)}" for t, v in keys) for keys in (keys_y, keys_z))
    print(f"Use cup  {-LIFT} ({y}) ({z})")
print("\n# The marbles, each on another part of the way.")
for k in range(MARBLES):
    part = way[FRAMES * k : FRAMES * (k + 1) + 1]
    x, y, angle = (curve([place[i] for place in part]) for i in range(3))
    print(f"Use marble  {x} {y} 0   0 0 {angle}")
print("\nFrames 48\nTrace")
