"""The commands that solve: robots, equations, motion, stance, control, reach. `tables` writes what they print."""

import math
from pathlib import Path
from typing import Any

import numpy as np

import hopform
from hopform._checks import shown
from hopform._cli import tables
from hopform._cli.bands import Bands, robot_and_draws
from hopform._cli.model import derived, spelled
from hopform._cli.options import Form, Precision
from hopform._cli.output import Outputs, deliver, to_json
from hopform._cli.use import in_use, robot_in_use, start_in_use
from hopform._control import TRIED, check_map
from hopform._export import struct_of
from hopform._progress import progress_bar


def robots(
    name: str | None = None, values: list[str] | None = None, json: bool = False, toml: bool = False,
    c: Precision | None = None,
) -> None:  # fmt: skip
    """Show the shipped robots, or one robot with all its parameters."""
    if json + toml + (c is not None) > 1:
        raise hopform.HopformError("--json, --toml and --c exclude each other")
    if toml or c is not None:
        one = robot_in_use(name, values)
        print(one.to_toml() if c is None else struct_of(one, c.replace("float", "f")), end="")
        return
    names = (in_use().ROBOTS if name is None and not values else ()) or (name,)
    found = [robot_in_use(each, values) for each in names]
    text = tables.robots_json(found) if json else ""
    deliver((), (), text, lambda: tables.robots(found, with_meaning=name is not None))


def equations(
    number: str | None = None, json: bool = False, form: Form | None = None, claims: bool = False
) -> None:  # fmt: skip
    """Show the paper's equations or claims, each with a verdict.

    An equation is shown as printed and as derived, with where it is computed; --as prints the derived formula, to paste.
    A claim comes with its numbers for the shipped robots.
    """
    if form is not None and (json or claims):
        raise hopform.HopformError(f"{'--json' if json else '--claims'} and --as exclude each other")
    if claims:
        return _claims(number, json)
    register = in_use().equations()
    found = [equation for equation in register if number is None or str(equation.number) == number.strip("()")]
    if not found:
        known = f"({register[0].number}) to ({register[-1].number})" if register else "none"
        if any(claim.name == number for claim in in_use().claims()):
            known += f"; `hopform equations --claims {number}` shows the claim of this name"
        raise hopform.HopformError(f"there is no equation {shown(number)}; known: {known}")
    text = to_json("equations", equations=found, claims=()) if json else ""
    if form is not None:
        text = spelled(derived("hopper"), number or "paper", form)
    why = tables.unclaimed(found) if text else ()
    deliver((), why, text, lambda: tables.equations(found) if number is None else tables.equation(found[0]))


def _claims(name: str | None, json: bool) -> None:
    """Show all claims of the paper, or one."""
    register = in_use().claims()
    found = [claim for claim in register if name in (None, claim.name)]
    if not found:
        raise hopform.HopformError(f"there is no claim {shown(name)}; `hopform equations --claims` lists them")
    text = to_json("equations", equations=(), claims=found) if json else ""
    why = tables.unproven(found) if text else ()
    deliver((), why, text, lambda: tables.claims(found) if name is None else tables.claim(found[0]))


def outputs_of(
    robot: str | None, u: float, u_steps: Any, explain: bool, json: bool, csv: str | None, plot: Path | None
) -> Outputs:
    """The outputs of a stance or a motion; HopformError for options that exclude each other, before anything is solved."""
    outputs = Outputs(json, csv, plot, reads=[("--robot", in_use().robot_file(robot))])
    if u and u_steps:
        raise hopform.HopformError("give either --u or --u-steps")
    if json and explain:
        raise hopform.HopformError("--json and --explain exclude each other")
    return outputs


def stance(
    robot: str | None = None, values: list[str] | None = None, height: float | None = None, v2: float | None = None, x1: float = 0.0, v1: float = 0.0,
    x2: float | None = None, compression: float | None = None, u: float = 0.0, u_steps: Any = None,
    horizon: float = 2.0, max_phases: int = 4096,
    dtype: Precision = Precision.float64, samples: int = 500, sensitivities: bool = False, explain: bool = False,
    json: bool = False, csv: str | None = None, plot: Path | None = None,
) -> None:  # fmt: skip
    """Solve a hopper's stance: phases, events, apex, energy ledger."""
    outputs = outputs_of(robot, u, u_steps, explain, json, csv, plot)
    hopper = robot_in_use(robot, values, "stance")
    start: dict[str, Any] = {"x1": x1, "v1": v1, "v2": velocity_after_impact(hopper, height, v2), "x2": x2}
    how: dict[str, Any] = {"u": u_steps or u, "horizon": horizon, "max_phases": max_phases, "dtype": dtype}
    solved = hopform.solve_stance(hopper, **start, compression=compression, **how)
    outputs.emit(
        lambda: tables.motion(solved, sensitivities, explain), solved.warnings, picture_of=solved,
        csv=lambda: tables.stance_csv(solved, samples), json=lambda: tables.stance_json(solved, height),
    )  # fmt: skip


