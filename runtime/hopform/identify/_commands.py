"""What `hopform identify` does between its options and its output: files to recordings, recordings to a fit, a fit to
files.
"""

import math
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Any, cast

import numpy as np
import typer

from hopform import HopformError, Robot
from hopform._checks import number_of
from hopform._cli.output import deliver, picture, show
from hopform._cli.use import core, robot_in_use, start_in_use
from hopform._errors import printable
from hopform._files import Named
from hopform._solver.package import records
from hopform.extend import Outputs, in_use, needs, option, progress_bar, shown
from hopform.identify import _report as reports
from hopform.identify import _synthetic as synthetic
from hopform.identify._causes import said
from hopform.identify._fits import Fit, Options, Trace, fit, is_no_fit, missed
from hopform.identify._joint import KINDS, Check, check
from hopform.identify._joint import plan as planned
from hopform.identify._kinds import cuts_by_kind
from hopform.identify._motion import Values
from hopform.identify._recordings import Recording, flat_top, read_recording
from hopform.identify._simulators import exported, notes

SimulatorFormat = StrEnum("SimulatorFormat", ["mjcf", "urdf", "isaac"])
Recordable = StrEnum("Recordable", ["drop", "free", "decay", "step", "air", "all", "motion"])
Identification = StrEnum("Identification", ["drop", "all", "check"])


def _refuse_kind(word: str) -> None:
    """HopformError for what `identify` has not."""
    if word not in Identification.__members__:
        raise HopformError(
            f"identify takes drop, all or check, got {shown(word)}; decays, step responses and recordings in the air: "
            "identify all decay:FILE, with others of the robot; a motion by itself: --solver slide fit FILE"
        )


