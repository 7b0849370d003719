"""Fit real recordings, which are not part of this repository, and hold the fits to what is published of their rigs.

`HOPFORM_DATA=DIR make validate-data` prints a table and exits 1 if a line of it does not hold. DIR holds the CSV files
named below: carts on a spring (Politecnico di Milano, ECP Model 210, repository rssalessio/Control-Linear-Vibrations,
2016) and a ball-screw axis (EMPS, A. Janot, M. Gautier, M. Brunot, "Data set and reference models of EMPS", 2019).
"""

import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from hopform import HopformError, fit_drop_test, fit_force, fit_step_response, read_recording

CART, TWO_MASSES, SPRING, FORCE_CONSTANT = 0.5685, 0.986, 712.6, 2.0
DECAYS = ("cart_free_decay_khigh_nomass.csv", "cart_free_decay_khigh_2mass.csv")
PULSES = {"cart_current_pulses_kmed_nomass.csv": 315.5, "cart_current_pulses_kbig_nomass.csv": 712.6}
AXIS, AXIS_GAIN = "ball_screw_axis.csv", -35.15
PUBLISHED = {"m_eff": (95.11, "kg"), "b1": (203.5, "N s/m"), "f1 m_eff": (20.39, "N"), "offset force": (-3.16, "N")}


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
    return Line(
        what, f"{found:.5g} {unit} ({100.0 * off:+.2f} %)", f"{published} {unit} within {share:.0%}", abs(off) <= share
    )


def decays(folder: Path) -> Iterator[Line]:
    """Coulomb friction against viscous friction alone; then both recordings together."""
    first, second = (read_recording(folder / name) for name in DECAYS)
    loaded = read_recording(folder / DECAYS[1], added_mass=TWO_MASSES)
    for recording in (first, second):
        fit = fit_drop_test(recording, attached=True, holdout=False)
        yield Line(
            f"{Path(recording.source).name}: rms", f"{1e3 * fit.rms:.3f} mm, viscous alone {1e3 * fit.old_rms:.3f} mm",
            "at most 0.2 mm, from 0.5 to 0.9 mm", fit.rms <= 2e-4 and 5e-4 <= fit.old_rms <= 9e-4,
        )  # fmt: skip
    both = fit_drop_test([first, loaded], attached=True, compare=False, holdout=False)
    yield near("both decays: mass of the cart", both["m_s"].value, "kg", CART, 0.05)
    yield near("both decays: spring", both["k"].value, "N/m", SPRING, 0.01)


def pulses(folder: Path) -> Iterator[Line]:
    """The force constant, and what Coulomb friction is worth."""
    for name, k in PULSES.items():
        fit = fit_step_response(read_recording(folder / name), known={"k": k}, holdout=False)
        yield near(f"{name}: |gamma2|", abs(fit["gamma2"].value), "N/A", FORCE_CONSTANT, 0.10)
        ratio = fit.old_rms / fit.rms
        yield Line(
            f"{name}: rms", f"{1e3 * fit.rms:.3f} mm, viscous alone {1e3 * fit.old_rms:.3f} mm, {ratio:.2f} times",
            "at least 1.4 times below", ratio >= 1.4,
        )  # fmt: skip


def axis(folder: Path) -> Iterator[Line]:
    """The fit in force."""
    fit = fit_force(read_recording(folder / AXIS), known={"gamma2": AXIS_GAIN})
    for name, (value, unit) in PUBLISHED.items():
        yield near(f"{AXIS}: {name}", fit[name].value, unit, value, 0.02)
    for statement in fit.statements:
        yield Line(f"{AXIS}: note", statement, "", True)


def main() -> int:
    folder = Path(os.environ.get("HOPFORM_DATA", ""))
    if not os.environ.get("HOPFORM_DATA") or not folder.is_dir():
        print("hopform: set HOPFORM_DATA to the folder of the recordings", file=sys.stderr)
        return 2
    parts: tuple[Callable[[Path], Iterator[Line]], ...] = (decays, pulses, axis)
    try:
        lines = [line for part in parts for line in part(folder)]
    except HopformError as error:
        print(f"hopform: {error}", file=sys.stderr)
        return 2
    for line in lines:
        print(f"{'holds' if line.holds else 'FAILS'} | {line.what} | {line.found} | {line.wanted}")
    return 0 if all(line.holds for line in lines) else 1


if __name__ == "__main__":
    raise SystemExit(main())
