"""The pages are true when they are read: links and anchors lead somewhere, commands, options, targets and paths exist,
and the README's figures stand on the pages that it names. test_pages.py runs them.
"""

import ast
import contextlib
import importlib.util
import inspect
import io
import json
import os
import re
import shlex
import subprocess
from functools import cache
from pathlib import Path
from unittest import mock

import pytest

import hopform
import hopform.hopping
import hopform.identify
import hopform.jax
import hopform.reference
from hopform import _front as cli
from tests.conformance.firmware import costs

ROOT = next(folder for folder in Path(__file__).resolve().parents if (folder / "pyproject.toml").is_file())
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
LARGEST_PICTURE, LONGEST_PICTURE = 200_000, 2000
"""Bytes of a picture, lines of one in text."""
each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


@cache
def text_of(page: Path) -> str:
    return page.read_text("utf-8")


# ---- links ----

FENCE = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)


def anchors(page: Path) -> set[str]:
    """The anchors that GitHub makes of a page's headings, and those that the page sets itself."""
    text = text_of(page)
    headings = re.findall(r"^#+ +(.*)$", FENCE.sub("", text), re.MULTILINE)
    plain = (re.sub(r"\]\([^)]*\)|<[^>]*>", "", heading).lower() for heading in headings)
    made = {re.sub(r"[^\w\- ]", "", heading).strip().replace(" ", "-") for heading in plain}
    return made | set(re.findall(r'<a id="([^"]+)">', text))


def links(page: Path) -> list[tuple[Path, str]]:
    """The files and anchors that a page links to, in Markdown and in HTML; addresses of the web are left out."""
    text = FENCE.sub("", text_of(page))
    found = re.findall(r"\]\(([^)\s]+)\)", text) + re.findall(r"""\s(?:href|src)=["']([^"']+)["']""", text)
    pairs = [link.partition("#")[::2] for link in found if ":" not in link]
    return [((page.parent / path).resolve() if path else page, anchor) for path, anchor in pairs]


@each_page
def test_every_link_of_a_page_leads_somewhere(page):
    dead = [(str(path), anchor) for path, anchor in links(page) if not path.exists()]
    dead += [(str(path), anchor) for path, anchor in links(page) if anchor and anchor not in anchors(path)]
    assert not dead


def test_links_and_anchors_are_found():
    assert sum(len(links(page)) for page in PAGES) > 100
    assert sum(bool(anchor) for page in PAGES for _, anchor in links(page)) > 10
    assert ROOT / "docs" / "images" / "hopping.gif" in dict(links(README))  # in HTML
    assert "what-right-means" in anchors(ROOT / "docs" / "reference" / "model.md")
    assert "14" in anchors(ROOT / "generated" / "EQUATIONS.md")


def test_a_still_picture_of_the_pages_is_small():
    """Each version of it stays in the repository. A drawing in text has a line for each point."""
    pictures = [path for path in (ROOT / "docs").rglob("*") if path.suffix in (".png", ".svg")]
    large = [path.name for path in pictures if path.stat().st_size > LARGEST_PICTURE]
    large += [path.name for path in pictures if path.suffix == ".svg" and text_of(path).count("\n") > LONGEST_PICTURE]
    assert len(pictures) >= 5 and not large


def test_the_index_lists_every_page():
    index = ROOT / "docs" / "README.md"
    assert {page for page in PAGES if page.parent.parent == index.parent} - {path for path, _ in links(index)} == set()


def test_every_public_name_of_python_is_on_one_page_of_the_site():
    pages = (ROOT / "docs" / "site" / "python").glob("*.rst")
    listed = [
        name for page in pages for names in re.findall(r"{{api:([^}]+)}}", text_of(page)) for name in names.split()
    ]
    of_their_own = {"__version__", "ROBOTS", "hopping.controllers", "hopping.terrain"}
    rooms = {
        f"{room.__name__[8:]}.{name}"
        for room in (hopform.hopping, hopform.identify, hopform.jax, hopform.reference)
        for name in room.__all__
    }
    assert "extend.*" in listed  # all that is offered for extensions
    assert sorted({*listed} - {"extend.*"}) == sorted({*hopform.__all__, *rooms} - of_their_own)
    assert len(listed) == len({*listed})


# ---- what pages name ----


def code(page: Path) -> list[str]:
    """The lines of code blocks without an example's answers, and the code within lines."""
    text = text_of(page)
    blocks = [line for block in FENCE.findall(text) for line in block.splitlines()[1:-1]]
    return blocks + re.findall(r"`([^`\n]+)`", FENCE.sub("", text))


