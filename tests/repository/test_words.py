"""Words that this project coined do not come back: where the field has a word, the pages use it.

Identifiers are looked for everywhere; plain words in prose alone, because a public name may contain one.
"""

import re
from pathlib import Path

import pytest

ROOT = next(folder for folder in Path(__file__).resolve().parents if (folder / "pyproject.toml").is_file())
COVERED = (
    "README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs", "templates", "derive", "runtime/hopform", "tools",
    "tests/bench", "tests/conformance", "tests/fuzz", "tests/oracle", "tests/unit",
)  # fmt: skip
"""Files and folders that are read."""

SUFFIXES = {".md", ".py", ".j2", ".toml"}
QUOTING = {"docs/evidence/c-mutants.md"}
"""Pages that quote lines of the engine, whose identifiers are its own."""

COINED = {
    "settle_window": "root isolation",
    "close_window": "search interval",
    "look_ahead": "predictor",
    "reach_ahead": "predictor",
    "left_to_go": "residual to steady state",
    "root_is_later": "correction from the steady-state form",
    "behind_the_pole": "deflated numerator",
    "is_held_up": "lower bound by tangents",
    "swing_to_zero": "predictor",
    "halt_time": "time to rest",
    "quiet_until": "root-free interval",
    "dips_are_quiet": "lower bound of the minima",
    "keeps_sign": "no root",
    "loses_sign": "one root",
    "fresh_1": "just_switched",
    "fresh_2": "just_switched",
    "promise_of": "lower_bound",
    "go_on": "branch",
    "take_in": "prune, branch",
    "told": "identified, returned, reported",
    "untold": "not identified",
    "foretold": "predicted",
    "foretell": "predict",
    "foretells": "predicts",
    "killer": "killed by",
    "doubt": "rounding-error bound",
    "doubts": "rounding-error bounds",
    "blurred": "within the rounding-error bound",
    "faint": "small, below the underflow floor",
    "dip": "minimum of the compression",
    "dips": "minima of the compression",
    "outlook": "predictor",
    "patience": "retry budget",
    "halts": "comes to rest",
    "swings": "oscillates, half periods",
    "sift": "prune",
    "desk": "buffers",
    "half turn": "half period",
    "half turns": "half periods",
    "held up": "bounded from below",
    "behind the pole": "deflated numerator",
    "behind the real pole": "deflated",
    "left of the way": "residual to steady state",
    "way to it": "residual to steady state",
    "the watches": "the event functions",
    "a watch": "an event function",
    "watched functions": "active event functions",
    "watched for": "active",
    "measured anew": "measured again, in the commit that changes the code",
}
"""Each word that went, and the field's word for it."""


def files() -> list[Path]:
    """The files that are read."""
    found = [path for name in COVERED for path in ([ROOT / name] if "." in name else sorted((ROOT / name).rglob("*")))]
    return [path for path in found if path.suffix in SUFFIXES]


def prose(path: Path) -> str:
    """A page without its code; any other file as it is. One line, so that a word pair may be broken in two."""
    text = path.read_text("utf-8")
    if path.suffix == ".md":
        text = re.sub(r"`[^`\n]*`", "", re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE))
    return re.sub(r"\s+", " ", text)


def coined(text: str, identifiers: str = "") -> dict[str, str]:
    """The coined words of a text, and of its identifiers, with the field's words for them."""
    return {
        word: field
        for word, field in COINED.items()
        if re.search(rf"(?<![\w-]){word}(?![\w-])", identifiers if "_" in word else text, re.IGNORECASE)
    }


@pytest.mark.parametrize("path", files(), ids=lambda path: str(path.relative_to(ROOT)))
def test_a_page_has_the_words_of_the_field(path):
    name = str(path.relative_to(ROOT))
    found = coined(prose(path), "" if name in QUOTING else path.read_text("utf-8"))
    assert found == {}


def test_the_aed_is_spelt_out_on_each_page_that_has_it():
    pages = [path.read_text("utf-8") for path in files() if path.suffix == ".md" and path.name != "CHANGELOG.md"]
    named = [text for text in pages if re.search(r"\bAED\b", text)]
    assert len(named) > 5
    assert [text[:80] for text in named if "analytical energy delta" not in re.sub(r"\s+", " ", text).lower()] == []


def test_a_coined_word_is_found():
    assert len(files()) > 150
    found = coined("What the hit says was foretold, in a half turn.")
    assert found == {"foretold": "predicted", "half turn": "half period"}
    assert coined("", "static void settle_window_real(") == {}
    assert coined("", "settle_window(guard)") == {"settle_window": "root isolation"}
    assert coined("a tolerance, undoubted, adipose, a half-turned leaf") == {}