OPTIONS: dict[str, dict[str, Any]] = {
    "Arguments": {
        "test": typer.Argument(help="test to record; motion is that of any model, for `hopform fit`"),
        "kind": typer.Argument(
            metavar="drop|all|check", help="drop: drops only; all: all recordings of a robot; check: what they can identify",
        ),
        "files": typer.Argument(
            metavar="FILES", help="CSV files; with `all` or `check` each may be ROLE:FILE, of drop|free|decay|step|air"
        ),
        "fit.files": typer.Argument(metavar="FILES", help="CSV files; columns are named after the model's coordinates and input"),
    },
    "Robot and start": {
        "record.height": option("hop height of a drop, default: 0.2; initial deflection of a decay, default: 0.04", unit="m", need="identify"),
        "record.start": option("of a motion: initial value of a coordinate or velocity; default: 0; repeatable",
                               metavar="NAME=VALUE"),
    },
    "Input": {
        "record.u": option("of a motion: the input, in its unit: a constant", unit="the input's unit", need="input"),
        "record.u_steps": option("of a motion: the input, in its unit: steps, U from time T [s] on", unit="the input's unit", steps=True, need="input"),
        "record.chirp": option("of a motion: the input, a sine sweep from one frequency [Hz] to another", metavar="SIZE:FIRST:LAST",
                               need="input"),
        "record.control_rate": option("of a model with a law: sampling rate of the controller", unit="Hz",
                                      need="input"),
        "record.dead_time": option("dead time of the controller: delay of each current", unit="s", need="input"),
    },
    "Experiment": {
        "duration": option("duration of the recording; default: 2", unit="s"),
        "rate": option("sampling rate", unit="Hz"),
        "record.noise": option("standard deviation of the measured position, in its unit", unit="the position's unit"),
        "record.quantum": option("resolution of the encoder, in the position's unit; 0: none", unit="the position's unit"),
        "current": option("largest current; default: the largest up to u_max that fits into the stroke", unit="A", need="identify"),
        "hold": option("time at rest before the test; default: 0.2", unit="s", need="identify"),
        "record.added_mass": option("mass added to the body", unit="kg", need="identify"),
        "added_mass": option("[kg] mass added to the moving part, one per file; of a rotation the inertia in kg m^2", metavar="M,M,..."),
        "repeats": option("number of drops or decays in the recording", least=1, need="identify"),
        "free_stroke": option("the rig has no stops and no limit of the spring's travel", need="identify"),
        "record.seed": option("seed of the noise", least=0, most=math.inf),
        "plan": option("show the intervals to expect of a fit, in place of the recording; of all: which tests to record", need="identify"),
        "ranges": option("range of a parameter for `record all --plan`; repeatable", metavar="NAME=LOW:HIGH", need="identify"),
    },
    "Fit": {
        "known": option("value of a known parameter, in SI units; repeatable", metavar="NAME=VALUE"),
        "record.known": option("value of a known parameter, in SI units; repeatable", metavar="NAME=VALUE", need="identify"),
        "fitted": option("parameters to fit; default: all that are not known, except stops and limits",
                         metavar="NAME,NAME,..."),
        "fit.known": option("value of a known parameter, in SI units, or the fitted parameter that it equals; repeatable; "
                            "the others keep their default", metavar="NAME=VALUE|NAME"),
        "near": option("initial guess of a fitted parameter; repeatable", metavar="NAME=VALUE"),
        "fit.rate": option("of a model with a law: sampling rate of the controller", unit="Hz"),
        "sine": option("the restoring torque is that of a pendulum, K sin(angle), not of a spring"),
        "in_force": option("linear fit of the equation of motion, for a recording in closed loop"),
        "identify.free": option("the actuator was free to move under the recorded current, within its stops"),
        "gain": option("fit the gain of each position sensor"),
        "clock": option("fit the rate of the recording's clock"),
        "lag": option("fit a first-order lag of each position sensor"),
        "loss": option("loss function: linear, or soft_l1, huber or cauchy against outliers"),
    },
    "Uncertainty of a fit": {},
    "Solver": {},
    "Output": {
        "out": option("write the robot as TOML; parameters that are not fitted are those of --robot", metavar="FILE"),
        "fit.out": option("write the fitted parameters as TOML, or the file of --export", metavar="FILE"),
        "report": option("write a report with plots: .md or .html", metavar="FILE"),
        "export": option("write for a simulator, to --out or standard output: armature, damping, frictionloss, gear"),
    },
}  # fmt: skip
"""Their options beside those that commands share."""

EXAMPLES = {
    "record": (
        "record drop --seed 1 --csv drop.csv",
        "record motion --start x1=0.02 --start x2=0.4 --u-steps 0:1.2,0.3:-0.4,0.6:1,0.9:-0.3,1.2:1 --seed 1 --csv motion.csv",
    ),
    "fit": (
        "fit motion.csv --fitted m_eff,k,b1,b2,f1,f2,gamma2 --known m_s=3 --known L0=0.4",
        "fit motion.csv --fitted m_eff,k,b2,f2 --known m_s=3 --known L0=0.4 --known b1=150 --known f1=0.78 --known gamma2=-65 --out leg.toml",
    ),
    "identify": ("identify check drop.csv --known m_s=3", "identify drop drop.csv --known m_s=3 --out mine.toml"),
}
"""Those of `record` are run before those of `identify`."""

STAGES = 6
"""Of a fit, about: it, the old model, intervals, what is left out."""


def pairs_of(option: str, pairs: Sequence[str] | None, names_too: bool = False) -> dict[str, float | str]:
    """What an option NAME=VALUE has; names_too: a value may be the name of a fitted parameter."""
    values = dict[str, float | str]()
    for pair in pairs or ():
        name, equals, text = pair.partition("=")
        value = number_of(text)
        if not equals or not (names_too and text.isidentifier() if value is None else math.isfinite(value)):
            first = core().facts.parameters[0]["name"]
            tied = ", or the name of one that is fitted" if names_too else ""
            raise HopformError(f"{option} takes NAME=VALUE in SI units, as in {first}=0.1{tied}, got {shown(pair)}")
        if name in values:
            raise HopformError(f"{option}: {shown(name)} is given twice")
        values[name] = text if value is None else value
    return values


