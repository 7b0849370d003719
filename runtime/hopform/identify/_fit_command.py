"""`hopform --solver DIR|NAME fit`: the parameters of any model from recordings of its motion, as `hopform.identify.fit` has them."""

from dataclasses import replace
from pathlib import Path
from typing import cast

from hopform import HopformError
from hopform._cli.use import core
from hopform.extend import in_use, progress_bar
from hopform.identify import _commands
from hopform.identify._commands import (
    SimulatorFormat,
    added_masses,
    check_fit_outputs,
    files_of,
    give,
    model_of,
    options_of,
    pairs_of,
    refuse_no_fit,
)
from hopform.identify._force import fit_force
from hopform.identify._models import fit as fit_model_of
from hopform.identify._models import seen_by
from hopform.identify._motion import Values
from hopform.identify._recordings import read_recording

OPTIONS, EXAMPLES = _commands.OPTIONS, _commands.EXAMPLES


def fit(
    files: list[str], fitted: str | None = None, known: list[str] | None = None, near: list[str] | None = None,
    sine: bool = False, rate: float | None = None, in_force: bool = False, gain: bool = False, clock: bool = False, lag: bool = False, added_mass: str = "", loss: str = "linear",
    out: Path | None = None, export: SimulatorFormat | None = None, report: Path | None = None, json: bool = False,
    plot: Path | None = None,
) -> None:  # fmt: skip
    """Fit the parameters of any model to CSV recordings of its motion.

    The model may be a joint, a cart or a pendulum. Columns are named after the model's coordinates and input, each with
    its unit, as in time_s,q_rad,i_A.
    """
    check_fit_outputs([("the recording", each) for each in files], json, out, export, report, plot)
    names = None if fitted is None else [each.strip() for each in fitted.split(",")]
    masses = added_masses(added_mass, len(files))
    given, starts = pairs_of("--known", known, names_too=True), cast(Values, pairs_of("--near", near))
    with progress_bar("identification") as advance:
        how = options_of(loss, {"gain": gain, "clock": clock, "lag": lag}, advance)
        recordings = [replace(read_recording(name), added_mass=mass) for name, mass in zip(files, masses, strict=True)]
        if in_force:
            if starts or sine or rate is not None:
                raise HopformError(
                    "--in-force is a linear fit under the recorded input: without --near, --sine and --rate"
                )
            result = fit_force(in_use(), recordings, fitted=names, known=given, **how)
        else:
            result = fit_model_of(
                in_use(), recordings, fitted=names, known=given, start=starts, sine=sine, rate=rate, **how
            )
        stops = [each["name"] for each in core().facts.parameters if each["domain"] in ("lower", "upper")]
        refuse_no_fit(result, [seen_by(core(), each) for each in recordings], stops)
        model, more = model_of(result, export)
        written = files_of(result, None, out, report, plot, model)
    give(result, written, more, "" if out else model, json)
