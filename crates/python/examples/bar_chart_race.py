"""A bar chart race: the bars grow with a table of numbers, and change places as they overtake each other."""

import sys

import rayfold as rf

# Trees planted by year, invented.
YEARS = [2018, 2020, 2022, 2024, 2026]
PLANTED = {
    "OAK": ("#d1495b", [30, 27, 22, 18, 14]),
    "ELM": ("#00798c", [22, 24, 25, 23, 21]),
    "FIR": ("#edae49", [18, 17, 19, 26, 30]),
    "ASH": ("#30638e", [16, 15, 12, 10, 9]),
    "YEW": ("#7a9e4f", [6, 11, 18, 24, 33]),
}
FRAMES_A_STEP = 24

# Letters as lines through points, in a field that is 4 wide and 6 high.
LETTERS = {
    "A": "00 26 40 , 12 32", "E": "46 06 00 40 , 03 33", "F": "00 06 46 , 03 33", "H": "00 06 , 40 46 , 03 43",
    "I": "20 26", "K": "00 06 , 46 03 40", "L": "06 00 40", "M": "00 06 23 46 40", "O": "10 30 41 45 36 16 05 01 10",
    "R": "00 06 36 45 44 33 03 , 23 40", "S": "01 10 30 41 42 33 13 04 05 16 36 45", "W": "06 10 24 30 46",
    "Y": "06 23 46 , 23 20", "0": "10 30 41 45 36 16 05 01 10", "1": "15 26 20", "2": "05 16 36 45 44 00 40",
    "4": "30 36 02 42", "6": "36 16 05 01 10 30 41 42 33 13 02", "8": "10 30 41 42 33 13 02 01 10 , 13 04 05 16 36 45 44 33",
}
PITCH = 5.6


def write(scene: rf.Scene, text: str, size: float, radius: float | rf.Curve, surface: rf.Material) -> None:
    """Letters as rods, centred around (0, 0, 0)."""
    left = (PITCH * len(text) - PITCH + 4) / 2
    for number, letter in enumerate(text):
        for line in LETTERS[letter].split(","):
            points = [(int(point[0]) + PITCH * number - left, int(point[1]) - 3) for point in line.split()]
            for (a, b), (c, d) in zip(points, points[1:]):
                scene.capsule(radius, (size * a, size * b, 0), (size * c, size * d, 0), surface)


def chart(samples: int = 16) -> rf.Scene:
    """One script of curves: bars, names and years that move, grow, and come and go."""
    scene = rf.Scene(400, 260, samples=samples, background=("#eef1f5", "#c9d6e4"))
    scene.look(eye=(1.2, 2.3, 8.2), at=(0, 1.42, 0), fov=30)
    scene.ilight("#fff8ec", (-0.8, -1.3, -1), angle=3)
    scene.plane((0, 0, 0), (0, 1, 0), diffuse="#b8c0ca", ambient="#282c30")
    frames = [1 + FRAMES_A_STEP * k for k in range(len(YEARS))]
    columns = list(zip(*(numbers for _, numbers in PLANTED.values())))
    white = rf.Material(diffuse="#f8f8f4", ambient=0.2)
    for number, (name, (color, numbers)) in enumerate(PLANTED.items()):
        # A little behind the last one, so that it passes behind it.
        z = -0.1 * number
        heights = [count / 14 for count in numbers]
        places = [sorted(column, reverse=True).index(count) for column, count in zip(columns, numbers)]
        xs = [-1.6 + 0.8 * place for place in places]
        x = rf.keys(dict(zip(frames, xs)), "smooth")
        left = rf.keys(dict(zip(frames, [x - 0.32 for x in xs])), "smooth")
        right = rf.keys(dict(zip(frames, [x + 0.32 for x in xs])), "smooth")
        top = rf.keys(dict(zip(frames, heights)), "inout")
        surface = rf.Material(diffuse=color, ambient=0.05, shine=(0.4, 60))
        scene.box((left, 0, z - 0.32), (right, top, z + 0.32), surface)
        with scene.group(name):
            write(scene, name, 0.03, 0.022, white)
        scene.use(name, (x, 0.2, z + 0.33))
    ink = rf.Material(diffuse="#2a3038", ambient=0.02)
    for year, frame in zip(YEARS, frames):
        # A year is there from halfway after the last one to halfway before the next.
        before, after = frame - FRAMES_A_STEP // 2, frame + FRAMES_A_STEP // 2
        radius = rf.keys({before - 1: 0, before: 0.035, after: 0}, "step")
        with scene.group(f"year{year}"):
            write(scene, str(year), 0.07, radius, ink)
        scene.use(f"year{year}", (0.95, 2.55, -0.6))
    scene.frames(frames[-1])
    return scene


if __name__ == "__main__":
    rf.animation(chart(), fps=24).save(sys.argv[1] if len(sys.argv) > 1 else "bar_chart_race.gif")
