"""What a figure shows, read back from matplotlib's artists: lines, staircases and bands in SI units, words with the room
that they take, markers. All tests of pictures read figures here.

`check` compares a panel with what it must show: each line by its name, and no line without an oracle. `faults` finds
what is wrong with any picture: words that overlap or leave it, markers on the frame, axes without a name, curves that no
legend names.
"""

import itertools
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import PathCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.patches import Rectangle, StepPatch
from matplotlib.text import Text
from matplotlib.transforms import Bbox

FACTORS = {"m": 1.0, "cm": 100.0, "mm": 1000.0, "s": 1.0, "ms": 1000.0, "%": 100.0} | dict.fromkeys(
    ("A", "V", "N", "J", "m/s", "mm/s", "1/s", "index", "of the step", "of its step"), 1.0
)
"""Numbers of an axis to one of SI; those of an axis without a unit are taken as they are."""


# ---- what it shows ----


class Over(NamedTuple):
    """A method, drawn over times from one to another."""

    method: Callable[[Any], Any]
    begin: float
    end: float


Expected = Any
"""`Over`, or the values over x and y; None for what is a share of the panel."""


class Panel(NamedTuple):
    """The lines by their names, "" for those without, each an `Expected` or a list; bands as x, low, high; stances."""

    lines: Mapping[str, Expected]
    bands: Mapping[str, tuple[Any, Any, Any]] = {}
    stances: Sequence[tuple[float, float]] = ()


ANY_SHADES = ((0.0, 0.0),)
"""Shades of modes, which test_plots reads."""


def factor(axes: Axes, which: str) -> float:
    """What the numbers of an axis are to be divided by, from the unit in its name; a shared one has it below."""
    shared = axes.get_shared_x_axes().get_siblings(axes) if which == "x" else [axes]
    names = [getattr(each, f"get_{which}label")() for each in shared]
    units = {match[1] for name in names if (match := re.search(r"\[([^]]+)\]", name))}
    assert len(units) <= 1
    return FACTORS[units.pop()] if units else 1.0


def curves(axes: Axes) -> dict[str, Any]:
    """x and y of the lines by their names, as they stand on the axes."""
    return {str(line.get_label()): line.get_xydata().T for line in axes.get_lines()}


def curves_of(axes: Axes) -> Iterator[tuple[str, Any, Any]]:
    """Names, x and y of the lines and staircases, in SI; None for a share of the panel."""
    for line in axes.get_lines():
        x, y = (
            np.asarray(values, float) / factor(axes, which) for values, which in zip(line.get_data(), "xy", strict=True)
        )
        x_is_data, y_is_data = line.get_transform().contains_branch_seperately(axes.transData)
        yield line.get_label(), x if x_is_data else None, y if y_is_data else None
    for stairs in axes.patches:
        if isinstance(stairs, StepPatch):
            values, edges, _ = stairs.get_data()
            yield stairs.get_label(), edges / factor(axes, "x"), values / factor(axes, "y")


def corners(x, y):
    """Points, to the nanometre."""
    return set(zip(np.round(x, 9), np.round(y, 9), strict=True))


def near(found, expected):
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def check_line(x, y, expected: Expected, moved: bool) -> None:
    """moved: milliseconds and back may have moved a time before a corner, behind which it is put again."""
    if isinstance(expected, Over):
        assert x.size > 100 and np.all(np.diff(x) >= 0.0)
        near(x[[0, -1]], (expected.begin, expected.end))
        t = np.minimum(x * (1.0 + 4e-16), expected.end) if moved else x
        near(y, expected.method(t))
        return
    for found, values in zip((x, y), expected, strict=True):
        assert (found is None) == (values is None)
        if values is not None:
            near(found, np.broadcast_to(values, np.shape(values) or found.shape))


