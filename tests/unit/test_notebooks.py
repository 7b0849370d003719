"""The tutorial is a notebook: it runs as it stands, every step has a picture, and results print little."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "tutorials" / "afternoon.md"
MOST_LINES = 200
"""Lines of text that a notebook with all types of results may print."""


def executed(page: Path, folder: Path):
    """The notebook of a page after its cells have run in a folder."""
    jupytext = pytest.importorskip("jupytext")
    preprocessors = pytest.importorskip("nbconvert.preprocessors")
    notebook = jupytext.read(page, fmt="md:myst")
    preprocessors.ExecutePreprocessor(timeout=300).preprocess(notebook, {"metadata": {"path": str(folder)}})
    return notebook


@pytest.mark.nightly
def test_the_tutorial_runs_every_step_has_a_picture_and_it_prints_little(tmp_path):
    """Its twelve and more cells show each type of result."""
    notebook = executed(PAGE, tmp_path)
    pictures, lines, text = dict[str, int](), 0, ""
    step = ""
    for cell in notebook.cells:
        step = (re.findall(r"^## (\d+)\. ", cell.source, re.MULTILINE) or [step])[-1]
        for output in cell.get("outputs", []):
            data = output.get("data", {})
            assert output.output_type != "error" and output.get("name") != "stderr", output
            pictures[step] = pictures.get(step, 0) + any(
                kind.startswith("image/") or "data:image/gif" in str(body) for kind, body in data.items()
            )
            printed = str(data.get("text/plain", output.get("text", "")))
            lines, text = lines + len(printed.splitlines()), f"{text}\n{printed}"
    assert all(pictures.get(str(number), 0) >= 1 for number in range(2, 12)), pictures
    assert sum(cell.cell_type == "code" for cell in notebook.cells) >= 12 and lines < MOST_LINES
    for kind in ("Stance", "Fit", "Recording", "Command", "Hop", "Sensitivities", "Run", "Animation", "Reachability"):
        assert re.search(rf"^{kind}\b", text, re.MULTILINE), kind
    assert {path.name for path in tmp_path.iterdir()} == {"board", "hopping.csv", "hopping.pdf", "mine.toml"}
    assert "NOT IDENTIFIED" in (tmp_path / "mine.toml").read_text("utf-8")


@pytest.mark.sliced
def test_a_cell_that_fails_fails_the_notebook(tmp_path):
    broken = tmp_path / "broken.md"
    broken.write_text(PAGE.read_text("utf-8").split("## 1.")[0] + "```{code-cell}\n1 / 0\n```\n", "utf-8")
    with pytest.raises(Exception, match="ZeroDivisionError"):
        executed(broken, tmp_path)
