"""The site, `make docs`: the pages of docs/ as they stand, and what is taken from code: API, commands, figures.

The source of the site is the checkout itself, so that a link between two files is the same on the site and in the tree.
"""

import re
import runpy
import subprocess
import sys
import tempfile
from operator import attrgetter
from pathlib import Path
from typing import Any

import jupytext
from docutils import nodes
from latex2mathml.converter import convert
from nbconvert.exporters import MarkdownExporter
from nbconvert.preprocessors import ExecutePreprocessor
from sphinx.pycode import ModuleAnalyzer
from traitlets.config import Config

import hopform
import hopform.extend
import hopform.hopping
import hopform.identify
import hopform.jax
import hopform.reference
from hopform._front import COMMANDS

ROOT = Path(__file__).resolve().parents[2]

HEADER = (ROOT / "generated" / "c" / "include" / "hopform" / "hopform_f64.h").read_text("utf-8")

project, author, release = "hopform", "hopform contributors", hopform.__version__
copyright = "hopform contributors, MIT"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.viewcode", "breathe"]
autosummary_generate = False
root_doc = "README"
include_patterns = [
    "README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", "docs/**", "generated/*.md", "generated/c/README.md",
]  # fmt: skip
LEFT_OUT = {
    (ROOT / "docs" / page).resolve()
    for page in re.findall(
        r"\]\(([^)]+\.md)\)",
        (ROOT / "docs" / "README.md")
        .read_text("utf-8")
        .partition("\n## In the checkout only\n")[2]
        .partition("\n## ")[0],
    )
}
"""The pages that docs/README.md lists under "In the checkout only"; a link to one is a download."""
exclude_patterns = [
    ".*", "build", "dist", "runtime", "tests", "derive", "templates", "tools", "generated/packages",
    *sorted(page.relative_to(ROOT).as_posix() for page in LEFT_OUT),
]  # fmt: skip
suppress_warnings = ["myst.header"]  # a heading may skip a level
highlight_language = "text"
smartquotes = False  # a prime is a derivative