def check(axes: Axes, panel: Panel) -> None:
    """A panel shows these lines, bands and stances, and no others."""
    found: dict[str, list] = {}
    for name, x, y in curves_of(axes):
        found.setdefault("" if name.startswith("_") else name, []).append((x, y))
    assert found.keys() == panel.lines.keys()
    for name, drawn in found.items():
        expected = panel.lines[name] if isinstance(panel.lines[name], list) else [panel.lines[name]]
        for (x, y), each in zip(drawn, expected, strict=True):
            check_line(x, y, each, factor(axes, "x") != 1.0)
    bands = [each for each in axes.collections if isinstance(each, PolyCollection)]
    assert {each.get_label() for each in bands} == panel.bands.keys()
    for band in bands:
        around = np.concatenate([path.vertices for path in band.get_paths()]) / (factor(axes, "x"), factor(axes, "y"))
        x, low, high = map(np.asarray, panel.bands[str(band.get_label())])
        there = np.isfinite(low + high)
        assert corners(*around.T) == corners(x[there], low[there]) | corners(x[there], high[there])
    spans = [(each.get_x(), each.get_x() + each.get_width()) for each in axes.patches if isinstance(each, Rectangle)]
    if panel.stances is not ANY_SHADES:
        near(np.reshape(spans, (-1, 2)), np.reshape(panel.stances, (-1, 2)))


# ---- what is wrong with it ----

SLACK = 0.5
"""[px] by which boxes of words may touch: they are rounded to pixels."""


class Words(NamedTuple):
    """A text, or a legend as a whole, and the room that it takes [px]."""

    text: str
    box: Bbox


def faults(figure: Figure, legends: bool = True) -> list[str]:
    """All that is wrong with a picture, in words; its layout is computed first. legends: whether it must have its own."""
    figure.draw_without_rendering()
    found = [overlaps, beyond_the_edge, markers_on_the_frame, names_of_axes, *([unexplained] if legends else [])]
    return [fault for each in found for fault in each(figure)]


def ticks_of(axis: Axis) -> Iterator[Text]:
    """Labels of the ticks that are drawn: those within the limits."""
    scaled = axis.get_transform().transform
    low, high = sorted(scaled(np.array(axis.get_view_interval())))
    room = 1e-9 * (high - low)
    for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
        if low - room <= scaled(np.array([tick.get_loc()]))[0] <= high + room:
            yield from (tick.label1, tick.label2)
    yield axis.get_offset_text()


def words_of(figure: Figure) -> list[Words]:
    """Every text that is drawn, and every legend: titles, names of axes and ticks, annotations."""
    texts: list[Text | Legend] = [*figure.texts, *figure.legends]
    texts += [each for each in (figure._suptitle,) if each is not None and each not in figure.texts]
    for axes in figure.axes:
        if not axes.get_visible() or not axes.axison:
            texts += axes.texts
            continue
        titles = (axes.title, axes._left_title, axes._right_title)
        legend = axes.get_legend()
        texts += [*titles, axes.xaxis.label, axes.yaxis.label, *axes.texts]
        texts += [*ticks_of(axes.xaxis), *ticks_of(axes.yaxis)]
        texts += [] if legend is None else [legend]
    found = list[Words]()
    for each in texts:
        said = " | ".join(one.get_text() for one in each.get_texts()) if isinstance(each, Legend) else each.get_text()
        if each.get_visible() and said.strip():
            found.append(Words(said, each.get_window_extent()))
    return found


def overlaps(figure: Figure) -> Iterator[str]:
    """Words that run into others."""
    for one, other in itertools.combinations(words_of(figure), 2):
        width = min(one.box.x1, other.box.x1) - max(one.box.x0, other.box.x0)
        height = min(one.box.y1, other.box.y1) - max(one.box.y0, other.box.y0)
        if min(width, height) > SLACK:
            yield f"{one.text!r} overlaps {other.text!r} by {width:.1f} x {height:.1f} px"


