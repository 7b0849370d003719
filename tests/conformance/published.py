"""Fit real recordings, which are not part of this repository, and hold the fits to what is published of their rigs.

`HOPFORM_DATA=DIR make validate-data` prints a table and exits 1 if a line of it does not hold. DIR holds the CSV files
named below: carts on a spring (Politecnico di Milano, ECP Model 210, repository rssalessio/Control-Linear-Vibrations,
2016), a ball-screw axis (EMPS, A. Janot, M. Gautier, M. Brunot, "Data set and reference models of EMPS", 2019), a
pendulum of a servo that is let go (repository Rhoban/bam, Apache-2.0; M. Duclusaud et al., "Extended Friction Models
for the Physics Simulation of Servo Actuators"), and free swings of a pendulum (repository
jensen-benard/rotary-inverted-pendulum, MIT).
"""

import csv
import math
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from hopform import HopformError, identify
from hopform.identify import fit_force, fit_robot, read_recording
from hopform.identify._fits import Fit
from hopform.identify._recordings import Recording, parse_recording

CART, TWO_MASSES, SPRING, FORCE_CONSTANT = 0.5685, 0.986, 712.6, 2.0
DECAYS = ("cart_free_decay_khigh_nomass.csv", "cart_free_decay_khigh_2mass.csv")
PULSES = {"cart_current_pulses_kmed_nomass.csv": 315.5, "cart_current_pulses_kbig_nomass.csv": 712.6}
AXIS, AXIS_GAIN = "ball_screw_axis.csv", 35.15
PENDULUMS = ("servo_pendulum_kp100_lift_and_drop.csv", "servo_pendulum_kp200_lift_and_drop.csv")
GRAVITY, LOAD = 0.4807, 0.0049
"""m g l [N m] and m l^2 [kg m^2] of the mass on the pendulum."""
SMALL = 0.3
"""[rad] the amplitude A from which a pendulum is fitted too: its oscillation shows 1.1 % less stiffness, A^2/8."""
SWINGS, SWINGING = ("pendulum_free_swing_01.txt", "pendulum_free_swing_02.txt"), 120.5
"""Free swings: two lines of header, then degrees at 1 kHz; k/I [1/s^2] by a regression of the samples below 0.3 rad."""
PUBLISHED = {"m": (95.11, "kg"), "b": (203.5, "N s/m"), "F": (20.39, "N"), "load": (3.16, "N")}


@dataclass(frozen=True)
class Line:
    """A line of the table: what was found, what it is held to, and whether it holds."""

    what: str
    found: str
    wanted: str
    holds: bool


def near(what: str, found: float, unit: str, published: float, share: float) -> Line:
    """A value that must be within a share of the published one."""
    off = found / published - 1.0
    said = f"{found:.5g} {unit} ({100.0 * off:+.2f} %)"
    return Line(what, said, f"{published:.5g} {unit} within {100.0 * share:g} %", abs(off) <= share)


def residuals(fit: Fit, unit: str = "mm", digits: int = 3) -> str:
    """The residuals of a fit beside those of viscous friction alone."""
    return f"{1e3 * fit.rms:.{digits}f} {unit}, viscous alone {1e3 * fit.old_rms:.{digits}f} {unit}"


def bare(what: str, fit: Fit) -> Line:
    """That a fit which does not explain its recording has no interval."""
    given = [each.name for each in fit.estimates if math.isfinite(each.high - each.low)]
    return Line(f"{what}: intervals", ", ".join(given) or "none", "none", not given)


def decays(folder: Path) -> Iterator[Line]:
    """Coulomb friction against viscous friction alone; then both recordings together."""
    first, second = (read_recording(folder / name) for name in DECAYS)
    loaded = read_recording(folder / DECAYS[1], added_mass=TWO_MASSES)
    for recording in (first, second):
        fit = fit_robot(decays=recording, holdout=False)
        wanted, holds = "at most 0.2 mm, from 0.5 to 0.9 mm", fit.rms <= 2e-4 and 5e-4 <= fit.old_rms <= 9e-4
        yield Line(f"{Path(recording.source).name}: rms", residuals(fit), wanted, holds)
        yield bare(Path(recording.source).name, fit)
    both = fit_robot(decays=[first, loaded], compare=False, holdout=False)
    yield near("both decays: mass of the cart", both["m_s"].value, "kg", CART, 0.05)
    yield near("both decays: spring", both["k"].value, "N/m", SPRING, 0.01)


def pulses(folder: Path) -> Iterator[Line]:
    """The force constant, and what Coulomb friction is worth."""
    for name, k in PULSES.items():
        fit = fit_robot(steps=read_recording(folder / name), known={"k": k}, holdout=False)
        yield near(f"{name}: |gamma2|", abs(fit["gamma2"].value), "N/A", FORCE_CONSTANT, 0.10)
        ratio = fit.old_rms / fit.rms
        yield Line(f"{name}: rms", f"{residuals(fit)}, {ratio:.2f} times", "at least 1.4 times below", ratio >= 1.4)
        yield bare(name, fit)


