"""The site that `make docs` has built: every link leads somewhere, nothing is fetched, search finds."""

import ast
import os
import re
import shutil
import time
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest

import hopform
import hopform.hopping
from hopform import _front as cli

ROOT = next(folder for folder in Path(__file__).resolve().parents if (folder / "pyproject.toml").is_file())
SITE = ROOT / "out" / "site"
PLAY = SITE / "play" / "index.html"
pytestmark = [
    pytest.mark.site,
    pytest.mark.skipif(not (SITE / "index.html").is_file(), reason="the site is not there (`make docs` builds it)"),
]


class Page(HTMLParser):
    """Links, what is loaded, and anchors of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links, self.loaded, self.anchors = list[str](), list[str](), set[str]()
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.anchors |= {found[key] for key in ("id", "name") if found.get(key)}
        if tag == "a" and found.get("href"):
            self.links.append(found["href"])
        elif tag in {"script", "img", "link", "iframe", "source"}:
            self.loaded += [found[key] for key in ("src", "href") if found.get(key)]


@pytest.fixture(scope="module")
def pages():
    return {path: Page(path) for path in sorted(SITE.rglob("*.html"))}


def outside(link):
    return link.startswith(("http:", "https:", "mailto:", "data:"))


def test_every_link_of_the_site_leads_somewhere(pages):
    dead, followed = [], 0
    for path, page in pages.items():
        for link in page.links + page.loaded:
            if outside(link):
                continue
            name, _, anchor = unquote(link).partition("#")
            target = (path.parent / name.partition("?")[0]).resolve() if name else path
            followed += 1
            state = "=" in anchor and target == PLAY  # what that page is to simulate
            known = state or not anchor or target not in pages or anchor in pages[target].anchors
            if not (target.exists() and known):
                dead.append((path.relative_to(SITE).as_posix(), link))
    assert followed > 2000
    assert dead == []


def test_nothing_is_fetched_from_elsewhere(pages):
    fetched = {(path.name, link) for path, page in pages.items() for link in page.loaded if outside(link)}
    assert {(name, link) for name, link in fetched if not link.startswith("data:")} == set()
    styles = [
        path for path in SITE.rglob("*.css") if "http" in path.read_text("utf-8").replace("http://www.w3.org", "")
    ]
    assert [path for path in styles if "url(http" in path.read_text("utf-8")] == []


LEFT_OUT = {path.name for path in (ROOT / "docs" / "developers").glob("*.md")}
"""Pages for those who change hopform, which the site has as downloads."""


def test_every_page_of_the_tree_for_users_is_on_the_site_and_in_its_navigation(pages):
    home = {link.partition("#")[0] for link in pages[SITE / "README.html"].links}
    for path in [*(ROOT / "docs").rglob("*.md"), ROOT / "CONTRIBUTING.md", ROOT / "generated" / "EQUATIONS.md"]:
        there = path.relative_to(ROOT).with_suffix(".html").as_posix() in home
        assert there == (path.name not in LEFT_OUT), path


def test_a_page_for_developers_is_a_download(pages):
    linked = {Path(link.partition("#")[0]).name for page in pages.values() for link in page.links}
    assert {*LEFT_OUT, "JSON.md"} <= linked
    built = {path.name for path in SITE.rglob("*.html")}
    assert {Path(name).with_suffix(".html").name for name in (*LEFT_OUT, "JSON.md")} & built == set()


def test_the_api_has_every_public_name_of_python_and_c(pages):
    python = {anchor for path in (SITE / "docs" / "site" / "python").glob("*.html") for anchor in pages[path].anchors}
    named = set(hopform.__all__) - {"__version__", "ROBOTS"}
    named |= {f"{room}.{name}" for room, names in hopform.MOVED.items() for name in names}
    assert {f"hopform.{name}" for name in named} - {"hopform.hopping.controllers", "hopform.hopping.terrain"} <= python
    controllers = ast.parse((ROOT / "runtime" / "hopform" / "hopping" / "controllers.py").read_text("utf-8"))
    classes = {node.name for node in controllers.body if isinstance(node, ast.ClassDef)}
    assert {f"hopform.hopping.controllers.{name}" for name in classes if not name.startswith("_")} <= python
    c = (SITE / "docs" / "site" / "c.html").read_text("utf-8")
    header = (ROOT / "generated" / "c" / "include" / "hopform" / "hopform_f64.h").read_text("utf-8")
    functions = {line.split("(")[0].split()[-1] for line in header.splitlines() if "hopform_" in line.split("(")[0]
                 and line.startswith(("int32_t ", "uint32_t ", "void "))}  # fmt: skip
    structs = set(re.findall(r"^\} (hopform_\w+);$", header, re.MULTILINE))
    assert len(functions) > 20 and len(structs) > 20
    assert [name for name in functions | structs if f">{name}<" not in c] == []
    assert [name for name in functions | structs if f">{name.replace('_f64', '_f32')}<" not in c] == []


def test_every_page_has_a_link_to_the_page_to_play_with(pages):
    links = {path: {(path.parent / unquote(link)).resolve() for link in page.links} for path, page in pages.items()}
    assert [path for path, found in links.items() if path.name != "index.html" and PLAY not in found] == []
    assert links[PLAY] >= {SITE / "README.html"}  # and that page leads back


def test_the_help_of_every_command_is_there():
    text = (SITE / "docs" / "site" / "help.html").read_text("utf-8")
    assert [command for command in cli.COMMANDS if f"Usage: hopform {command}" not in text] == []


@pytest.mark.skipif(shutil.which("chromedriver") is None, reason="search is not tried: chromedriver is absent")
@pytest.mark.parametrize(
    ("words", "page"), [("saltation", "sensitivities.html"), ("hopform_solve_stance_f32", "c.html")]
)
def test_search_finds_pages_without_a_server(words, page):
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    for argument in ("headless=new", "no-sandbox", "disable-dev-shm-usage"):
        options.add_argument(f"--{argument}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
    try:
        driver.get((SITE / "search.html").as_uri() + f"?q={words}")
        end = time.monotonic() + 10.0
        links: list[str] = []
        while time.monotonic() < end and not any(link.startswith(page) for link in links):
            links = [os.path.basename(each.get_attribute("href") or "")
                     for each in driver.find_elements("css selector", "ul.search li a")]  # fmt: skip
        assert any(link.startswith(page) for link in links), links
        assert driver.get_log("browser") == []
    finally:
        driver.quit()