def motion(
    robot: str | None = None, values: list[str] | None = None, start: list[str] | None = None, u: float = 0.0, u_steps: Any = None,
    horizon: float = 2.0, max_phases: int = 4096,
    dtype: Precision = Precision.float64, samples: int = 500, sensitivities: bool = False, explain: bool = False,
    json: bool = False, csv: str | None = None, plot: Path | None = None,
) -> None:  # fmt: skip
    """Solve a motion of any model: phases, events, forces, energies."""
    outputs = outputs_of(robot, u, u_steps, explain, json, csv, plot)
    how: dict[str, Any] = {"u": u_steps or u, "horizon": horizon, "max_phases": max_phases, "dtype": dtype}
    solved = hopform.solve_motion(robot_in_use(robot, values), start=start_in_use(start), **how)
    outputs.emit(
        lambda: tables.motion(solved, sensitivities, explain), solved.warnings, picture_of=solved,
        csv=lambda: tables.motion_csv(solved, samples), json=lambda: tables.motion_json(solved),
    )  # fmt: skip


def control(
    h_des: float, robot: str | None = None, values: list[str] | None = None, from_fit: Path | None = None, draws: int = 200, seed: int = 0,
    height: float | None = None, v2: float | None = None, x1: float = 0.0, v1: float = 0.0, x2: float | None = None,
    compression: float | None = None, datum: float = 0.0, stop_margin: float = 0.0, horizon: float = 2.0,
    dtype: Precision = Precision.float64, printed: bool = False,
    json: bool = False, plot: Path | None = None,
) -> None:  # fmt: skip
    """Choose the current that reaches a desired apex, (25)-(27)."""
    outputs = Outputs(json, plot=plot, reads=[("--robot", in_use().robot_file(robot)), ("--from-fit", from_fit)])
    hopper, drawn = robot_and_draws("command", robot, values, from_fit, draws, seed, TRIED if plot else 1)
    velocity = velocity_after_impact(hopper, height, v2)
    start: dict[str, Any] = {"x1": x1, "v1": v1, "v2": velocity, "x2": x2, "compression": compression}
    asked: dict[str, Any] = {"h_des": h_des, "datum": datum}
    how: dict[str, Any] = {"horizon": horizon}
    with progress_bar("solving"):
        found = hopform.choose_current(hopper, **start, **asked, stop_margin=stop_margin, **how, dtype=dtype)
        choose, forms = hopform.choose_current_as_printed, tables.PRINTED.items() if printed else ()
        others = [(name, choose(hopper, **start, **asked, **form, **how)) for name, form in forms]

    def over(axes: Any) -> None:
        if drawn:
            u, _ = found.curve()
            Bands.draw([drawn.apexes(start, height, datum, u, how)], u, axes)

    band = drawn.apexes(start, height, datum, found.u, how).at(0) if drawn else None
    settings = start | asked | {"stop_margin": stop_margin}
    outputs.emit(
        lambda: tables.command(hopper, h_des, found, others, drawn, band),
        [*found.warnings, *(drawn.warnings() if drawn else ())], picture_of=found, over=over,
        json=lambda: tables.command_json(hopper, settings, found, others, drawn, band),
    )  # fmt: skip


def reach(
    robot: str | None = None, values: list[str] | None = None, from_fit: Path | None = None, draws: int = 200, seed: int = 0, lowest: float = 0.02,
    highest: float = 0.4, heights: int = 39, currents: int = 61, stop_margin: float = 0.0, horizon: float = 2.0,
    json: bool = False, plot: Path | None = None,
) -> None:  # fmt: skip
    """Map the next apex over the last one, for all currents.

    As in Figs. 5 and 11, with bounds, gaps, fixed points and the heights that a current can hold.
    """
    outputs = Outputs(json, plot=plot, reads=[("--robot", in_use().robot_file(robot)), ("--from-fit", from_fit)])
    check_map(heights, currents)
    hopper, drawn = robot_and_draws("reach", robot, values, from_fit, draws, seed, heights * currents)
    if not lowest < highest:
        raise hopform.HopformError(f"--from must be below --to, got {lowest!r} and {highest!r} m")
    limit = float(hopper.letters.u_max)
    if not math.isfinite(limit):
        raise hopform.HopformError(f"the controller needs a finite u_max, got {limit!r} A")
    range_of_u = np.unique(np.linspace(-limit, limit, currents if limit > 0.0 else 1))
    range_of_h = np.linspace(lowest, highest, heights)
    how: dict[str, Any] = {"stop_margin": stop_margin, "horizon": horizon}
    with progress_bar(f"{heights} heights") as advance:
        found = hopform.reachability(hopper, range_of_h, range_of_u, **how, progress=advance)
    bands = drawn.maps(range_of_h, range_of_u, how) if drawn else None

    def over(axes: Any) -> None:
        if bands:
            Bands.draw([bands["lowest"], bands["highest"]], 100.0 * range_of_h, axes)

    outputs.emit(
        lambda: tables.reach(found, drawn, bands), drawn.warnings() if drawn else (), picture_of=found, over=over,
        json=lambda: tables.reach_json(found, drawn, bands),
    )  # fmt: skip


def velocity_after_impact(robot: hopform.Robot, height: float | None, v2: float | None) -> float:
    """The one of the two that is given, as a velocity [m/s]."""
    if v2 is not None and height is None:
        return v2
    if height is not None and v2 is None:
        return hopform.touchdown_velocity(robot, height)
    raise hopform.HopformError("give either --height or --v2")