myst_enable_extensions = ["dollarmath", "html_image"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
breathe_projects = {"c": str(ROOT / "out" / "doxygen" / "xml")}
breathe_default_project = "c"
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"

html_theme = "furo"
html_theme_options = {"announcement": "the link of templates/page.html"}
templates_path = ["templates"]
html_title = f"hopform {release}"
html_extra_path = ["index.html"]
html_static_path = html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_copy_source = html_show_sphinx = html_show_search_summary = False

NAVIGATION = {
    "See it": ["docs/site/play", "docs/site/gallery"],
    "Tutorials": ["docs/tutorials/*"],
    "How-to": ["docs/how-to/*"],
    "Reference": [
        *(f"docs/site/python/{page}" for page in ("solve", "many", "control", "identify", "jax", "formulas", "reference", "model")), "docs/site/c", "generated/c/README", "docs/site/help",
        "docs/reference/*", "generated/EQUATIONS",
    ],
    "Explanation": [
        *(f"docs/explanation/{page}" for page in ("stance", "derivation", "poles", "events", "certificate")),
        *(f"docs/explanation/{page}" for page in ("stick-slip", "controller", "energy", "sensitivities", "*")),
    ],
    "Evidence": ["docs/evidence/*"],
    "Develop": ["CONTRIBUTING", "CHANGELOG", "SECURITY", "docs/README"],
}  # fmt: skip
"""The pages by section; the list at the left of every page."""


def navigation() -> str:
    listed = set[str]()
    parts: list[str] = []
    for caption, pages in NAVIGATION.items():
        found = [name for name in dict.fromkeys(n for page in pages for n in names(page)) if name not in listed]
        listed.update(found)
        parts += [f"```{{toctree}}\n:hidden:\n:caption: {caption}\n\n" + "\n".join(found) + "\n```"]
    return "\n\n".join(parts)


def names(page: str) -> list[str]:
    if "*" not in page:
        return [page]
    found = (path for path in sorted(ROOT.glob(f"{page}.md")) if path not in LEFT_OUT)
    return [path.relative_to(ROOT).with_suffix("").as_posix() for path in found]


def commands() -> str:
    """What `hopform COMMAND --help` prints."""
    parts: list[str] = []
    for command in COMMANDS:
        done = subprocess.run(
            [sys.executable, "-m", "hopform", *command.split(), "--help"], capture_output=True, text=True, check=True
        )
        parts.append(f"## {command}\n\n```\n{done.stdout.strip()}\n```\n")
    return "\n".join(parts)


def gallery() -> str:
    """The figures with their captions, as docs/gallery has drawn them."""
    text = (ROOT / "out" / "figures" / "captions.md").read_text("utf-8")
    return text.partition("\n## ")[2].join(["## ", ""]).replace("](fig_", "](../../out/figures/fig_")


def notebook(text: str) -> str:
    """A page that is a notebook, executed: its cells with what they print and draw."""
    folder = ROOT / "out" / "notebook"
    folder.mkdir(parents=True, exist_ok=True)
    book = jupytext.reads(text, fmt="md:myst")
    with tempfile.TemporaryDirectory() as empty:
        sockets = Config({"KernelManager": {"transport": "ipc", "ip": f"{empty}/kernel"}})  # in place of ports
        ExecutePreprocessor(timeout=300, config=sockets).preprocess(book, {"metadata": {"path": empty}})
    body, resources = MarkdownExporter().from_notebook_node(book)
    for picture, content in resources["outputs"].items():
        (folder / picture).write_bytes(content)
    return str(body).replace("](output_", "](../../out/notebook/output_")


def with_figures(name: str, text: str) -> str:
    """A page with the figures that it marks, which docs/explanation/figures.py has drawn."""
    up = "../" * name.count("/")
    return re.sub(r"<!-- figure (\w+) -->\n", rf"![Figure: \1]({up}out/explanation/\1.svg)\n\n", text)


def api(names: list[str]) -> str:
    """A table of public names of hopform and its rooms, `extend.*` for the classes and functions of one, and what each
    is.
    """
    names = [each for name in names for each in (of_room(name[:-2]) if name.endswith(".*") else [name])]
    table = "\n   ".join([".. autosummary::", ":nosignatures:", "", *names])
    kinds = {name: "class" if isinstance(attrgetter(name)(hopform), type) else "function" for name in names}
    each = (
        f".. auto{kind}:: hopform::{name}" + ("\n   :members:" if kind == "class" else "")
        for name, kind in kinds.items()
    )
    return "\n\n".join([".. currentmodule:: hopform", table, *each])


def of_room(room: str) -> list[str]:
    public = attrgetter(room)(hopform).__all__
    return [name for each in public if callable(attrgetter(name := f"{room}.{each}")(hopform))]


def on_source(_: Any, module: str) -> tuple[str, Any]:
    """A module's code and where its names stand in it, also as names of a room. sphinx.ext.viewcode links a module back
    to one place of its names: that is hopform, of which a name of a room is an attribute.
    """
    analyzer = ModuleAnalyzer.for_module(module)
    analyzer.find_tags()
    rooms = ("", "extend.", "hopping.", "identify.", "reference.")
    return analyzer.code, {room + name: place for room in rooms for name, place in analyzer.tags.items()}


def in_c(names: list[str]) -> str:
    """Functions and structs of the C library in double precision, each with its name in single precision."""
    parts: list[str] = []
    for name in names:
        kind = "function" if f" {name}_f64(" in HEADER else "struct"
        members = "\n   :members:" if kind == "struct" else ""
        parts.append(f".. doxygen{kind}:: {name}_f64{members}\n\nIn single precision: ``{name}_f32``.")
    return "\n\n".join(parts)


def with_downloads(name: str, text: str) -> str:
    """A page whose links to pages that the site leaves out are downloads."""

    def link(found: re.Match[str]) -> str:
        if ((ROOT / name).parent / found[2]).resolve() not in LEFT_OUT:
            return found[0]
        return f"{{download}}`{' '.join(found[1].split())} <{found[2]}>`"

    return re.sub(r"\[([^\[\]]+)\]\(([\w./-]+\.md)(?:#[\w-]+)?\)", link, text)


def on_read(app: Any, name: str, source: list[str]) -> None:
    """Pages as MyST reads them: headings' own anchors become targets; what is generated goes where it is asked for."""
    if "```{code-cell}" in source[0]:
        source[0] = notebook(source[0])
    text = re.sub(r'^(#+) <a id="([^"]+)"></a>(.*)$', r"(\2)=\n\1 \3", source[0], flags=re.MULTILINE)
    for mark, made in (("{{commands}}", commands), ("{{gallery}}", gallery)):
        if mark in text and name.startswith("docs/site/"):
            text = text.replace(mark, made())
    text = re.sub(r"\{\{api:([^}]+)\}\}", lambda found: api(found[1].split()), text)
    text = re.sub(r"\{\{c:([^}]+)\}\}", lambda found: in_c(found[1].split()), text)
    text = with_downloads(name, with_figures(name, text))
    source[0] = text + ("\n" + navigation() if name == root_doc else "")


def on_docstring(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Docstrings are plain sentences: names in backquotes, equations indented, examples that run."""
    paragraphs = "\n".join(lines).split("\n\n")
    lines[:] = "\n\n".join(map(paragraph, paragraphs)).split("\n")


def paragraph(text: str) -> str:
    if text.lstrip().startswith(">>>"):
        return text
    if text.startswith("    "):
        return f"::\n\n{text}"
    text = re.sub(r"(?<!`)`([^`]+)`(?!`)", r"``\1``", text)
    pieces = re.split(r"(``[^`]+``)", text)
    return "".join(piece if piece.startswith("``") else re.sub(r"([*|\\]|_\b)", r"\\\1", piece) for piece in pieces)


def in_line(self: Any, node: nodes.math) -> None:
    self.body.append(convert(node.astext()))
    raise nodes.SkipNode


def in_block(self: Any, node: nodes.math_block) -> None:
    drawn = convert(node.astext(), display="block")
    self.body.append(f'<div style="overflow: auto hidden; padding: 0.4em 0">{drawn}</div>')
    raise nodes.SkipNode


def setup(app: Any) -> None:
    runpy.run_path(str(ROOT / "docs" / "explanation" / "figures.py"))["draw"](ROOT / "out" / "explanation")
    app.add_html_math_renderer("mathml", (in_line, None), (in_block, None))
    app.connect("source-read", on_read)
    app.connect("autodoc-process-docstring", on_docstring)
    app.connect("viewcode-find-source", on_source)
