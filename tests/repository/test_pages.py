"""The pages on hopping and on figures are true: every command on them runs as it stands there."""

import re
from pathlib import Path

import pytest

from hopform import _cli as cli

DOCS = Path(__file__).resolve().parents[2] / "docs"


def commands(page: str) -> list[list[str]]:
    """The lines of a page that begin with hopform, without their comments."""
    text = (DOCS / page).read_text("utf-8")
    return [line.split("#")[0].split()[1:] for line in re.findall(r"^hopform .*$", text, re.MULTILINE)]


def test_the_commands_of_the_page_on_hopping_run_and_write_what_they_say(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("heights.csv").write_text("height\n0\n0.01\n-0.01\n", "utf-8")
    lines = commands("how-to/hop-over-terrain.md")
    assert len(lines) >= 2
    for arguments in lines:
        assert cli.main(arguments) == 0, arguments
        named = {word for word in arguments if re.search(r"\.(svg|csv|npz)$", word)}
        assert named and all(Path(name).stat().st_size > 0 for name in named)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("arguments", [each for each in commands("reference/figures.md") if "--only" in each])
def test_the_commands_of_the_page_on_figures_run(tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    assert cli.main(arguments) == 0
    asked = arguments[arguments.index("--only") + 1].split(",")
    suffix = "pdf" if "--format" in arguments else "png"
    assert {f"fig_{int(number):02d}.{suffix}" for number in asked} <= {path.name for path in Path("DIR").iterdir()}
