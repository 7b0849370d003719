"""A fact stands once: altered objects are handed to the renderer, and every header, mirror, check and table has them.

No text is patched. What is altered is a parameter of a domain that no other has, the entry of the ledger that a further
term brings, a word of events and a status.
"""

import importlib
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hopform
from derive.emit.folder import write
from derive.emit.render import render
from derive.model import kinds
from hopform._solver import c as native
from hopform._solver.build import compile_solver
from hopform._solver.c import C
from hopform._solver.package import Package
from tests.derived import hopper_with, loaded

MODEL = hopper_with(
    r"""
seal = parameter("seal", "N s/m", "drag of a seal", "fraction", 0.25, glyph=r"\zeta")
viscous(h.x1, seal, "seal drag")
"""
)
ENTRY = "seal_drag_1"
"""What the term enters in the ledger as."""


@pytest.fixture(scope="module")
def altered(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("facts") / "out"
    write(render(MODEL), folder)
    return folder


@pytest.fixture(scope="module")
def package(altered) -> Any:
    return loaded(altered, "sealed_solver")


def lines(altered: Path, name: str, word: str) -> list[str]:
    return [line for line in (altered / name).read_text("utf-8").splitlines() if word in line]


def test_a_new_parameter_stands_in_every_table(altered, package):
    for precision in ("f32", "f64"):
        assert lines(altered, f"c/include/hopform/hopform_{precision}.h", "seal;")
    assert "EACH(seal, FRACTION)" in lines(altered, "c/src/facts.h", "HOPFORM_ROBOT_MEMBERS")[0]
    assert lines(altered, "c/README.md", "`seal`") == ["| `seal` | \\zeta | N s/m | >= 0 and < 1 | drag of a seal |"]
    structs = importlib.import_module("sealed_solver.structs").STRUCTS
    assert structs["Robot"][-1] == ("seal", "real", 1)
    assert dict((name, count) for name, _, count in structs["StancesIn"])["robot"] == 18
    assert package.ROBOT_FIELDS[-1] == ("seal", r"\zeta", "N s/m", "fraction", "drag of a seal", 0.25)
    objects = json.loads((altered / "schema.json").read_text("utf-8"))["$defs"]
    assert list(objects["robot"]["properties"])[-2:] == ["seal", "travel"]
    assert list(objects["derivatives"]["properties"])[-1] == "seal"
    assert lines(altered, "JSON.md", "`seal`") == [
        "| `seal` | number or null | per N s/m |",
        "| `seal` | number | N s/m, drag of a seal |",
    ]
    assert lines(altered, "packages/example.c", "25.0f, 3.0f")[0].endswith(", 0.25f")


def test_a_new_entry_of_the_ledger_stands_in_every_table(altered, package):
    for precision in ("f32", "f64"):
        assert lines(altered, f"c/include/hopform/hopform_{precision}.h", f"{ENTRY};")
    assert f"EACH({ENTRY}, REAL)" in lines(altered, "c/src/facts.h", "HOPFORM_LEDGER_MEMBERS")[0]
    records = importlib.import_module("sealed_solver.records")
    assert records.Ledger._fields[-1] == records.LEDGER_OF_ROBOT[-1] == ENTRY
    assert ENTRY not in records.LEDGER_OF_BODY
    assert importlib.import_module("sealed_solver.structs").STRUCTS["Ledger"][-1] == (ENTRY, "real", 1)
    assert lines(altered, "JSON.md", f"`{ENTRY}`")
    assert ENTRY in json.loads((altered / "schema.json").read_text("utf-8"))["$defs"]["ledger"]["required"]


@pytest.mark.sliced
def test_what_is_altered_builds_and_is_checked_by_c_and_python(altered, package):
    library = altered / "sealed.so"
    compile_solver(altered, library, "-O0")
    solver = C(native.Library(library, "hopform", Package("sealed_solver")))
    hopper = hopform.load_robot("hopper_c")
    robot = tuple(getattr(hopper, field.name) for field in package.ROBOT_FIELDS[:-1])
    start, steps = package.LegState(0.0, 0.0, -1.93, 0.0), ((0.0, 2.0),)
    by_c = solver.solve_stance((*robot, 0.5), start, steps, 2.0, 64, np.dtype(np.float64)).outcome()
    records = importlib.import_module("sealed_solver.records")
    assert records.ENDINGS[by_c[0]] == "takeoff"
    with pytest.raises(hopform.HopformError, match="out of its domain"):
        solver.solve_stance((*robot, 1.0), start, steps, 2.0, 64, np.dtype(np.float64))
    with pytest.raises(ValueError, match=r"seal must be >= 0 and < 1 N s/m, got 1\.0"):
        importlib.import_module("sealed_solver.robot").Robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, seal=1.0)


@pytest.mark.sliced
def test_a_new_word_stands_in_every_table(monkeypatch):
    """A kind of event and a status, as if the engine returned them."""
    event, status = kinds.Word(8, "x2_hits_stop", "the body meets a stop"), kinds.Word(-15, "error_weather", "it rains")
    longer = tuple(
        replace(kind, words=(*kind.words, {"EVENTS": event, "STATUSES": status}[kind.table]))
        if kind.table in ("EVENTS", "STATUSES")
        else kind
        for kind in kinds.KINDS
    )
    monkeypatch.setattr(kinds, "KINDS", longer)
    monkeypatch.setattr(kinds, "STATUSES", longer[0])
    texts = {path.as_posix(): text for path, text in render().items()}
    header = texts["c/include/hopform/hopform.h"]
    assert "#define HOPFORM_EVENT_X2_HITS_STOP 8 /**< the body meets a stop */" in " ".join(header.split())
    assert "#define HOPFORM_ERROR_WEATHER (-15) /**< it rains */" in " ".join(header.split())
    assert "| 8 | `HOPFORM_EVENT_X2_HITS_STOP` | the body meets a stop |" in texts["c/README.md"]
    records = texts["python/hopform_solver/records.py"]
    assert '    8: "x2_hits_stop",  # the body meets a stop\n' in records
    assert '    -15: "it rains",\n' in records
    assert "`x2_slips` or `x2_hits_stop`" in texts["JSON.md"]
    kind = json.loads(texts["schema.json"])["$defs"]["event"]["properties"]["kind"]
    assert kind["enum"][-1] == "x2_hits_stop"
