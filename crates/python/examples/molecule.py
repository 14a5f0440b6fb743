"""A molecule from an .xyz text: caffeine, as balls and sticks."""

import itertools
import sys

import numpy as np
from numpy.typing import NDArray

import rayfold as rf

CAFFEINE = """\
24
caffeine
H -3.3804130 -1.1272367  0.5733036
N  0.9668296 -1.0737425 -0.8198227
C  0.0567293  0.8527195  0.3923156
N -1.3751742 -1.0212243 -0.0570552
C -1.2615018  0.2590713  0.5234135
C -0.3068337 -1.6836331 -0.7169344
C  1.1394235  0.1874122 -0.2700900
N  0.5602627  2.0839095  0.8251589
O -0.4926797 -2.8180554 -1.2094732
C -2.6328073 -1.7303959 -0.0060953
O -2.2301338  0.7988624  1.0899730
H  2.5496990  2.9734977  0.6229590
C  2.0527432 -1.7360887 -1.4931279
H -2.4807715 -2.7269528  0.4882631
H -3.0089039 -1.9025254 -1.0498023
H  2.9176101 -1.8481516 -0.7857866
H  2.3787863 -1.1211917 -2.3743655
H  1.7189877 -2.7489920 -1.8439205
C -0.1518450  3.0970046  1.5348347
C  1.8934096  2.1181245  0.4193193
N  2.2861252  0.9968439 -0.2440298
H -0.1687028  4.0436553  0.9301094
H  0.3535322  3.2979060  2.5177747
H -1.2074498  2.7537592  1.7203047
"""

# The radius of each element as a ball, in angstroms, and its colour.
ELEMENTS = {"H": (0.25, "#f2f2f2"), "C": (0.38, "#404448"), "N": (0.36, "#3050f8"), "O": (0.35, "#ff2010")}
BOND = 1.65


def read_xyz(text: str) -> tuple[list[str], NDArray[np.float64]]:
    """The elements and the positions of the atoms, from the format's third line on."""
    rows = [line.split() for line in text.splitlines()[2:] if line.strip()]
    positions = np.array([[float(word) for word in row[1:4]] for row in rows])
    return [row[0] for row in rows], positions - positions.mean(axis=0)


def molecule(text: str = CAFFEINE, samples: int = 32) -> rf.Scene:
    elements, positions = read_xyz(text)
    scene = rf.Scene(400, 320, samples=samples, background=("#f4f6fa", "#b8c8dc"))
    scene.look(eye=(0, 2, 17), at=(0, -0.2, 0), fov=34)
    scene.ilight("#e8e4dc", (-0.7, -1, -1), angle=4)
    scene.ilight("#303640", (1, 0.3, -0.6))
    surfaces = {
        element: rf.Material(ambient=0.06, diffuse=color, shine=(0.5, 80)) for element, (_, color) in ELEMENTS.items()
    }
    with scene.group("molecule"):
        for element, position in zip(elements, positions):
            scene.sphere(ELEMENTS[element][0], position, surfaces[element])
        for a, b in itertools.combinations(range(len(elements)), 2):
            if np.linalg.norm(positions[a] - positions[b]) < (1.2 if "H" in (elements[a], elements[b]) else BOND):
                middle = (positions[a] + positions[b]) / 2
                scene.cylinder(0.1, positions[a], middle, surfaces[elements[a]])
                scene.cylinder(0.1, middle, positions[b], surfaces[elements[b]])
    turn = rf.keys({1: 0, 61: 360}, cycle=True)
    scene.use("molecule", rotation=(-25, turn, 0))
    scene.frames(60)
    return scene


if __name__ == "__main__":
    rf.animation(molecule(), fps=20).save(sys.argv[1] if len(sys.argv) > 1 else "molecule.gif")