@cache
def options_of(command: str) -> str:
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), mock.patch.dict(os.environ, COLUMNS="200"):
        assert cli.main([*command.split(), "--help"]) == 0
    return printed.getvalue()


@each_page
def test_every_command_of_hopform_has_its_options(page):
    for line in code(page):
        words = re.split(r"\s+#\s", line)[0].split(" | ")[0].removeprefix(".venv/bin/").split()
        if len(words) < 2 or words[0] != "hopform" or words[1].startswith("-") or words[1].isupper():
            continue
        command = " ".join(words[1:3]) if words[1] in cli.GROUPS else words[1]
        assert command in cli.COMMANDS, line
        for option in (word.split("=")[0] for word in shlex.split(" ".join(words[2:])) if word.startswith("--")):
            assert option in options_of(command), line


@each_page
def test_every_make_target_exists(page):
    makefile = (ROOT / "Makefile").read_text("utf-8")
    for target in {line.split()[1] for line in code(page) if re.match(r"make [a-z]", line)}:
        assert re.search(rf"^{re.escape(target)}:", makefile, re.MULTILINE), target


@each_page
def test_every_module_that_is_run_exists(page):
    for module in {name for line in code(page) for name in re.findall(r"python -m ([\w.]+)", line)}:
        assert importlib.util.find_spec(module), module


PLACE = re.compile(r"(?:derive|templates|runtime|generated|tests|tools|docs|\.ci)/[\w./*-]*(?=  |$)")


@each_page
def test_every_path_exists(page):
    named = {match[0] for line in code(page) if (match := PLACE.match(line))}
    missing = [path for path in named if not any(ROOT.glob(path.rstrip("/")))]
    missing = [path for path in missing if not (ROOT / path).with_suffix(".py").is_file()]
    assert not missing


# ---- figures ----

NUMBER = re.compile(r"(?<![\w.])\d+(?: \d{3})*(?:\.\d+)?(?:e-?\d+)?")


def rows_of_figures() -> list[tuple[str, Path]]:
    """The figures of the README's table, row by row, with the page of evidence that each row names."""
    rows = re.findall(r"^\|[^|]*\| ([^|`]*)\|[^|]*\]\(([^)#]+)[^|]*\|$", text_of(ROOT / "README.md"), re.MULTILINE)
    return [(figures, ROOT / path) for figures, path in rows]


def test_the_figures_of_the_readme_are_those_of_the_evidence():
    rows = rows_of_figures()
    assert sum(len(NUMBER.findall(figures)) for figures, _ in rows) >= 9
    for figures, page in rows:
        assert set(NUMBER.findall(figures)) - set(NUMBER.findall(text_of(page))) == set(), page


README = ROOT / "README.md"


def test_the_readme_is_read_in_four_minutes():
    """Words beside code."""
    assert len(re.findall(r"\w[^\s|]*", FENCE.sub("", text_of(README)))) <= 800


def test_the_lines_that_the_readme_shows_of_an_equation_are_those_that_derive_wrote():
    names = ("EQUATIONS.md", "python/hopform_solver/formulas.py", "c/src/formulas_f64.h")
    (equation,) = re.findall(r"^```math\n(.+)\n```", text_of(README), re.MULTILINE)
    (lines,) = re.findall(r"^```\n(.+\n.+)\n```", text_of(README), re.MULTILINE)
    for line, name in zip((equation, *lines.splitlines()), names, strict=True):
        assert line in map(str.strip, text_of(ROOT / "generated" / name).splitlines()), name
    equations = text_of(ROOT / "generated" / "EQUATIONS.md")
    counts = re.search(r"the paper's 27\s+equations \[(\d+) are wrong and (\d+) incomplete\]", text_of(README))
    assert counts and counts.groups() == tuple(
        re.findall(rf"^\| {word} \|[^|]*\| (\d+) \|", equations, re.MULTILINE)[0] for word in ("wrong", "incomplete")
    )


def test_the_readme_names_no_time_that_a_neighbour_may_have_made():
    assert re.findall(r"\d ?(?:us|ns|ms|µs)\b", FENCE.sub("", text_of(README))) == []


def test_the_controllers_of_the_page_on_hopping_have_the_defaults_that_it_names():
    page = text_of(ROOT / "docs" / "how-to" / "hop-over-terrain.md")
    shown = re.findall(r"^\|[^|`]*`(\w+)\((\w+(?:, \w+=[^,`]+)+)\)`", page, re.MULTILINE)
    assert {name for name, _ in shown} == {"FeedForward", "AsPrinted", "ReturnMap"}
    for name, arguments in shown:
        known = inspect.signature(getattr(hopform.hopping.controllers, name)).parameters
        for default in re.findall(r"(\w+)=([^,]+)", arguments):
            assert known[default[0]].default == ast.literal_eval(default[1]), (name, default)


