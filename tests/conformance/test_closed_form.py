"""The closed form of a phase by itself: the folder copied beside NumPy alone gives states and energies with the digits
of the 50-digit reference, and solves a stance.
"""

import json
import math
import random
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hopform_solver
from tests.oracle.reference.energy import energies
from tests.oracle.reference.motion import Flow, advance
from tests.oracle.reference.records import Point, State, mp, parse_robot

FIELDS = [field.name for field in hopform_solver.ROBOT_FIELDS]
PROGRAM = """
import json, sys
sys.path[:0] = [sys.argv[1]]
import numpy as np
import hopform_solver
from hopform_solver import formulas
from hopform_solver.records import LegState, Robot
from hopform_solver.solver import Chain

found = []
for asked in json.loads(sys.stdin.read()):
    robot = Robot(**asked["robot"])
    chain = Chain(robot, [(0.0, asked["u"])], LegState(*asked["start"]))
    state = LegState(*(float(each[0]) for each in chain.closed_form(tuple(asked["side"])).at(np.array([asked["t"]]))))
    found.append({"state": state._asdict(), "energy": formulas.energies(robot, state)._asdict()})
motion = hopform_solver.solve(robot, {"v2": -1.0}, horizon=0.5)
found.append({"status": motion.status, "duration": motion.duration})
assert not {name.partition(".")[0] for name in sys.modules} & {"hopform", "sympy", "scipy", "mpmath"}
print(json.dumps(found))
"""


def drawn_phases() -> list[dict[str, Any]]:
    """Ordinary ones, then those whose poles lie close: three of them, and a pair that is nearly critical."""
    draw = random.Random(20261128)
    phases = []
    for n in range(60):
        m_s, k = 10.0 ** draw.uniform(-1, 1), 10.0 ** draw.uniform(2, 4)
        m_eff, rate = m_s * 10.0 ** draw.uniform(-1, 1), math.sqrt(k / m_s)
        robot = dict.fromkeys(FIELDS, 0.0) | {"m_s": m_s, "k": k, "L0": 0.4, "c": 0.003, "f1": 0.7, "f2": 0.2}
        robot |= {"m_eff": m_eff, "gamma2": -20.0, "g": 9.81, "x1_min": -1e30, "x1_max": 1e30, "u_max": 9.0}
        robot |= {"b1": m_eff * rate * 10.0 ** draw.uniform(-3, 1), "b2": m_s * rate * 10.0 ** draw.uniform(-3, 0.5)}
        if n % 3 == 1:  # a = m w^2/..: the triple root of s^3 + b1/m_eff s^2 + (k/m_eff + k/m_s) s + b1 k/(m_eff m_s)
            robot |= {"m_eff": m_s / 8.0, "b2": 0.0, "b1": math.sqrt(27.0) * math.sqrt(k / m_s) * m_s / 8.0}
        if n % 3 == 2:
            near = 1.0 + draw.choice([0.0, 1e-12, -1e-7, 1e-4])
            robot |= {"b1": 2.0 * math.sqrt(k * m_eff) * near, "b2": 2.0 * math.sqrt(k * m_s) * near}
        side = draw.choice([(1, 1), (1, -1), (-1, 0), (0, 1)])
        start = [0.01, 0.4 * side[0], 1.5 * side[1], draw.uniform(0.0, 0.02)]
        phases.append({
            "robot": robot, "side": side, "start": start, "u": draw.uniform(-3.0, 3.0),
            "t": 10.0 ** draw.uniform(-3.0, 1.0) / rate,
        })  # fmt: skip
    return phases


def exactly(phase: dict[str, Any]) -> tuple[dict[str, Any], dict[str, float]]:
    """State and energies with 50 digits, and the sizes that their errors are measured by."""
    r, (one, other) = parse_robot(phase["robot"]), phase["side"]
    x1, v1, v2, y = map(mp.mpf, phase["start"])
    u, t = mp.mpf(phase["u"]), mp.mpf(phase["t"])
    n1 = (r.k * (r.c - y) - r.gamma2 * u) / r.m_eff - r.f1 * one
    n2 = r.k * y / r.m_s - r.g - r.f2 * other
    flow, first = Flow(r, (one != 0, other != 0)), Point(x1, v1, n1, v2, n2, y)
    end, rate = advance(flow, first, t), flow.rho
    body, total = energies(r, State(end.x1, end.v1, end.x1 - end.y + r.L0 + r.c, end.v2), end.y)
    found = {
        "state": {"x1": end.x1, "v1": end.v1, "v2": end.v2, "y": end.y},
        "energy": {"body": body, "total": total},
    }  # fmt: skip
    moved = max(abs(v1), abs(v2), abs(n1) / rate, abs(n2) / rate) * max(t, 1 / rate)
    length = max(abs(x1), abs(y), abs(end.x1), abs(end.y), moved)
    energy = (r.m_eff + r.m_s) * (length * rate) ** 2 + r.k * length**2 + r.m_s * r.g * (length + r.L0)
    sizes = {"x1": length, "y": length, "v1": length * rate, "v2": length * rate}
    sizes |= dict.fromkeys(("body", "total"), energy)
    return found, {name: float(size) for name, size in sizes.items()}


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package and NumPy, where nothing else is found."""
    folder = tmp_path_factory.mktemp("alone")
    shutil.copytree(Path(hopform_solver.__file__).parent, folder / "hopform_solver")
    packages = Path(np.__file__).parent.parent
    for each in [packages / "numpy", *packages.glob("numpy.libs")]:
        (folder / each.name).symlink_to(each)
    return folder


def test_states_and_energies_have_the_digits_of_the_reference(alone):
    phases = drawn_phases()
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", PROGRAM, alone], input=json.dumps(phases), capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    *found, solved = json.loads(done.stdout)
    worst = {"state": 0.0, "energy": 0.0}
    for ours, phase in zip(found, phases, strict=True):
        exact, sizes = exactly(phase)
        for kind, values in exact.items():
            assert ours[kind].keys() == values.keys()
            for name, value in values.items():
                worst[kind] = max(worst[kind], abs(float(mp.mpf(ours[kind][name]) - value)) / sizes[name])
    assert worst["state"] <= 4e-15 and worst["energy"] <= 4e-15, worst
    assert solved["status"] in hopform_solver.ENDINGS.values() and 0.0 < solved["duration"] <= 0.5
