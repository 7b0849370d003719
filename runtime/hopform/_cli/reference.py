"""The commands of the reference set: `hopform reference list`, `write` and `score`."""

import contextlib
import json as json_module
import math
import os
import sys
from collections.abc import Generator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from rich.console import RenderableType

from hopform import reference
from hopform._checks import shown
from hopform._cli.named import NAMED
from hopform._cli.output import deliver, number, spaced, table, to_json
from hopform._errors import HopformError
from hopform._files import name_of
from hopform._progress import progress_bar

FORM = ".3g"

# ---- hopform reference list ----


def reference_list(json: bool = False) -> None:
    """List the cases: what each tests, and which formats express it.

    Each case has an exact answer: states, events, and derivatives by its parameters.
    """
    NAMED.set(None)  # of no solver
    found = reference.cases()
    text = to_json("reference list", cases=[{**vars(each), **reasons(each)} for each in found]) if json else ""
    head = ("case", "title", "events", "derivatives", "margin", "MJCF", "URDF")
    deliver((), (), text, lambda: [table("", head, map(row_of_list, found), ("case", "title", "MJCF", "URDF"))])


def reasons(case: reference.Case) -> dict[str, str | None]:
    """Why a format cannot say a case, None where it can."""
    return {name: why or None for name, why in case.without.items()}


def row_of_list(case: reference.Case) -> Sequence[str]:
    counts = str(len(case.exact.events)), str(len(case.exact.gradients)), number(case.margin, ".2g")
    return case.name, case.title, *counts, *("no" if case.without[name] else "yes" for name in ("mjcf", "urdf"))


# ---- hopform reference write ----


def reference_write(folder: Path, json: bool = False) -> None:
    """Write the cases as files: JSON, MJCF and URDF.

    A README.md beside them explains the format. The files are CC0-1.0.
    """
    files = reference.write(folder)
    if json:
        print(json_module.dumps({"folder": str(folder), "files": [file.as_posix() for file in files]}, indent=2))
    else:
        print(f"{len(files)} files in {name_of(folder)}; begin with {name_of(folder / 'README.md')}")


# ---- hopform reference score ----


def reference_score(function: str, case: list[str] | None = None, json: bool = False) -> None:
    """Score a simulator: errors of states, creep, events, derivatives.

    FUNCTION takes a case and returns its states, as the help of `hopform.reference.score` says. It is called again at
    changed parameters, and its central differences are compared with the exact derivatives. What it prints goes to the
    error stream.
    """
    NAMED.set(None)
    chosen, scores = reference.cases(case), list[reference.Score]()
    with from_here(), contextlib.redirect_stdout(sys.stderr):
        simulate = loaded(function)
        with progress_bar("scoring") as bar:
            for n, each in enumerate(chosen):
                bar(n, len(chosen), f"scoring {each.name}")
                scores += reference.score(simulate, each.name)
    text = to_json("reference score", function=function, scores=scores) if json else ""
    deliver((), (), text, lambda: spaced(errors(scores), values(scores), derivatives(scores)))


@contextlib.contextmanager
def from_here() -> Generator[None, None, None]:
    """Modules of this directory are found, before those that are installed."""
    here = os.getcwd()
    sys.path.insert(0, here)
    try:
        yield
    finally:
        sys.path.remove(here)


def loaded(text: str) -> Any:
    """The function of MODULE:FUNCTION; HopformError where there is none."""
    module, _, name = text.partition(":")
    if not all(part.isidentifier() for part in (*module.split("."), *name.split("."))):
        raise HopformError(f"takes MODULE:FUNCTION, as in my_simulator:simulate, got {shown(text)}")
    try:
        found: Any = import_module(module)
    except ModuleNotFoundError as error:
        if error.name is not None and f"{module}.".startswith(f"{error.name}."):
            raise HopformError(f"there is no module {shown(module)}, neither in this directory nor installed") from None
        raise HopformError(f"{module} cannot be imported: {error}") from error
    except (Exception, SystemExit) as error:
        raise HopformError(f"{module} cannot be imported: {type(error).__name__}: {error}") from error
    for part in name.split("."):
        if not hasattr(found, part):
            raise HopformError(f"{module} has no {shown(name)}")
        found = getattr(found, part)
    if not callable(found):
        raise HopformError(f"{module}:{name} must be a function, got {shown(found)}")
    return found


def errors(scores: Sequence[reference.Score]) -> RenderableType:
    head = ("case", "unit", "rms", "rms velocity [/s]", "creep [/s]", "event times [s]", "missed", "extra")
    rows = [
        (each.case, each.unit, *(number(x, FORM) for x in (each.rms, each.rms_velocity, each.creep, each.event_error)),
         *("-" if count is None else str(count) for count in (each.missed, each.extra)))
        for each in scores
    ]  # fmt: skip
    return table("Errors", head, rows, ("case", "unit"))


def values(scores: Sequence[reference.Score]) -> RenderableType:
    exact = {each.name: each.exact for each in reference.cases()}
    rows = [
        (
            each.case,
            name,
            exact[each.case].units[name],
            number(value, ".6g"),
            number(each.values.get(name, math.nan), FORM),
        )
        for each in scores
        for name, value in exact[each.case].values.items()
    ]
    return table("Values", ("case", "value", "unit", "exact", "error"), rows, ("case", "value", "unit"))


def derivatives(scores: Sequence[reference.Score]) -> RenderableType:
    rows = [
        (score.case, each.of, each.by, *(number(x, ".6g") for x in (each.exact, each.differences, each.own)))
        for score in scores
        for each in score.gradients
    ]
    head = ("case", "of", "by", "exact", "by differences", "own")
    return table("Derivatives", head, rows, ("case", "of", "by"))
