"""How far controllers miss on even and on rough ground, and how long hops and maps take:
`python -m tests.bench.hopping`.
"""

import numpy as np

import hopform
import hopform.hopping
from hopform.hopping import terrain
from hopform.hopping.controllers import AsPrinted, FeedForward, ReturnMap
from tests.bench.beside import hopping

H_DES, HOPS = 0.20, 20
CONTROLLERS = {
    "exact": FeedForward(H_DES),
    "as printed": AsPrinted(H_DES),
    "as printed, without the 1/2, signed, with the spring coordinate": AsPrinted(
        H_DES, half=False, signed=True, spring_coordinate=True
    ),
    "Hopper B's first": ReturnMap(H_DES),
}


def misses() -> list[str]:
    """A row per controller: mean and largest error of the apex [cm], even and rough, from the second hop on."""
    robot = hopform.load_robot("hopper_c")
    grounds = (terrain.flat(HOPS), terrain.uniform(HOPS, 0.02, seed=1))
    rows: list[str] = []
    for name, controller in CONTROLLERS.items():
        cells: list[str] = []
        for ground in grounds:
            run = hopform.hopping.simulate(robot, ground, controller, height=H_DES)
            miss = 100.0 * np.abs(run.table["apex"][1:] - H_DES)
            cells.append(f"{miss.mean():.2g}, {miss.max():.2g} cm")
        rows.append(f"| {name} | {' | '.join(cells)} |")
    return rows


if __name__ == "__main__":
    print(*misses(), sep="\n")
    for line in hopping(15):
        print(f"{line.name}: {line.value:.2f} {line.unit}, {line.ratio:.1f} stances in C")
