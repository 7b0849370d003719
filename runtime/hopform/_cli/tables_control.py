"""What `hopform control` and `hopform reach` print: tables for people, records for JSON; generated/JSON.md explains the
last.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from rich.console import RenderableType
from rich.text import Text

from hopform import Command, FixedPoint, PrintedCommand, Reachability, Robot
from hopform._cli.bands import Band, Bands, Draws, text_of
from hopform._cli.render import Record, number, pick, table
from hopform._cli.tables import robot_record
from hopform._show import name_of

STATUSES = {
    "reached": "reaches the desired apex",
    "nearest": "cannot reach the desired apex; this comes nearest",
    "no_takeoff": "has no admissible current: no take-off, or the stroke is too short",
}
PRINTED: dict[str, dict[str, Any]] = {
    "as printed": {},
    "(26) without the 1/2": {"half": False},
    "the same with the step's sign": {"half": False, "signed": True},
    "as printed, with the spring coordinate": {"spring_coordinate": True},
    "all three": {"half": False, "signed": True, "spring_coordinate": True},
}
"""Forms of the printed controller, with the options of `choose_current_as_printed` that make them."""


def command(
    robot: Robot,
    h_des: float,
    found: Command,
    printed: list[tuple[str, PrintedCommand]],
    drawn: Draws | None,
    band: Band | None,
) -> Iterator[RenderableType]:
    """The controller's answer, and what the printed forms would have done."""
    yield Text(f"{name_of(robot)}: {STATUSES[found.status]}", style="bold")
    yield ""
    shown: list[tuple[str, Command | PrintedCommand]] = [("exact", found), *printed]
    rows = (
        (words, f"{each.u:.9g}", number(each.apex, ".6g", 100.0), number(each.apex - h_des, "+.2g", 100.0))
        for words, each in shown
    )
    yield table("Currents", ("controller", "u [A]", "apex [cm]", "off by [cm]"), rows, ("controller",))
    yield ""
    if drawn and band:
        yield f"Under the exact current 95 % of the apexes are {text_of(band)} cm. {drawn.said()}"
    yield f"{found.solved} stances were solved. Heights are hop heights."


def command_record(
    robot: Robot,
    asked: Record,
    found: Command,
    printed: list[tuple[str, PrintedCommand]],
    drawn: Draws | None,
    band: Band | None,
) -> Record:
    """The same for JSON."""
    return {
        "robot": robot_record(robot),
        **asked,
        **pick(found, "status", "u", "apex", "solved"),
        "printed": [{"form": words, **pick(each, "u", "apex", "objective", "status")} for words, each in printed],
        "band": band,
        "draws": drawn and drawn.record(),
    }


def reach(found: Reachability, drawn: Draws | None, bands: Mapping[str, Bands] | None) -> Iterator[RenderableType]:
    """A map: bounds and holds by height, then the fixed points."""
    held = np.isfinite(found.hold)
    head = f"{name_of(found.robot)}: {int(held.sum())} of {held.size} heights can be held"
    yield Text(head, style="bold")
    yield ""
    columns = (
        "height [cm]", "lowest [cm]", "at [A]", "highest [cm]", "at [A] ", "held by [A]", "gaps [A]", "limited by "
        "stroke", *(BANDS.values() if bands else ()),
    )  # fmt: skip
    rows = (_height_row(found, row, bands) for row in range(found.heights.size))
    yield table("Next apex", columns, rows, ("gaps [A]",))
    if found.fixed_points:
        yield ""
        yield table(
            "Fixed points", ("u [A]", "height [cm]", "multiplier", "hop"), map(_point_row, found.fixed_points), ("hop",)
        )
    yield ""
    yield "Heights are hop heights. Gaps and the stroke's share are those of the currents of the map."
    if drawn:
        yield drawn.said()


BANDS = {"lowest": "lowest, 95 % [cm]", "highest": "highest, 95 % [cm]", "hold": "held by, 95 % [A]"}
"""What has a band at each height, and its heading."""


def reach_record(found: Reachability, drawn: Draws | None, bands: Mapping[str, Bands] | None) -> Record:
    """The same for JSON."""
    names = ("u", "height", "multiplier", "stable", "admissible")
    return {
        "robot": robot_record(found.robot),
        "stop_margin": found.stop_margin,
        "rows": [_row_record(found, row, bands) for row in range(found.heights.size)],
        "fixed_points": [pick(point, *names) for point in found.fixed_points],
        "draws": drawn and drawn.record(),
    }


def _row_record(found: Reachability, row: int, bands: Mapping[str, Bands] | None) -> Record:
    names = ("lowest", "u_lowest", "highest", "u_highest", "hold")
    cells = zip(found.currents, found.apex[row], found.admissible[row], strict=True)
    return {
        "height": float(found.heights[row]),
        **{name: float(getattr(found, name)[row]) for name in names},
        "gaps": [{"above": low, "below": high} for low, high in found.gaps(row)],
        **{f"{name}_band": bands and bands[name].at(row) for name in BANDS},
        "cells": [
            {"u": float(u), "apex": float(apex), "admissible": bool(fine), "band": bands and bands["apex"].at(row, n)}
            for n, (u, apex, fine) in enumerate(cells)
        ],
    }


def _height_row(found: Reachability, row: int, bands: Mapping[str, Bands] | None) -> tuple[str, ...]:
    gaps = ", ".join(f"{low:.3g}..{high:.3g}" for low, high in found.gaps(row))
    share = float(np.count_nonzero(found.limited[row])) / found.currents.size
    shown = {name: each for name, each in (bands or {}).items() if name in BANDS}
    return (
        f"{100.0 * float(found.heights[row]):.5g}",
        number(float(found.lowest[row]), scale=100.0),
        number(float(found.u_lowest[row])),
        number(float(found.highest[row]), scale=100.0),
        number(float(found.u_highest[row])),
        number(float(found.hold[row])),
        gaps or "-",
        f"{100.0 * share:.0f} %",
        *(text_of(each.at(row), 1.0 if name == "hold" else 100.0) for name, each in shown.items()),
    )


def _point_row(point: FixedPoint) -> tuple[str, ...]:
    words = "settles" if point.stable else "leaves"
    return (
        f"{point.u:.5g}",
        f"{100.0 * point.height:.5g}",
        f"{point.multiplier:.4f}",
        words if point.admissible else f"{words}, beyond the stroke",
    )