def test_what_make_shows_is_a_part_of_what_help_all_shows():
    few, all_of_them = (
        subprocess.run(["make", "-s", target], cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
        for target in ("help", "help-all")
    )
    assert len(few) == 11 and max(map(len, few)) <= 80  # ten, and where the others are
    assert {line.split()[1] for line in few} < {line.split()[1] for line in all_of_them}


def test_the_memory_of_the_interrupt_is_that_of_the_evidence():
    page = text_of(ROOT / "docs" / "how-to" / "call-from-firmware.md").partition("## A plant on a board")[0]
    build = json.loads(text_of(ROOT / "docs" / "evidence" / "firmware-costs.json"))["builds"]["m4f-gcc-O2"]
    sizes = {name.removeprefix("bytes of "): size for name, size in build.items() if name.startswith("bytes of ")}
    for name, size in re.findall(r"static hopform_(\w+)_f32 \w+(?:\[PHASES\])?; +/\* (\d+) B", page):
        assert sizes[name] == int(size), name
    buffers = re.findall(r"static hopform_(\w+)_f32 \w+(\[PHASES\])?;", page)
    assert buffers
    whole = sum(sizes[name] * (32 if many else 1) for name, many in buffers) + 1  # and `searching`
    assert f"The buffers above take {whole // 1000} {whole % 1000:03d} B." in page


def test_the_costs_of_the_page_on_firmware_are_those_of_the_evidence():
    page, costs = (
        text_of(ROOT / "docs" / name) for name in ("how-to/call-from-firmware.md", "evidence/firmware-costs.md")
    )
    rows = re.findall(r"^\|[^|]*((?:\| [\d ]+(?: B)? )+)\|$", page, re.MULTILINE)
    numbers = [number for row in rows for number in NUMBER.findall(row)]
    assert len(numbers) > 10
    assert [number for number in numbers if f"| {number} |" not in costs and f" {number} " not in costs] == []


def test_a_regime_costs_what_the_one_next_to_it_costs():
    """On every processor, as counted at the last release; `make firmware-test` asks the same of this checkout."""
    for build, figures in json.loads(text_of(costs.RECORD))["builds"].items():
        assert costs.apart(figures) == [], build


def test_a_regime_that_costs_more_than_the_one_next_to_it_is_named():
    figures = json.loads(text_of(costs.RECORD))["builds"]["m4f-gcc-O2"]
    dearer = figures | {"phase_of_stance a/w=6 mean": 2 * figures["phase_of_stance a/w=6 mean"]}
    assert {wrong.partition(":")[0] for wrong in costs.apart(dearer)} == {"a/w=3", "a/w=6"}


# ---- the certificate ----

ENGINE = ROOT / "runtime" / "engine" / "c"


def certificate() -> tuple[str, dict[str, str]]:
    """The page, and by the name of each of its rules the number: the headings."""
    page = (ROOT / "docs" / "explanation" / "certificate.md").read_text("utf-8")
    return page, {name: number for number, name in re.findall(r"^### Rule (\d): `(\w+)`$", page, re.MULTILINE)}


def test_the_page_of_the_certificate_has_its_rules_by_name_in_the_order_of_the_code():
    """Those of a node, and the closed form of one mass alone."""
    said = r"^/\* Rule (\d)\b(?:(?!\*/).)*?\*/\n(?:static inline|ALWAYS_real|SELDOM_real) \w+ (\w+)_real\("
    of_nodes, before = (
        re.findall(said, (ENGINE / name).read_text("utf-8"), re.MULTILINE | re.DOTALL)
        for name in ("node_search_real.h", "certificate_real.h")
    )
    rules = [*of_nodes, *(rule for rule in before if rule[0] == "3")]
    assert len(rules) == 6
    assert list(certificate()[1].items()) == [(name, number) for number, name in rules]


def test_the_page_of_the_certificate_asks_the_rules_in_the_order_of_the_search():
    page, rules = certificate()
    code = (ENGINE / "node_search_real.h").read_text("utf-8")
    outside, inside = (
        [name for name in re.findall(r"(\w+)_real\(", code[code.index(first) : code.index(end)]) if name in rules]
        for first, end in (
            (" certify_interval_real(", "/* ---- the root ---- */"),
            (" is_settled_inside_real(", " stays_above_real("),
        )
    )
    (row,) = re.findall(r"^\| certify \|.*$", page, re.MULTILINE)
    assert re.findall(r"`(\w+)`", row) == [*outside, *inside]