def axis(folder: Path) -> Iterator[Line]:
    """The fit in force."""
    fit = fit_force("slide", read_recording(folder / AXIS), fitted=[*PUBLISHED], known={"k_f": AXIS_GAIN})
    for name, (value, unit) in PUBLISHED.items():
        yield near(f"{AXIS}: {name}", fit[name].value, unit, value, 0.005)
    for statement in fit.statements:
        yield Line(f"{AXIS}: note", statement, "", True)


def pendulums(folder: Path) -> Iterator[Line]:
    """Inertia and friction of a pendulum, from all of a decay and from its smaller amplitudes; gravity as a spring.

    The rotor adds to m l^2; from a larger amplitude gravity is softer, so the inertia comes out larger.
    """
    found = dict[tuple[str, bool], float]()
    for name in PENDULUMS:
        for small in (False, True):
            fit = fit_robot(decays=_released(folder / name, small), known={"k": GRAVITY}, holdout=False)
            inertia, viscous, coulomb = (fit[each].value for each in ("m_s", "b2", "f2"))
            found[name, small] = inertia
            what = f"{name}{f' from {SMALL} rad' if small else ''}"
            interval = f"{inertia:.5f} kg m^2 [{fit['m_s'].low:.5f}, {fit['m_s'].high:.5f}]"
            values = f"{interval}, {viscous:.4f} N m s/rad, {inertia * coulomb:.4f} N m"
            wanted, holds = f"m l^2 = {LOAD} and a rotor of less", LOAD < inertia < 2.0 * LOAD
            yield Line(f"{what}: inertia, viscous, Coulomb", values, wanted, holds)
            yield Line(f"{what}: rms", residuals(fit, "mrad", 2), "at most half", fit.rms <= 0.5 * fit.old_rms)
            yield bare(what, fit)
    yield near("pendulums: inertia of the second", found[PENDULUMS[1], True], "kg m^2", found[PENDULUMS[0], True], 0.03)


def swings(folder: Path) -> Iterator[Line]:
    """A free pendulum with gravity's sine: once it stays within 100 degrees, and from its largest angle on."""
    for name in SWINGS:
        angles = [float(line) for line in (folder / name).read_text("utf-8").splitlines()[2:]]
        within = 1 + max(n for n, angle in enumerate(angles) if abs(angle) > 100.0)
        largest = max(range(len(angles)), key=lambda n: abs(angles[n]))
        for first, worst in ((within, 10.0), (largest, 80.0)):
            lines = ["time_s,q_deg", *(f"{1e-3 * n:.3f},{angle}" for n, angle in enumerate(angles[first:]))]
            swing = identify.fit(
                "joint", parse_recording("\n".join(lines), name), fitted=["J", "b", "F_p", "q_0"],
                known={"k": 1.0, "F_m": "F_p"}, sine=True, holdout=False,
            )  # fmt: skip
            what = f"{name} from {abs(angles[first]):.0f} degrees"
            yield near(f"{what}: k/I", 1.0 / swing["J"].value, "1/s^2", SWINGING, 0.005)
            rms = 1e3 * swing.rms
            yield Line(f"{what}: rms", f"{rms:.2f} mrad", f"at most {worst:g} mrad", rms <= worst)
            yield bare(what, swing)


def _released(path: Path, small: bool) -> Recording:
    """The motion of a servo after its torque is off, or from when it stays within `SMALL`."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if float(row["torque_on"]) == 0.0]
    large = [n for n, row in enumerate(rows) if abs(float(row["position_rad"])) > SMALL]
    kept = rows[large[-1] + 1 :] if small and large else rows
    lines = ["time_s,position_rad", *(f"{row['time_s']},{row['position_rad']}" for row in kept)]
    return parse_recording("\n".join(lines), path.name)


def main() -> int:
    folder = Path(os.environ.get("HOPFORM_DATA", ""))
    try:
        if not os.environ.get("HOPFORM_DATA") or not folder.is_dir():
            raise HopformError("set HOPFORM_DATA to the folder of the recordings")
        lines = [line for part in (decays, pulses, axis, pendulums, swings) for line in part(folder)]
    except HopformError as error:
        print(f"hopform: {error}", file=sys.stderr)
        return 2
    for line in lines:
        print(f"{'holds' if line.holds else 'FAILS'} | {line.what} | {line.found} | {line.wanted}")
    return 0 if all(line.holds for line in lines) else 1


if __name__ == "__main__":
    raise SystemExit(main())
