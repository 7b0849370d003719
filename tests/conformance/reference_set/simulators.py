"""The simulators of the page about the reference set: MuJoCo in two integrators and two time steps."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from hopform.reference import Case, smoothed, solve

LONGEST = 1.0
"""[s] after which a leg that has not taken off is given up."""


def in_mujoco(case: Case, integrator: str, timestep: float, stiffer: bool = False) -> dict[str, Any] | None:
    """The states of a case in MuJoCo, with its default constraints; None for one that MJCF cannot say.

    stiffer: friction with the time constant of two time steps, the least that MuJoCo takes, in place of its default of
    20 ms.
    """
    import mujoco

    if case.without["mjcf"]:
        return None
    model = mujoco.MjModel.from_xml_string(case.mjcf())
    model.opt.timestep, model.opt.integrator = timestep, getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    if stiffer:
        model.dof_solref[:] = 2.0 * timestep, 1.0
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    leg = case.family == "stance"
    last, most = round(float(case.times[-1]) / timestep), round(LONGEST / timestep)
    times, inputs = zip(*case.steps, strict=True)
    count = most if leg else last
    u = np.array(inputs)[np.searchsorted(times, (np.arange(count) + 0.5) * timestep, side="right") - 1]
    rows, values = [[*data.qpos, *data.qvel]], dict[str, float]()
    for n in range(count):
        data.ctrl[0] = u[n]
        before = compression(case, data) if leg else 0.0
        mujoco.mj_step(model, data)
        rows.append([*data.qpos, *data.qvel])
        if leg and not values and before > 0.0 >= (after := compression(case, data)):
            share = before / (before - after)
            _, x2, _, v2 = (a + share * (b - a) for a, b in zip(rows[-2], rows[-1], strict=True))
            apex = x2 + v2**2 / (2.0 * case.parameters["g"]) - case.parameters["L"]
            values = {"takeoff": timestep * (n + share), "apex": apex}
        if leg and values and n >= last:
            break
    table = np.array(rows)[np.rint(case.times / timestep).astype(int)]
    states = dict(zip((*case.positions, *case.velocities), table.T, strict=True))
    return {"states": states, "values": {name: values[name] for name in case.values if name in values}}


def compression(case: Case, data: Any) -> float:
    return float(data.qpos[0] - data.qpos[1] + case.parameters["L"])


SIMULATORS: dict[str, Callable[[Case], Any]] = {
    "hopform": solve,
    "MuJoCo, Euler, 2 ms": partial(in_mujoco, integrator="EULER", timestep=2e-3),
    "MuJoCo, implicitfast, 2 ms": partial(in_mujoco, integrator="IMPLICITFAST", timestep=2e-3),
    "MuJoCo, Euler, 0.1 ms": partial(in_mujoco, integrator="EULER", timestep=1e-4),
    "MuJoCo, implicitfast, 0.1 ms": partial(in_mujoco, integrator="IMPLICITFAST", timestep=1e-4),
    "smoothed, 0.1 ms": smoothed,
}
"""By the names of their columns on the page."""