def known_numbers(pairs: Sequence[str] | None) -> dict[str, float]:
    """What --known has where each value is a number."""
    return cast("dict[str, float]", pairs_of("--known", pairs))


def ranges_of(pairs: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Ranges of parameters from name=low:high."""
    ranges = dict[str, tuple[float, float]]()
    for pair in pairs:
        name, equals, ends = pair.partition("=")
        low, high = (number_of(each) for each in (ends.split(":") + [""])[:2])
        if not equals or low is None or high is None or not -math.inf < low < high < math.inf:
            raise HopformError(f"--ranges takes NAME=LOW:HIGH in SI units, as in k=800:1600, got {shown(pair)}")
        ranges[name] = low, high
    return ranges


def swept(text: str, duration: float | None, rate: float) -> list[tuple[float, float]]:
    """A sine whose frequency rises evenly, from "0.3:0.2:4", as steps at a rate [Hz] over a duration [s], 2 if None."""
    numbers = [number_of(each) for each in text.split(":")]
    if len(numbers) != 3 or any(each is None or not math.isfinite(each) for each in numbers):
        raise HopformError(f"--chirp takes SIZE:FIRST:LAST, frequencies in Hz, as in 0.3:0.2:4, got {shown(text)}")
    size, first, last = (float(each) for each in numbers if each is not None)
    length = 2.0 if duration is None else duration
    count = length * rate
    if not (0.0 < count < records.MOST_STEPS and max(abs(first), abs(last)) <= 0.5 * rate):
        raise HopformError(
            f"--chirp: frequencies up to {0.5 * rate:g} Hz, half the rate, over up to {records.MOST_STEPS} ticks, got {shown(text)}"
        )
    times = [n / rate for n in range(math.floor(count) + 1)]
    return [(t, size * math.sin(2.0 * math.pi * t * (first + 0.5 * (last - first) * t / length))) for t in times]


def added_masses(text: str, count: int) -> tuple[float, ...]:
    """Masses [kg] of so many files from "0,0.986", 0 if none is given."""
    numbers = [number_of(each) for each in text.split(",")] if text else []
    masses = tuple(each for each in numbers if each is not None and 0.0 <= each < math.inf)
    if len(masses) < len(numbers):
        raise HopformError(f"--added-mass takes masses >= 0 in kg, one per file, as in 0,0.986, got {shown(text)}")
    if masses and len(masses) != count:
        raise HopformError(f"--added-mass names {len(masses)} masses for {count} files")
    return masses or (0.0,) * count


def answer_to(
    kind: str, files: Sequence[str], read: Sequence[tuple[str, Recording]], known: Values, how: Options
) -> reports.Answer:
    """The answer to recordings by their roles; HopformError names what is wrong with a file."""
    recordings = [recording for _, recording in read]
    by_role: dict[str, list[Recording]] = {role: [one for own, one in read if own == role] for role in synthetic.TESTS}
    try:
        if kind == "check":
            return check(by_role, known)
        result = fit({of: by_role[role] for role, of in KINDS.items() if by_role[role]}, known, **how)
    except HopformError as error:
        hints = [
            f"; it was taken for a {role}: name its kind, as in {_OTHER[role]}:{name}"
            for name, (role, each) in zip(files, read, strict=True)
            if str(error).startswith(f"{each.source}, ") and role_and_path(name)[0] is None and kind in ("all", "check")
        ]
        if kind == "drop" and str(error).startswith(tuple(each.source for each in recordings)):
            hints = [_other_kind(recordings, {role for role, _ in read} == {"free"})]
        raise HopformError(f"{error}{''.join(hints[:1])}") from None
    unstopped = all({"x1", "x2"} <= each.columns.keys() for each in recordings)
    refuse_no_fit(result, recordings, ("x1_min", "x1_max") if unstopped else ())
    return result


_OTHER = {"drop": "decay", "free": "drop", "step": "air"}
"""What a recording without a kind may be instead of what its columns show."""


def refuse_no_fit(fit: Fit, recordings: Sequence[Recording], stops: Sequence[str]) -> None:
    """HopformError for a fit that explains too little; stops: parameters of stops that the motion may have met."""
    off = [trace for trace in fit.traces if is_no_fit(trace)]
    if off:
        worst = max(off, key=lambda each: each.tests.rms / float(np.std(each.measured)))
        raise _no_fit(worst, recordings, fit, stops)


def _no_fit(trace: Trace, recordings: Sequence[Recording], fit: Fit, stops: Sequence[str]) -> HopformError:
    """The error about a fit that explains too little: where it is off most, and what may be wrong."""
    recording = max(
        (each for each in recordings if trace.label.startswith(each.source)), key=lambda each: len(each.source)
    )
    left = trace.measured - trace.predicted
    at = int(np.abs(left).argmax())
    share = max(1.0 - float(np.var(left)) / float(np.var(trace.measured)), 0.0)
    force = trace.quantity == "force"
    position, drives = recording.column_of("x1" if force else trace.quantity), recording.found("u")
    leads = drives or recording.columns.get("target")
    lengths = " and ".join(each.title for each in recording.columns.values() if each.quantity in ("length", "angle"))
    asked = [f"is the unit of {lengths} right"]
    asked += (
        [f"are {position.title} and {leads.title} from the same run, each in its column with its sign"] if leads else []
    )
    missing = [] if {*stops} & fit.known.keys() else [f"{name}=..." for name in stops]
    asked += [f"does it reach a stop, which --known {' or '.join(missing)} gives"] if missing else []
    asked += ["does it reach a stop"] if drives and position.title[:2] != "x2" and flat_top(recording) else []
    asked += ["is it of this rig?"]
    rigs = [f"{each.name} is {', '.join(f'{v:.4g}' for v in each.values)} {each.unit}".rstrip()
            for each in fit.repeats if each.differ]  # fmt: skip
    known = [f"of each recording alone {', '.join(rigs)}"] if rigs else []
    seen = "; ".join([", ".join(asked), *known, *said(fit.diagnoses, fit.shown)])
    what, unit, least = ("force", fit.units.force, 75) if force else ("motion", fit.units_of(trace).position, 96)
    explained = f"the fit explains only {100.0 * share:.3g} % of the {what}, a fit needs {least} %"
    message = f"{explained}; the error is largest here, {abs(left[at]):.3g} {unit}: {seen}"
    line = recording.line_of(int(np.count_nonzero(recording.time < trace.time[at] - 1e-9)))
    return recording.error(message, line, drives if force else position)


def _other_kind(recordings: Sequence[Recording], free: bool) -> str:
    """A question about recordings that are no drops: whether the actuator was held, or they are decays."""
    other = "drop" if free else "decay"
    try:
        list(cuts_by_kind({KINDS[other]: recordings}))
    except HopformError:
        return ""
    return (
        "; or was the actuator held: leave out --free?" if free else "; or is it a decay: hopform --solver slide fit?"
    )


def _read(kind: str, free: bool, files: Sequence[str], masses: Sequence[float]) -> Iterator[tuple[str, Recording]]:
    """The recordings with their roles; free: drops over an actuator that moves; masses [kg]: one per file."""
    for name, mass in zip(files, masses, strict=True):
        role, path = role_and_path(name)
        recording = replace(read_recording(path), added_mass=mass)
        yield role or ("free" if free else "drop" if kind == "drop" else _role(recording)), recording


def role_and_path(name: str) -> tuple[str | None, str]:
    """The role that ROLE:FILE gives a file, None where it gives none, and the file."""
    role, colon, rest = name.partition(":")
    return (role, rest) if colon and role in synthetic.TESTS else (None, name)


def _role(recording: Recording) -> str:
    """The role of a recording without one: without a current a drop; with one and x2 a drop with the actuator
    free, else steps against the spring."""
    if not recording.has_current():
        return "drop"
    return "free" if "x2" in recording.columns else "step"


def model_of(answer: reports.Answer, form: str | None) -> tuple[str, list[str]]:
    """A fit for a simulator, and what to know of it; nothing for no form."""
    if form is None:
        return "", []
    if not isinstance(answer, Fit):
        raise HopformError("--export needs a fit; check makes none")
    _refuse_missed(answer)
    return exported(answer, form), notes(answer)


def _refuse_missed(fit: Fit) -> None:
    if any(missed(trace) for trace in fit.traces):
        warning = next(each for each in fit.warnings if "misses the recording" in each)
        raise HopformError(f"{warning}; no robot is written")


def files_of(
    answer: reports.Answer, base: Robot | None, out: Path | None, written: Path | None, plot: Path | None, model: str
) -> list[tuple[Path, bytes]]:
    """The files that were asked for: a robot's TOML, or its model for a simulator, a report, a picture."""
    files = list[tuple[Path, bytes]]()
    if isinstance(answer, Fit):
        answer = replace(answer, origin=(*answer.origin, *command()))
    if isinstance(answer, Check):
        if out or written or plot:
            raise HopformError("--out, --report and --plot need a fit; check makes none")
        return files
    if out:
        _refuse_missed(answer)
        name = out.stem.encode("utf-8", "backslashreplace").decode()
        robot = model or replace(answer.robot(base), name=name, description="identified").to_toml()
        files.append((out, robot.encode()))
    if written:
        files += reports.files_of(answer, written)
    if plot:
        files.append((plot, picture(plot, answer)))
    return files


def command() -> tuple[str, ...]:
    """The command line of this process, if it is hopform's."""
    program, *arguments = sys.argv
    ours = Path(program).stem in ("hopform", "__main__")
    return (printable(shlex.join(["hopform", *arguments])),) if ours else ()


def check_fit_outputs(
    reads: Sequence[Named], json: bool, out: Path | None, export: str | None, report: Path | None, plot: Path | None
) -> None:
    """Refuse, before anything is read, outputs of a fit that exclude each other, and files that would be overwritten."""
    pages: list[Named] = []
    if report is not None:
        reports.check_suffix(report)
        needs("matplotlib", "plot", "a plot")
        pages += zip(("--report", "the picture of --report"), reports.paths_of(report), strict=False)
    Outputs(json, plot=plot, reads=reads, more=[("--out", out), *pages])
    if json and export and not out:
        raise HopformError("--json and --export both print; give --export a file by --out")


def options_of(loss: str, flags: Mapping[str, bool], advance: Callable[[int, int], None]) -> Options:
    """The options of a fit: its loss, the nuisances that are wanted, and a progress bar that advances with its stages."""
    stages = iter(range(STAGES))
    return {
        "loss": loss,
        "nuisances": tuple(name for name, each in flags.items() if each),
        "progress": lambda _: advance(next(stages, STAGES), STAGES),
    }


def give(
    answer: reports.Answer, written: Sequence[tuple[Path, bytes]], notes: Sequence[str], model: str, json: bool
) -> None:
    """Write the files of an answer, then print: its model for a simulator if there is one, JSON, or tables."""
    text = reports.json_of(answer) if json else ""
    deliver(written, (*answer.warnings, *notes), model or text, lambda: reports.tables_of(answer))


# ---- the commands ----


def identify(
    kind: str, files: list[str], known: list[str] | None = None, free: bool = False,
    gain: bool = False, clock: bool = False, lag: bool = False, added_mass: str = "",
    loss: str = "linear", robot: str | None = None, values: list[str] | None = None, out: Path | None = None, export: SimulatorFormat | None = None,
    report: Path | None = None, json: bool = False, plot: Path | None = None,
) -> None:  # fmt: skip
    """Identify a hopper's parameters from CSV recordings.

    The recordings are drops, or drops, decays, step responses and motions in the air together. For any other mechanism,
    such as a cart, an axis or a joint: hopform --solver slide fit.
    """
    _refuse_kind(kind)
    if free and kind != "drop":
        raise HopformError("--free goes with drop; with all name the role of a file, as in free:drop.csv")
    read = (("the recording", role_and_path(each)[1]) for each in files)
    check_fit_outputs([("--robot", in_use().robot_file(robot)), *read], json, out, export, report, plot)
    base = robot_in_use(robot, values, "identify")
    masses, given = added_masses(added_mass, len(files)), known_numbers(known)
    with progress_bar("identification") as advance:
        how = options_of(loss, {"gain": gain, "clock": clock, "lag": lag}, advance)
        answer = answer_to(kind, files, [*_read(kind, free, files, masses)], given, how)
        model, more = model_of(answer, export)
        written = files_of(answer, base, out, report, plot, model)
    give(answer, written, more, "" if out else model, json)


def record(
    test: Recordable, robot: str | None = None, values: list[str] | None = None, duration: float | None = None, rate: float = 500.0,
    noise: float = synthetic.NOISE, quantum: float = synthetic.QUANTUM, height: float | None = None,
    current: float | None = None, hold: float | None = None, added_mass: float = 0.0, repeats: int = 1,
    free_stroke: bool = False, start: list[str] | None = None, u: float = 0.0, u_steps: Any = None,
    chirp: str = "", control_rate: float | None = None, dead_time: float = 0.0,
    seed: int | None = None, plan: bool = False,
    known: list[str] | None = None, ranges: list[str] | None = None, csv: str | None = "-",
) -> None:  # fmt: skip
    """Simulate a recording with noise, to plan experiments.

    The recording has the columns, noise and resolution of one from a lab. motion is that of any model from --start under
    --u, for `hopform fit`.
    """
    outputs = Outputs(csv=csv or "-", reads=[("--robot", in_use().robot_file(robot))])
    every, any_model = str(test) == "all", str(test) == synthetic.MOTION
    base = robot_in_use(robot, values, "motion" if any_model else "identify")
    if plan and any_model:
        raise HopformError("record motion has no --plan: `hopform fit` of the recording shows its intervals")
    if (u != 0.0) + bool(u_steps) + bool(chirp) > 1:
        raise HopformError("give one of --u, --u-steps and --chirp")
    if (ranges and not every) or (every and not plan):
        raise HopformError("all and --ranges go with --plan: `record all --plan --ranges NAME=LOW:HIGH`")
    if every:
        show(reports.plan_of(planned(base, ranges_of(ranges or []), known_numbers(known) or None, seed or 0)))
        return
    recording = synthetic.record(
        base, str(test), duration=duration, rate=rate, noise=noise, quantum=quantum, height=height, current=current,
        hold=hold, added_mass=added_mass, repeats=repeats, free_stroke=free_stroke, start=start_in_use(start),
        u=swept(chirp, duration, control_rate or rate) if chirp else u_steps or u, control_rate=control_rate,
        dead_time=dead_time, seed=seed,
    )  # fmt: skip
    if plan:
        weighed = "m_eff" if test in ("step", "air") else "m_s"  # what is taken as known if nothing is given
        given = known_numbers(known) or {weighed: getattr(base, weighed)}
        letters = {field.name: getattr(base, field.name) for field in base.fields()} | {"length": base.L0 + base.c}
        show(reports.tables_of(check({str(test): [recording]}, given, letters)))
        return
    outputs.emit(list, csv=lambda: synthetic.to_csv(recording))
