"""`hopform hop`: its options, its tables, its JSON."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
import typer
from rich.text import Text

from hopform import HopformError
from hopform.extend import Outputs, in_use, option, progress_bar, robot_and_draws, shown, table
from hopform.hopping._run import Errors, Hop, Run, simulate
from hopform.hopping.controllers import AsPrinted, ConstantCurrent, FeedForward, ReturnMap
from hopform.hopping.terrain import MOST_HOPS, NAMES, generate, number_of, read

ControllerName = StrEnum(
    "ControllerName", {"constant": "constant", "exact": "exact", "printed": "printed", "return_map": "return-map"}
)


def gains_of_return(text: str) -> tuple[float, float]:
    """Gains of the return in flight from "Kp,Kd"."""
    parts = text.split(",")
    if len(parts) != 2:
        raise typer.BadParameter(f"takes Kp,Kd in N/m and N s/m, as in 2000,300, got {shown(text)}")
    values = [number_of(part.strip()) for part in parts]
    for value, part, unit in zip(values, parts, ("N/m", "N s/m"), strict=True):
        if value is None:
            raise typer.BadParameter(f"takes a number in {unit}, written without a unit, got {shown(part)}")
        if not math.isfinite(value):
            raise typer.BadParameter(f"takes a finite number in {unit}, got {shown(part)}")
    return values[0] or 0.0, values[1] or 0.0


OPTIONS: dict[str, dict[str, Any]] = {
    "Arguments": {},
    "Robot and start": {"height": option("hop height from which the robot is dropped", unit="m")},
    "Ground": {
        "terrain": option("flat, steps, uniform, gaussian, or a CSV of heights", metavar="NAME|FILE"),
        "size": option("size of the terrain: step, half width or standard deviation", unit="m"),
        "hops": option("number of touchdowns; default: 8, or all heights of the file", least=1, most=MOST_HOPS),
    },
    "Current": {
        "controller": option("controller of the current"),
        "h_des": option("desired hop height, over the terrain's zero", unit="m"),
        "gains": option("gains of the actuator's return in flight, Kp x1 + Kd v1; default: designed",
                        parser=gains_of_return, metavar="KP,KD"),
        "model": option("the controller's model of the robot; default: the robot itself", metavar="NAME|FILE.toml"),
    },
    "Errors of sensors and motor": {
        "noise_x1": option("standard deviation of the measured actuator position", unit="m"),
        "noise_v1": option("standard deviation of the measured actuator velocity", unit="m/s"),
        "noise_x2": option("standard deviation of the measured body height: of the last apex, and at the ticks of return-map", unit="m"),
        "noise_v2": option("standard deviation of the measured body velocity", unit="m/s"),
        "noise_ground": option("standard deviation of the measured ground height", unit="m"),
        "current_scale": option("actual current over commanded current", unit="1"),
        "quantum": option("period of the clock at whose ticks a touchdown is detected", unit="s"),
        "delay": option("further delay of the detection", unit="s"),
        "seed": option("seed of terrain, errors and draws", least=0, most=math.inf),
    },
    "Uncertainty of a fit": {},
    "Solver": {},
    "Output": {
        "hops_csv": option("write a table of the hops", metavar="FILE"),
        "npz": option("write the table and the states over time for NumPy", metavar="FILE"),
    },
}  # fmt: skip
"""Its options beside those that commands share."""

EXAMPLES = {"hop": ("hop --height 0.20 --u 3", "hop --height 0.20 --terrain uniform --controller exact --h-des 0.20")}


def hop(
    height: float, robot: str | None = None, values: list[str] | None = None, from_fit: Path | None = None, draws: int = 200, terrain: str = "flat",
    size: float = 0.02, hops: int | None = None, seed: int = 0,
    controller: ControllerName = ControllerName.constant, u: float = 0.0, h_des: float | None = None,
    stop_margin: float = 0.0, noise_x1: float = 0.0, noise_v1: float = 0.0, noise_x2: float = 0.0,
    noise_v2: float = 0.0, noise_ground: float = 0.0, current_scale: float = 1.0, quantum: float = 0.0,
    delay: float = 0.0, model: str | None = None, gains: Any = None, horizon: float = 2.0,
    samples: int = 2000, json: bool = False, csv: str | None = None,
    hops_csv: Path | None = None, npz: Path | None = None, plot: Path | None = None,
) -> None:  # fmt: skip
    """Simulate hopping over rough terrain under a controller.

    The robot is dropped from --height. The terrain is flat, steps, uniform, gaussian (with --size and --seed) or a CSV
    file of heights. The controllers: constant (--u), exact (energy-based feedforward), printed (the same as the paper
    prints it), return-map (the first controller of Hopper B).
    """
    solver = in_use()
    reads = [("--robot", solver.robot_file(robot)), ("--from-fit", from_fit), ("--model", solver.robot_file(model))]
    reads.append(("--terrain", None if terrain in NAMES else Path(terrain)))
    outputs = Outputs(json, csv, plot, reads, [("--hops-csv", hops_csv), ("--npz", npz)])
    ground = terrain_of(terrain, size, hops, seed)
    hopper, drawn = robot_and_draws("hop", robot, values, from_fit, draws, seed, len(ground))
    asked = controller_of(controller, u, h_des, stop_margin, horizon)
    noise = (noise_x1, noise_v1, noise_x2, noise_v2, noise_ground)
    errors = Errors(*noise, current_scale, quantum, delay, None if model is None else solver.load_robot(model))
    how: dict[str, Any] = {"height": height, "gains": gains, "errors": errors, "seed": seed, "horizon": horizon}
    with progress_bar(f"{len(ground)} hops") as progress:
        run = simulate(hopper, ground, asked, **how, progress=progress)
    bands = bands_of(drawn, ground, asked, how) if drawn else None

    def over(axes: Any) -> None:
        if bands:
            fall = [hop.takeoff_time + max(float(hop.stance.end.v2), 0.0) / hopper.fall for hop in run.hops]
            bands.draw([bands], np.array(fall), axes, bars=True)

    settings = {"height": height, "controller": controller.value, "u": u if h_des is None else None}
    settings |= {"h_des": h_des, "seed": seed}
    outputs.emit(
        lambda: readable(run, gains is None, drawn, bands), [*run.warnings, *(drawn.warnings() if drawn else ())],
        csv=lambda: over_time(run, samples), json=lambda: json_of(run, settings, drawn, bands),
        more=[run.columns, lambda: run.archive(samples)], picture_of=run, over=over,
    )  # fmt: skip


def bands_of(drawn: Any, ground: tuple[float, ...], asked: Any, how: dict[str, Any]) -> Any:
    """Bands of the apexes [m] of runs of the robots that were drawn, whose controller believes in the fitted one; a robot
    has none from where it hops no more.
    """
    apexes = np.full((len(drawn.robots), len(ground)), np.nan)
    believed = drawn.model if how["errors"].model is None else how["errors"].model
    prepared = asked.prepare(believed, ground) if hasattr(asked, "prepare") else asked
    how = how | {"errors": replace(how["errors"], model=believed)}
    for row, robot in enumerate(drawn.each()):
        run = simulate(robot, ground, prepared, **how)
        apexes[row, : len(run.hops)] = run.table["apex"]
    return drawn.bands(apexes)


def terrain_of(name: str, size: float, hops: int | None, seed: int) -> tuple[float, ...]:
    """The heights that `hop` is asked for: as many as the file has, 8 or as said otherwise."""
    if name in NAMES:
        return generate(name, 8 if hops is None else hops, size, seed)
    if not Path(name).suffix and not Path(name).exists():
        message = f"there is no terrain {shown(name)}; known: {', '.join(NAMES)}, or a CSV file"
        raise HopformError(message)
    heights = read(name)
    if hops is not None and hops > len(heights):
        raise HopformError(f"{name} has {len(heights)} heights, too few for --hops {hops}")
    return heights[:hops]


def controller_of(name: ControllerName, u: float, h_des: float | None, stop_margin: float, horizon: float) -> Any:
    """The controller that `hop` is asked for; HopformError for an option that it does not have."""
    if name is ControllerName.constant and h_des is not None:
        raise HopformError("--h-des goes with the controllers exact, printed and return-map, not with constant")
    if name is not ControllerName.constant and h_des is None:
        raise HopformError(f"the controller {name.value} needs --h-des")
    if u and name is not ControllerName.constant:
        raise HopformError(f"--u goes with the constant controller, not with {name.value}")
    if stop_margin and name is not ControllerName.exact:
        raise HopformError(f"--stop-margin goes with the exact controller, not with {name.value}")
    if h_des is None:
        return ConstantCurrent(u)
    if name is ControllerName.exact:
        return FeedForward(h_des, stop_margin, horizon)
    if name is ControllerName.printed:
        return AsPrinted(h_des, horizon=horizon)
    return ReturnMap(h_des, horizon=horizon)


OUTCOMES = {
    "completed": "{} hop{} completed",
    "stopped": "stays on the ground after {} touchdown{}",
    "tripped": "trips over the ground ahead after {} touchdown{}",
}
"""How a run has ended, with the count of its hops."""


def readable(solved: Run, designed: bool, drawn: Any, bands: Any) -> Iterator[Any]:
    """A run: a row per hop, with bands of apexes if there are; whether the gains of the return in flight were designed
    for each.
    """
    count = len(solved.hops)
    outcome = OUTCOMES[solved.status].format(count, "" if count == 1 else "s")
    title = Text(f"{solved.robot.label}: {outcome}", style="bold")
    columns = (
        "hop", "ground [cm]", "from [cm]", "at [s]", *(["u [A]"] if solved.robot.solver.facts.inputs else ()),
        "stance [ms]", "ending", "apex [cm]", "AED [J]", "impact [J]", "stops",
        *(["apex, 95 % [cm]"] if bands else ()),
    )  # fmt: skip
    rows = ((*hop_row(hop), *([bands.at(hop.index).text()] if bands else ())) for hop in solved.hops)
    heights = "Heights are hop heights over the terrain's zero: 0 where the unloaded leg touches ground of height 0."
    notes = [heights, *gains_of(solved, designed), *([drawn.said()] if drawn else [])]
    yield from (title, "", table("Hops", columns, rows, ("ending", "stops")), "", "\n".join(notes))


def gains_of(solved: Run, designed: bool) -> Iterator[str]:
    """The law of the actuator in the flights between the hops, in words; none without a motor."""
    if not solved.robot.solver.facts.inputs:
        return
    flights = [each for each in (*(hop.flight for hop in solved.hops[1:]), solved.last) if each is not None]
    if not flights:
        return
    ranges = [sorted({getattr(flight.gains, name) for flight in flights}) for name in ("Kp", "Kd")]
    kp, kd = (f"{each[0]:.4g}" if each[0] == each[-1] else f"{each[0]:.4g} to {each[-1]:.4g}" for each in ranges)
    yield f"Return in flight, gains {'designed for each' if designed else 'as given'}: Kp = {kp} N/m, Kd = {kd} N s/m."


def hop_row(hop: Hop) -> tuple[str, ...]:
    """A hop in the table of a run."""
    return (
        str(hop.index + 1), f"{100.0 * hop.ground + 0.0:.4g}", f"{100.0 * hop.height:.5g}", f"{hop.touchdown_time:.5g}",
        *([f"{hop.u + 0.0:.4g}"] if hop.stance.inputs else ()), f"{1000.0 * hop.stance.duration:.5g}", hop.stance.status.replace("_", " "),
        "-" if math.isnan(hop.apex) else f"{100.0 * hop.apex:.5g}", f"{hop.stance.aed:+.4f}", f"{-hop.energy_lost_at_impact + 0.0:+.4f}",
        "bottoms out" if hop.bottoms_out else "hits a stop" if hop.hits_stop else "",
    )  # fmt: skip


def json_of(solved: Run, settings: dict[str, Any], drawn: Any, bands: Any) -> str:
    """A run with the settings that it was asked with; each hop with the ending of its stance, and its band."""
    hops = [
        Outputs.record("hop", hop, gains=hop.flight.gains, u=hop.stance.u, takeoff=hop.stance.takeoff,
                       takeoff_time=None if hop.stance.takeoff is None else hop.takeoff_time,
                       band=bands and bands.at(hop.index)) for hop in solved.hops
    ]  # fmt: skip
    warnings = [*solved.warnings, *(drawn.warnings() if drawn else ())]
    return Outputs.to_json("hop", solved, **settings, hops=hops, draws=drawn and drawn.record(), warnings=warnings)


def over_time(solved: Run, samples: int) -> Mapping[str, Any]:
    """The columns of a run over time: uniform times, and those of touchdowns and take-offs."""
    columns = solved.motion(solved.times(samples))
    return columns | {"AED": columns["AED"] - columns["AED"][0]}