def beyond_the_edge(figure: Figure) -> Iterator[str]:
    """Words that are cut off where the figure ends."""
    for each in words_of(figure):
        out = max(figure.bbox.x0 - each.box.x0, each.box.x1 - figure.bbox.x1,
                  figure.bbox.y0 - each.box.y0, each.box.y1 - figure.bbox.y1)  # fmt: skip
        if out > SLACK:
            yield f"{each.text!r} leaves the figure by {out:.1f} px"


def markers_on_the_frame(figure: Figure) -> Iterator[str]:
    """Markers that a line of the frame crosses, or that are clipped where the frame has no line."""
    for axes in figure.axes:
        seen = {side for side in SIDES if axes.spines[side].get_visible()}
        for line in axes.get_lines():
            if not line.get_visible() or line.get_marker() in ("None", "none", None, "", " "):
                continue
            assert line.get_markevery() is None, "markers that are left out are not read"
            places = line.get_transform().transform(np.column_stack([line.get_xdata(), line.get_ydata()]))
            crossed = crossed_by(places, reach_of(line), axes.bbox)
            if found := {side for side in SIDES if crossed[side] and (line.get_clip_on() or side in seen)}:
                name = f"a marker {line.get_marker()!r} of {line.get_label()!r}"
                yield f"{name} lies on the frame of {axes.get_ylabel()!r}: {', '.join(sorted(found))}"
        for each in axes.collections:
            assert not isinstance(each, PathCollection), "markers are drawn by `plot`, whose artists are read"


SIDES = ("left", "right", "bottom", "top")


def reach_of(line: Any) -> tuple[float, float]:
    """Half of the width and height of a marker, its edge included [px]."""
    shape = line._marker.get_path().transformed(line._marker.get_transform()).get_extents()
    scale, edge = line.get_markersize() * line.figure.dpi / 72.0, line.get_markeredgewidth() * line.figure.dpi / 144.0
    return scale * shape.width / 2.0 + edge, scale * shape.height / 2.0 + edge


def crossed_by(places: Any, reach: tuple[float, float], frame: Bbox) -> dict[str, bool]:
    """The sides of a frame that markers at some places [px] reach beyond; markers outside of it are not drawn."""
    (x, y), (across, up) = places[np.isfinite(places).all(axis=1)].T, reach
    inside = (frame.x0 - SLACK <= x) & (x <= frame.x1 + SLACK) & (frame.y0 - SLACK <= y) & (y <= frame.y1 + SLACK)
    beyond = {"left": frame.x0 - x + across, "right": x + across - frame.x1,
              "bottom": frame.y0 - y + up, "top": y + up - frame.y1}  # fmt: skip
    return {side: bool(np.any(inside & (far > SLACK))) for side, far in beyond.items()}


NUMBER = re.compile(r"[\d.,+\-\N{MINUS SIGN}]+|\$.*\$")
"""What stands at a tick that is no word."""


def names_of_axes(figure: Figure) -> Iterator[str]:
    """Axes whose numbers have no name, and names that are longer than their panel, so that they run into the next."""
    for n, axes in enumerate(figure.axes):
        if not axes.axison:
            continue
        for which, axis in (("x", axes.xaxis), ("y", axes.yaxis)):
            labels = [text.get_text() for text in ticks_of(axis) if text.get_visible()]
            if not axis.label.get_text() and any(NUMBER.fullmatch(text) for text in labels):
                yield f"the {which} axis of panel {n} has no name"
        name, panel = axes.yaxis.label.get_window_extent(), axes.bbox
        if axes.get_ylabel() and name.height > panel.height + SLACK:
            yield f"{axes.get_ylabel()!r} is longer than its panel by {name.height - panel.height:.1f} px"


def unexplained(figure: Figure) -> Iterator[str]:
    """Lines and bands with a name that neither a legend of the figure nor a word beside them says."""
    legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes)]
    said = {text.get_text() for each in legends if each is not None for text in each.get_texts()}
    for axes in figure.axes:
        words = said | {each.get_text() for each in axes.texts}
        for name in axes.get_legend_handles_labels()[1]:
            if name not in words:
                yield f"{name!r} of {axes.get_ylabel()!r} is in no legend"
