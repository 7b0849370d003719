"""How far a stance of hopform is from the 50-digit reference, in the units of the accuracy measure.

    time/max(T, sqrt(m_s/k))   position/0.1 m   velocity/(1 m/s)   energy/(m_s max(|v2|, 1 m/s)^2/2)

The error is divided by the condition number of the reference where that is above 1; it is computed only where the
plain error is above the tolerance, because it costs a solution per input.
"""

import math
import random
from typing import Any

import numpy as np

import hopform
from tests import reference

TOLERANCE = {np.float64: 1e-12, np.float32: 1e-5}


def rounded(robot: hopform.Robot, dtype: Any) -> dict[str, float]:
    """The parameters as the solver sees them."""
    return {field.name: float(dtype(getattr(robot, field.name))) for field in robot.fields()}


def reference_for(robot: hopform.Robot, dtype: Any = np.float64, **start: Any) -> tuple[Any, dict[str, Any]]:
    """The reference solution of the rounded inputs, and those inputs."""
    inputs = {
        name: value if name == "max_phases" or value is None else float(dtype(value)) if np.isscalar(value) else value
        for name, value in start.items()
    }
    return reference.solve(rounded(robot, dtype), **inputs), inputs


def plain_errors(robot: hopform.Robot, stance: hopform.Stance, exact: Any, v2: float) -> dict[str, float]:
    """The largest scaled difference of time, state and event times, and that of the AED."""
    unit = reference.scales(rounded(robot, stance.dtype.type), exact, v2)
    differences = [(stance.duration - exact.duration) / unit["time"]]
    for name, scale in (("x1", "position"), ("v1", "velocity"), ("x2", "position"), ("v2", "velocity")):
        differences.append((getattr(stance.end, name) - getattr(exact.final, name)) / unit[scale])
    differences += [
        (ours.time - theirs.time) / unit["time"] for ours, theirs in zip(stance.events, exact.events, strict=False)
    ]
    largest = max(abs(float(difference)) for difference in differences)
    return {"state": largest, "aed": abs(float((stance.aed - exact.aed) / unit["energy"]))}


def assert_same_stance(robot: hopform.Robot, backend: str, dtype: Any = np.float64, **start: Any) -> float:
    """Solve with a back end and compare with the reference: same events, same ending, error within the tolerance."""
    exact, inputs = reference_for(robot, dtype, **start)
    stance = hopform.solve_stance(robot, backend=backend, dtype=dtype, **inputs)
    what = f"{robot} {inputs} {backend} {dtype.__name__}, margin {float(exact.margin):.1e}"
    assert stance.status == exact.status, what
    # A stance of n phases has n - 1 events; the reference lists the one at which the cap was reached as well.
    kept = exact.events[: inputs.get("max_phases", 4096) - 1]
    assert [event.kind for event in stance.events] == [event.kind for event in kept], what
    errors = plain_errors(robot, stance, exact, inputs["v2"])
    for of, error in errors.items():
        if error > TOLERANCE[dtype]:
            errors[of] = error / max(1.0, reference.condition(rounded(robot, dtype), of=of, **inputs))
        assert errors[of] <= TOLERANCE[dtype], f"scaled error of {of} {errors[of]:.2e}: {what}"
    return max(errors.values())


def random_robot(seed: int) -> tuple[hopform.Robot, dict[str, Any]]:
    """A robot and a start drawn over all orders of magnitude, degenerate ones among them."""
    draw = random.Random(seed)

    def over(low: float, high: float) -> float:
        return math.exp(draw.uniform(math.log(low), math.log(high)))

    def some(value: float, zero: float) -> float:
        return 0.0 if draw.random() < zero else value

    m_s, k = over(0.1, 10.0), over(1.0, 1e7)
    m_eff = m_s * over(1e-3, 1e3)
    low, high = -math.inf, math.inf
    if draw.random() < 0.25:
        low, high = -over(1e-4, 0.1), over(1e-4, 0.1)
    robot = hopform.Robot(
        m_eff=m_eff,
        m_s=m_s,
        k=k,
        L0=0.4,
        c=draw.choice((0.0, 0.0, draw.uniform(-0.02, 0.02))),
        b1=some(2.0 * math.sqrt(k * m_eff) * over(1e-6, 10.0), 0.15),
        b2=some(2.0 * math.sqrt(k * m_s) * over(1e-6, 10.0), 0.15),
        f1=some(over(0.01, 10.0), 0.15),
        f2=some(over(0.01, 10.0), 0.15),
        gamma2=draw.choice((-1.0, 1.0)) * m_eff * over(0.1, 30.0),
        g=9.81,
        x1_min=low,
        x1_max=high,
        u_max=3.0,
    )
    v2 = -over(0.05, 5.0)
    v1 = some(draw.choice((-1.0, 1.0)) * over(0.01, 3.0), 0.5)
    return robot, {"v2": v2, "v1": v1 if v1 > v2 else 0.0, "u": some(draw.uniform(-3.0, 3.0), 0.5), "max_phases": 100}
