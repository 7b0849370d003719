"""Words that this project coined do not come back: where the field has a word, pages, messages and names use it."""

import ast
import re
from pathlib import Path

import hopform

ROOT = next(folder for folder in Path(__file__).resolve().parents if (folder / "pyproject.toml").is_file())
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
SPEAKING = ("runtime/hopform", "derive", "tools")
"""Folders of Python whose messages and docstrings are read."""

COINED = {
    "wanted apex": "desired apex",
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
    # Repeats show whether a rig repeats; what a model lacks moves every recording alike.
    "quote": "the parameters with their intervals",
    "three times, whose": "change amplitude or load",
    "record it three times": "change amplitude or load",
    "record each three times": "change amplitude or load",
    "record each motion three times": "change amplitude or load",
    "three recordings give an interval": "change amplitude or load",
    "spread is the interval": "repeatability of the rig",
    "interval of their mean": "standard deviation of the values",
    "intervals of their mean": "standard deviation of the values",
    "from where it carries nothing": "spring deflection, from its free length",
    "hops on after": "hops completed",
    "cannot stance": "no stance: the model has no contact()",
    "programs are run": "runs its code",
    "is no parameter that is": "unknown parameter, free ones are",
    "less its prediction": "energy balance residual",
    "held sets": "modes",
    "so its end says all": "monotone: its end decides",
    "or the spring pulls": "a contact cannot pull",
    "and so much later": "further delay",
}
"""Each word that went, and the field's word for it."""

ENGINE = {
    "held up": "stays positive",
    "tally": "variation",
    "passage": "solved phase",
    "show phase": "notify",
    "way": "variation, displacement, moved",
    "echo": "self convolution",
    "echoes": "self convolution",
    "coarse": "widest unlike",
    "lean": "margin cubic",
    "falls from rest": "contact unloads",
    "wins a tie": "tie-break priority",
    "win a tie": "tie-break priority",
    "told": "returned, reported",
    "says more": "is more accurate",
}
"""Further words that went from the engine: there each part of a name is a word."""


def prose(page: Path) -> str:
    """A page without its code, as one line, so that a word pair may be broken in two."""
    return re.sub(r"`[^`\n]*`", "", re.sub(r"^```.*?^```", "", page.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE))


def messages(path: Path) -> str:
    """The texts in a file of Python: what it says, and its docstrings."""
    constants = (node.value for node in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(node, ast.Constant))
    return " ".join(value for value in constants if isinstance(value, str))


def engine() -> dict[str, str]:
    """The engine's sources but those of others, each part of a name a word of its own."""
    every = sorted((ROOT / "runtime" / "engine").rglob("*"))
    sources = (path for path in every if path.suffix in (".c", ".h", ".py") and path.parent.name != "vendored")
    return {str(path.relative_to(ROOT)): path.read_text("utf-8").replace("_", " ") for path in sources}


def public_names() -> str:
    """What Python and C offer, in words."""
    headers = (ROOT / "generated" / "c" / "include").rglob("*.h")
    in_c = {name for path in headers for name in re.findall(r"\bhopform_\w+", path.read_text("utf-8"))}
    return " ".join([*hopform.__all__, *in_c]).replace("_", " ")


def coined(text: str, words: dict[str, str] = COINED) -> dict[str, str]:
    """The coined words of a text, with the field's words for them; the text may have them with spaces in between."""
    flat = re.sub(r"[\s*]+", " ", text).lower()
    return {
        word: field
        for word, field in words.items()
        if word in flat and re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", flat)
    }


def test_pages_messages_and_public_names_have_the_words_of_the_field():
    texts = {str(page.relative_to(ROOT)): prose(page) for page in PAGES}
    for folder in SPEAKING:
        texts |= {str(path.relative_to(ROOT)): messages(path) for path in sorted((ROOT / folder).rglob("*.py"))}
    texts["public names"] = public_names()
    assert len(texts) > 100
    assert {name: found for name, text in texts.items() if (found := coined(text))} == {}


def test_names_and_comments_of_the_engine_have_the_words_of_the_field():
    words = {word.replace("_", " "): field for word, field in (COINED | ENGINE).items()}
    texts = engine()
    assert len(texts) > 25
    assert {name: found for name, text in texts.items() if (found := coined(text, words))} == {}


def test_the_aed_is_spelt_out_on_each_page_that_has_it():
    named = [text for text in map(prose, PAGES) if re.search(r"\bAED\b", text)]
    assert len(named) > 5
    assert [text[:80] for text in named if "analytical energy delta" not in re.sub(r"\s+", " ", text).lower()] == []


def test_a_coined_word_is_found():
    found = coined("What the hit says was foretold, in a half\nturn.")
    assert found == {"foretold": "predicted", "half turn": "half period"}
    assert coined("a tolerance, undoubted, adipose, a half-turned leaf") == {}
    of_a_name = coined("static inline real way_in_flight_real(".replace("_", " "), ENGINE)
    assert of_a_name == {"way": "variation, displacement, moved"}


EMPTY = {"each", "found", "made", "of", "own", "wanted"}
"""What says nothing of a value that has it for a name; in a comprehension, and in the key of a sort, `each` is fine."""

NAMED_BY_CONTENT = (
    "derive/maths", "derive/model", "runtime/hopform/hopping", "runtime/hopform/identify", "runtime/hopform/_solver",
    "runtime/hopform/_robots", "runtime/hopform/_control.py", "runtime/hopform/_flight.py",
)  # fmt: skip
"""Folders and modules whose functions bind none of EMPTY."""

COMPREHENSIONS = ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp | ast.Lambda


def bound_in(node: ast.AST, function: str = "") -> set[tuple[str, str]]:
    """The names that functions bind, each after its function: variables, and arguments other than `of`, which callers
    write before what it is of.
    """
    names = set[tuple[str, str]]()
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Name) and isinstance(child.ctx, ast.Store) and function:
            names.add((function, child.id))
        elif isinstance(child, ast.arg) and child.arg != "of":
            names.add((function, child.arg))
        if not isinstance(child, COMPREHENSIONS):
            inside = {ast.FunctionDef: getattr(child, "name", ""), ast.ClassDef: ""}.get(type(child), function)
            names |= bound_in(child, inside)
    return names


def test_a_variable_is_named_by_what_it_holds():
    paths = [
        path
        for room in NAMED_BY_CONTENT
        for path in ([ROOT / room] if room.endswith(".py") else (ROOT / room).glob("*.py"))
    ]
    assert len(paths) > 60
    empty = {
        f"{path.relative_to(ROOT)}, {function}: {name}"
        for path in paths
        for function, name in bound_in(ast.parse(path.read_text("utf-8")))
        if name in EMPTY
    }
    assert not empty, sorted(empty)


def test_a_variable_that_says_nothing_is_found():
    text = "def f(made):\n    for each in made: found, x = each\n    return [own for own in x], lambda wanted: 0\n"
    text += "class A:\n    own: int\n    def g(self, of): self.found = of; of = 1\n"
    assert {name for name in bound_in(ast.parse(text)) if name[1] in EMPTY} == {
        ("f", "made"), ("f", "each"), ("f", "found"), ("g", "of"),
    }  # fmt: skip
