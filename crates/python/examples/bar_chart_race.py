"""A bar chart race: the bars grow with a table of numbers, and change places as they overtake each other."""

import sys

import rayfold as rf

# Shares of a market by year, invented.
YEARS = [2018, 2020, 2022, 2024, 2026]
SHARES = {
    "#d1495b": [30, 27, 22, 18, 14],
    "#00798c": [22, 24, 25, 23, 21],
    "#edae49": [18, 17, 19, 26, 30],
    "#30638e": [16, 15, 12, 10, 9],
    "#7a9e4f": [6, 11, 18, 24, 33],
}
FRAMES_A_STEP = 24


def chart(samples: int = 16) -> rf.Scene:
    """One script of curves: a bar is a box of height 1 in a group, which is moved and scaled."""
    scene = rf.Scene(400, 260, samples=samples, background=("#eef1f5", "#c9d6e4"))
    scene.look(eye=(2.2, 2.6, 7.5), at=(-0.1, 1.05, 0), fov=30)
    scene.ilight("#fff8ec", (-0.8, -1.3, -1), angle=3)
    scene.plane((0, 0, 0), (0, 1, 0), diffuse="#b8c0ca", ambient="#282c30")
    frames = [1 + FRAMES_A_STEP * k for k in range(len(YEARS))]
    for color, shares in SHARES.items():
        heights = [share / 14 for share in shares]
        places = [sorted(column, reverse=True).index(share) for column, share in zip(zip(*SHARES.values()), shares)]
        xs = [-1.6 + 0.8 * place for place in places]
        x = rf.keys(dict(zip(frames, xs)), "smooth")
        left = rf.keys(dict(zip(frames, [x - 0.28 for x in xs])), "smooth")
        right = rf.keys(dict(zip(frames, [x + 0.28 for x in xs])), "smooth")
        top = rf.keys(dict(zip(frames, heights)), "inout")
        surface = rf.Material(diffuse=color, ambient=0.05, shine=(0.4, 60))
        scene.box((left, 0, -0.28), (right, top, 0.28), surface)
        above = rf.keys(dict(zip(frames, [height + 0.22 for height in heights])), "inout")
        scene.sphere(0.16, (x, above, 0), surface)
    scene.frames(frames[-1])
    return scene


if __name__ == "__main__":
    rf.animation(chart(), fps=24).save(sys.argv[1] if len(sys.argv) > 1 else "bar_chart_race.gif")
