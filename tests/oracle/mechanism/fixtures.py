"""The problems in fixtures/*.json with their answers to 30 digits; `python -m` this writes them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from . import Solution, builders, solve
from .builders import HOPPER_C
from .numbers import Real, mp

DIGITS = 30
FOLDER = Path(__file__).parent / "fixtures"
DROP = "-1.930751"
SERVO: dict[str, Any] = {
    "m": "2",
    "k": "50",
    "q_0": "0.1",
    "b": "1",
    "F_plus": "3",
    "F_minus": "1",
    "q_min": "-0.05",
    "q_max": "1",
}
CART: dict[str, Any] = {"m": "0.5", "b": "2", "F_plus": "0.2", "F_minus": "0.4", "q_max": "0.3"}

PROBLEMS: dict[str, dict[str, Any]] = {
    "hopper_0A": builders.stance(HOPPER_C, v2=DROP),
    "hopper_3A": builders.stance(HOPPER_C, v2=DROP, u="3"),
    "hopper_steps": builders.stance(HOPPER_C, v2=DROP, u=[["0", "3"], ["0.05", "-3"], ["0.1", "2"]]),
    "hopper_sticks": builders.stance({**HOPPER_C, "f1": "8", "f2": "6"}, v2="-0.6", x1="0.01", v1="0.3"),
    "hopper_at_stop": builders.stance(HOPPER_C, v2="-2.5", x1="0.08", v1="0.2", u="3"),
    "hopper_frictionless": builders.stance(
        {**HOPPER_C, "b1": "0", "b2": "0", "f1": "0", "f2": "0", "x1_min": "-inf", "x1_max": "inf"}, v2=DROP, u="1"
    ),
    "leg_damper_5_3A": builders.damped_leg(HOPPER_C, "5", v2=DROP, u="3"),
    "leg_damper_20_3A": builders.damped_leg(HOPPER_C, "20", v2=DROP, u="3"),
    "leg_damper_40_3A": builders.damped_leg(HOPPER_C, "40", v2=DROP, u="3"),
    "second_spring": builders.second_spring(HOPPER_C, "300", "0.41", v2=DROP, u="3"),
    "body_spring": builders.body_spring(HOPPER_C, "60", "0.5", v2=DROP, u="3"),
    "pushed_body": builders.pushed_body(HOPPER_C, "-5", v2=DROP, u="3"),
    "flight": builders.flight(HOPPER_C, Kp="500", Kd="200", u_max="3", x1="0.04", v1="0.39", x2="0.44", v2="1.9"),
    "flight_stiff_law": builders.flight(
        HOPPER_C, Kp="60000", Kd="300", u_max="3", x1="0.03", v1="0.1", x2="0.5", v2="1.9"
    ),
    "flight_leg_damper": builders.damped_flight(
        HOPPER_C, "20", y="0.01", push="-2", Kp="500", Kd="200", u_max="3", x1="0.04", v1="0.39", x2="0.44", v2="1.9"
    ),
    "foot_mass": builders.footed(HOPPER_C, "0.15", "20", height="0.2", u="-2", horizon="0.6"),
    "flight_tripped": builders.flight(
        HOPPER_C, Kp="500", Kd="200", u_max="3", x1="0", v1="0", x2="0.4", v2="1", ground="0.1", horizon="0.5"
    ),
    "joint_servo": builders.joint(**SERVO, q="0.5", u=[["0", "0"], ["0.7", "4"]]),
    "joint_cart": builders.joint(**CART, v="1", u="0.3"),
    "joint_frictionless": builders.joint(m="1", k="4", v="1", horizon="5"),
}


def answer(motion: Solution) -> dict[str, Any]:
    """What a motion is, its numbers to DIGITS digits."""

    def digits(value: Real) -> str:
        return str(mp.nstr(value, DIGITS))

    return {
        "status": motion.status,
        "duration": digits(motion.duration),
        "events": [[digits(event.time), event.kind] for event in motion.events],
        "final": {name: digits(value) for name, value in motion.final.items()},
        "gains": {name: digits(value) for name, value in motion.gains.items() if name in motion.system.units},
        "ledger": {name: digits(work) for name, work in motion.ledger(motion.duration).items()},
    }


def write() -> None:
    """Each problem with its answer, a line per field."""
    FOLDER.mkdir(exist_ok=True)
    for name, text in PROBLEMS.items():
        whole = {**text, "answer": answer(solve(text))}
        lines = ",\n".join(f"  {json.dumps(field)}: {json.dumps(value)}" for field, value in whole.items())
        (FOLDER / f"{name}.json").write_text(f"{{\n{lines}\n}}\n", "utf-8")


if __name__ == "__main__":
    write()
