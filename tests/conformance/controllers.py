"""How often intervals hold the truth of a joint that was fitted from its position controller's log.

Logs are those of tests/oracle/controller.py, which shares nothing with hopform: 10 s of a chirp of 0.3 rad from 0.2 to
4 Hz at 800 Hz, noise of 0.2 mrad, an encoder of 16 384 counts a turn, of random joints with random gains, a dead time
of 5 ms. `python -m tests.conformance.controllers --count 30` prints a line per kind of log.
"""

import argparse
import math
import time
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np

import hopform
from hopform.identify._recordings import parse_recording
from tests.oracle import controller
from tests.oracle.controller import Servo, chirp

SEED = 20261129
RATE, DURATION, DEAD_TIME = 800.0, 10.0, 0.005
KINDS = ("every tick", "every second tick", "delay of the target")
FITTED = ("J", "b", "F_p")


def drawn(rng: np.random.Generator) -> Servo:
    """A joint of 0.6 to 1.6 times the usual inertia, friction of a third to three times the usual, damped 0.6 to 1.1."""
    usual = Servo()

    def about(value: float, low: float, high: float) -> float:
        return value * math.exp(float(rng.uniform(low, high)))

    J, K_p, F = about(usual.J, -0.5, 0.5), about(usual.K_p, -0.5, 0.7), about(usual.F_p, -1.0, 1.0)
    K_d = 2.0 * float(rng.uniform(0.6, 1.1)) * math.sqrt(K_p * J)
    return replace(usual, J=J, b=about(usual.b, -1.0, 1.5), F_p=F, F_m=F, K_p=K_p, K_d=K_d)


def fitted(kind: str, number: int) -> tuple[Servo, Any, float]:
    """A random joint, its fit, and the processor time [s] that it took."""
    rng = np.random.default_rng([SEED, KINDS.index(kind), number])
    rig, late = drawn(rng), {"delay" if kind == KINDS[2] else "dead_time": DEAD_TIME}
    every = 2 if kind == KINDS[1] else 1
    target = chirp(0.3, 0.2, 4.0, DURATION)
    text = controller.log(rig, target, DURATION, RATE, rng, every=every, **late)
    known = {"K_p": rig.K_p, "K_d": rig.K_d, "F_m": "F_p"}
    began = time.process_time()
    fit = hopform.identify.fit("servo", parse_recording(text, "log.csv"), fitted=FITTED, known=known, rate=RATE)
    return rig, fit, time.process_time() - began


def main() -> None:
    """A line per kind of log."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=30, help="joints of each kind")
    parser.add_argument("--first", type=int, default=0, help="number of the first of them")
    parser.add_argument("kinds", nargs="*", help=f"of {', '.join(KINDS)}; all if none is named")
    asked = parser.parse_args()
    for kind in asked.kinds or KINDS:
        held, without, seconds = Counter[str](), 0, list[float]()
        for number in range(asked.first, asked.first + asked.count):
            rig, fit, took = fitted(kind, number)
            seconds.append(took)
            if not math.isfinite(fit["J"].high - fit["J"].low):
                without += 1
                continue
            held.update(name for name in FITTED if fit[name].low <= getattr(rig, name) <= fit[name].high)
        shares = ", ".join(f"{name} {held[name]}" for name in FITTED)
        print(
            f"{kind}: {asked.count} joints, {without} without an interval; of the others the truth is in {shares}; "
            f"{np.median(seconds):.1f} s of processor time, at most {max(seconds):.1f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
