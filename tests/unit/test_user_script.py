"""README's code as a user's script: pyright finds nothing wrong with it, and finds a word that no stance ends with."""

import doctest
import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("README.md", "docs/tutorials/first-hop.md", "docs/how-to/many-stances.md")


SETTINGS = {"typeCheckingMode": "standard", "reportUnnecessaryComparison": "error"}


def script(page: str) -> str:
    """The examples of a page without their prompts."""
    examples = doctest.DocTestParser().get_examples((ROOT / page).read_text("utf-8"))
    return "".join(example.source for example in examples)


def errors_of(folder: Path, **sources: str) -> list[str]:
    """What pyright finds in scripts outside of the checkout, as their users have it."""
    for name, source in sources.items():
        (folder / f"{name}.py").write_text(source, "utf-8")
    (folder / "pyrightconfig.json").write_text(json.dumps(SETTINGS), "utf-8")
    command = [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable, "-p", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    found = json.loads(done.stdout)
    assert found["summary"]["filesAnalyzed"] == len(sources), found["summary"]
    errors = [each for each in found["generalDiagnostics"] if each["severity"] == "error"]
    return [f"{Path(each['file']).stem}: {each['message']}" for each in errors]


@pytest.mark.sliced
def test_the_code_of_pages_passes_pyright_as_a_users_script(tmp_path):
    sources = {Path(page).stem.replace("-", "_").lower(): script(page) for page in PAGES}
    assert all("hopform." in source for source in sources.values())
    wrong = script("README.md") + '\nif stance.status == "take-off":\n    print(command.current)\n'
    found = errors_of(tmp_path, **sources, wrong=wrong)
    assert all(each.startswith("wrong: ") for each in found), found
    assert len(found) == 2 and any('"current"' in each for each in found) and any("take-off" in each for each in found)
