"""How far a stance of hopform is from the 50-digit reference, in the units of the accuracy measure.

    time/max(T, sqrt(m_s/k))   position/0.1 m   velocity/(1 m/s)   energy/(m_s max(|v2|, 1 m/s)^2/2)

The error is divided by the condition number of the reference where that is above 1; it is computed only where the
plain error is above the tolerance, because it costs a solution per input.
"""

from typing import Any

import numpy as np

import hopform
from tests.oracle import reference

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


def state_error(robot: hopform.Robot, dtype: Any, at: Any, exact: Any, v2: float) -> float:
    """The largest scaled difference of a state from that in which the exact stance ends."""
    unit = reference.scales(rounded(robot, dtype), exact, v2)
    units = {"x1": "position", "v1": "velocity", "x2": "position", "v2": "velocity"}
    return max(
        abs(float((getattr(at, name) - getattr(exact.final, name)) / unit[scale])) for name, scale in units.items()
    )


def plain_errors(robot: hopform.Robot, stance: hopform.Stance, exact: Any, v2: float) -> dict[str, float]:
    """The largest scaled difference of time, state and event times, and that of the AED."""
    unit = reference.scales(rounded(robot, stance.dtype.type), exact, v2)
    differences = [(stance.duration - exact.duration) / unit["time"]]
    differences += [
        (ours.time - theirs.time) / unit["time"] for ours, theirs in zip(stance.events, exact.events, strict=False)
    ]
    largest = max(
        state_error(robot, stance.dtype.type, stance.end, exact, v2),
        *(abs(float(difference)) for difference in differences),
    )
    return {"state": largest, "aed": abs(float((stance.aed - exact.aed) / unit["energy"]))}


def assert_same_stance(robot: hopform.Robot, dtype: Any = np.float64, **start: Any) -> float:
    """Solve and compare with the reference: same events, same ending, error within the tolerance."""
    exact, inputs = reference_for(robot, dtype, **start)
    stance = hopform.solve_stance(robot, dtype=dtype, **inputs)
    what = f"{robot} {inputs} {dtype.__name__}, margin {float(exact.margin):.1e}"
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
