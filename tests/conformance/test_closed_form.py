"""The room of the formulas by itself: the folder copied beside NumPy alone gives states, energies and the ledger of a
phase, for many robots and times at once, with the digits of the 50-digit reference.
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
from tests.oracle.reference.energy import energies, work
from tests.oracle.reference.motion import Flow, advance
from tests.oracle.reference.records import Point, State, mp, parse_robot

FIELDS = [field.name for field in hopform_solver.ROBOT_FIELDS]
PROGRAM = """
import json, sys
sys.path[:0] = [sys.argv[1]]
import numpy as np
from hopform_solver import formulas
from hopform_solver.ledgers import ledger_over
from hopform_solver.phases import Phase, plan_of, state_in_phase
from hopform_solver.records import LegState, Robot

asked = json.loads(sys.stdin.read())
robot, start, side = (np.array(asked[name]) for name in ("robot", "start", "side"))
phase = Phase(plan_of(Robot(*robot)), LegState(*start), np.array(asked["u"]), side)
t = np.array(asked["t"])
state = state_in_phase(phase, t)
found = {"state": state._asdict(), "energy": formulas.energies(phase.plan.robot, state)._asdict()}
found["ledger"] = ledger_over(phase, t)._asdict()
assert not {name.partition(".")[0] for name in sys.modules} & {"hopform", "sympy", "scipy", "mpmath"}
print(json.dumps({kind: {name: np.broadcast_to(values, t.shape).tolist() for name, values in of.items()}
                  for kind, of in found.items()}))
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
    """State, energies and ledger with 50 digits, and the sizes that their errors are measured by."""
    r, (one, other) = parse_robot(phase["robot"]), phase["side"]
    x1, v1, v2, y = map(mp.mpf, phase["start"])
    u, t = mp.mpf(phase["u"]), mp.mpf(phase["t"])
    n1 = (r.k * (r.c - y) - r.gamma2 * u) / r.m_eff - r.f1 * one
    n2 = r.k * y / r.m_s - r.g - r.f2 * other
    flow, first = Flow(r, (one != 0, other != 0)), Point(x1, v1, n1, v2, n2, y)
    end, rate = advance(flow, first, t), flow.rho
    body, total = energies(r, State(end.x1, end.v1, end.x1 - end.y + r.L0 + r.c, end.v2), end.y)
    entries = work(flow, (one, other), u, first, t)
    entries.pop("stop_loss")
    found = {
        "state": {"x1": end.x1, "v1": end.v1, "v2": end.v2, "y": end.y},
        "energy": {"body": body, "total": total}, "ledger": entries,
    }  # fmt: skip
    moved = max(abs(v1), abs(v2), abs(n1) / rate, abs(n2) / rate) * max(t, 1 / rate)
    length = max(abs(x1), abs(y), abs(end.x1), abs(end.y), moved)
    energy = (r.m_eff + r.m_s) * (length * rate) ** 2 + r.k * length**2 + r.m_s * r.g * (length + r.L0)
    sizes = {"x1": length, "y": length, "v1": length * rate, "v2": length * rate}
    sizes |= dict.fromkeys(("body", "total", *entries), energy + abs(r.gamma2 * u) * length + r.k * r.c * length)
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


def test_states_energies_and_ledger_have_the_digits_of_the_reference(alone):
    phases = drawn_phases()
    columns = {
        "robot": [[phase["robot"][name] for phase in phases] for name in FIELDS],
        "start": [[phase["start"][axis] for phase in phases] for axis in range(4)],
        "side": [[float(phase["side"][element]) for phase in phases] for element in range(2)],
        "u": [phase["u"] for phase in phases],
        "t": [phase["t"] for phase in phases],
    }
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", PROGRAM, alone], input=json.dumps(columns), capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found, worst = json.loads(done.stdout), {"state": 0.0, "energy": 0.0, "ledger": 0.0}
    for n, phase in enumerate(phases):
        exact, sizes = exactly(phase)
        for kind, values in exact.items():
            assert found[kind].keys() == values.keys()
            for name, value in values.items():
                error = abs(float(mp.mpf(found[kind][name][n]) - value)) / sizes[name]
                worst[kind] = max(worst[kind], error)
    assert worst["state"] <= 4e-15 and worst["energy"] <= 4e-15 and worst["ledger"] <= 4e-15, worst
