"""The rooms of the tree, which stands on which, what a change touched, and the rooms that each test file tests.

The rooms of a test file are those that it or a helper of its imports, runs by a command, or reads by a path. They are
read from the source, so that no list is to be kept. Only the standard library is needed: .ci/run asks before it has
installed anything.
"""

import ast
import re
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

FOLDERS = {
    "derive/": "derive",
    "templates/": "derive",
    "runtime/engine/": "engine",
    "generated/": "generated",
    "runtime/hopform/hopping/": "hopping",
    "runtime/hopform/identify/": "identify",
    "runtime/hopform/": "core",
    "docs/": "pages",
}
"""The room of a folder; the first that fits. Pages at the root are pages, too."""

STANDS_ON = {
    "derive": (),
    "engine": (),
    "generated": ("derive", "engine"),
    "core": ("generated",),
    "hopping": ("core",),
    "identify": ("core",),
    "pages": (),
}
"""Each room after those below it. A test of pages tests the rooms that the pages use, so they need no arrow here."""

PACKAGES = {
    "derive": "derive",
    "hopform_solver": "generated",
    "hopform.hopping": "hopping",
    "hopform.identify": "identify",
    "hopform": "core",
    "docs": "pages",
}
"""The room of a module that is imported; the first that fits."""

PARTS = {
    "derive": "derive", "templates": "derive", "engine": "engine", "generated": "generated", "hopping": "hopping",
    "identify": "identify", "docs": "pages",
}  # fmt: skip
"""The room of a part of a path, where a test reads or compiles a file."""

OF_ALL_COMMANDS = {"COMMANDS", "EXAMPLES"}
"""Names of hopform by which a test reaches every command."""


class NoBase(Exception):
    """There is no commit to compare with."""


def changed(root: Path, base: str = "") -> tuple[str, list[str]]:
    """The commit that a checkout is compared with, and the names of the files that differ from it.

    It is the commit `base`, else the newest of HEAD's first parents that is 24 hours old.
    """
    try:
        if git(root, "rev-parse", "--is-shallow-repository") == "true":
            raise NoBase("the history is cut off")
        base = base or git(root, "rev-list", "-1", "--first-parent", "--before=24 hours ago", "HEAD")
        if not base:
            raise NoBase("no commit is 24 hours old")
        commit = git(root, "rev-parse", "--verify", "--quiet", f"{base}^{{commit}}")
        if commit == git(root, "rev-parse", "HEAD"):
            raise NoBase("the base is HEAD itself")
        names = git(root, "diff", "--name-only", "--no-renames", "-z", commit)
    except (OSError, subprocess.CalledProcessError):
        raise NoBase(f"the base {base or 'of 24 hours ago'} is unknown") from None
    return commit, [name for name in names.split("\0") if name]


def git(root: Path, *words: str) -> str:
    done = subprocess.run(["git", "-C", str(root), *words], check=True, capture_output=True, text=True)
    return done.stdout.strip()


def room_of(name: str) -> str | None:
    """The room of a file by its path; None for one of the tests, a tool, or another file that all rooms share."""
    if "/" not in name and name.endswith(".md"):
        return "pages"
    return next((room for folder, room in FOLDERS.items() if name.startswith(folder)), None)


def concerned(rooms: Iterable[str]) -> set[str]:
    """These rooms and all that stand on them."""
    affected = set(rooms)
    for room, below in STANDS_ON.items():  # those below come first
        if affected & {*below}:
            affected.add(room)
    return affected


@dataclass(frozen=True)
class Source:
    """What a module of the tests imports and mentions."""

    modules: frozenset[str]
    """Full names: `tests.needs`, `hopform.hopping.terrain`, `hopform.solve_stance`."""
    names: frozenset[str]
    """Of variables and attributes."""
    words: frozenset[str]
    """Of its strings, other than docstrings: separated by spaces and by what separates parts of a path."""


@cache
def source_of(path: Path) -> Source:
    modules, names, words = set[str](), set[str](), set[str]()
    prose = set[int]()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):  # what stands in a statement comes after it
        if isinstance(node, ast.Expr):
            prose.add(id(node.value))
        elif isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            modules |= {f"{node.module}.{alias.name}" for alias in node.names}
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.Name):
            names.add(node.id)
        elif isinstance(node, ast.Attribute):
            names.add(node.attr)
            if isinstance(node.value, ast.Name) and node.value.id == "hopform":
                modules.add(f"hopform.{node.attr}")
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
            words |= {*re.split(r"[\s/\\\"'`()=,]+", node.value)}
            modules |= {*re.findall(r"\bhopform\.\w+", node.value)}
    return Source(frozenset(modules), frozenset(names), frozenset(words))


class Suite:
    """The test files of a checkout with the rooms that they test."""

    def __init__(self, root: Path) -> None:
        self.root = root

    @cached_property
    def modules(self) -> dict[str, Path]:
        """Every module of the tests by its name; model files are data."""
        paths = [path for path in sorted((self.root / "tests").rglob("*.py")) if path.parent.name != "models"]
        parts = {path: path.relative_to(self.root).with_suffix("").parts for path in paths}
        return {".".join(part[:-1] if part[-1] == "__init__" else part): path for path, part in parts.items()}

    @cached_property
    def files(self) -> list[Path]:
        return [path for path in self.modules.values() if path.name.startswith("test_")]

    @cached_property
    def of_commands(self) -> dict[str, str]:
        """The room of each command of an application, as the front of the command line has them."""
        front = self.root / "runtime" / "hopform" / "_front.py"
        for node in ast.parse(front.read_text("utf-8")).body if front.is_file() else ():
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "COMMANDS":
                modules = {str(words): str(module) for words, module in ast.literal_eval(node.value).items()}
                rooms = {words: next(of_module(f"hopform.{module}")) for words, module in modules.items()}
                return {words: room for words, room in rooms.items() if room != "core"}
        return {}

    @cached_property
    def pages(self) -> dict[str, set[str]]:
        """The rooms that the pages of a name use, the pages themselves among them."""
        rooms = dict[str, set[str]]()
        for path in (*self.root.glob("*.md"), *(self.root / "docs").rglob("*.md")):
            text = path.read_text("utf-8")
            used = {next(of_module(name)) for name in re.findall(r"\bhopform(?:\.\w+)?", text)}
            used |= {room for command, room in self.of_commands.items() if f"hopform {command}" in text}
            rooms.setdefault(path.name, {"pages"}).update(used)
        return rooms

    @cache  # noqa: B019 (one object a run)
    def stands_on(self, path: Path) -> frozenset[Path]:
        """A module of the tests and the modules of the tests that it imports, directly or not."""
        reached, to_read = set[Path](), [path]
        while to_read:
            module = to_read.pop()
            if module not in reached:
                reached.add(module)
                names = {each for name in source_of(module).modules for each in (name, *parents(name))}
                to_read += [self.modules[name] for name in names if name in self.modules]
        return frozenset(reached)

    @cache  # noqa: B019
    def rooms_alone(self, path: Path) -> frozenset[str]:
        """The rooms that a module of the tests imports, runs or reads, without those of its helpers."""
        source = source_of(path)
        rooms = {room for name in source.modules for room in of_module(name)}
        rooms |= {PARTS[word] for word in source.words & PARTS.keys()}
        rooms |= {self.of_commands[word] for word in source.words & self.of_commands.keys()}
        if source.names & OF_ALL_COMMANDS:
            rooms |= {*self.of_commands.values()}
        named = self.pages if "*.md" in source.words else source.words & self.pages.keys()
        return frozenset(rooms.union(*(self.pages[name] for name in named)))

    def rooms(self, path: Path) -> frozenset[str]:
        """The rooms that a test file tests; none where it tests the tests."""
        return frozenset[str]().union(*map(self.rooms_alone, self.stands_on(path)))

    def touched_by(self, name: str, path: Path) -> bool:
        """Whether a test file is concerned by a change of a file of the tests."""
        modules, file = self.stands_on(path), Path(name)
        if self.root / name in modules | self.stands_on(self.modules["tests.conftest"]):
            return True
        if file.suffix == ".py" and file.parent.name != "models":
            return False
        return any(source_of(module).words & {file.name, file.stem, file.parent.name} for module in modules)


def of_module(name: str) -> Iterator[str]:
    """The room of a module or of what is imported from it, if it is of the product."""
    for package, room in PACKAGES.items():
        if f"{name}.".startswith(f"{package}."):
            yield room
            return


def parents(name: str) -> Iterator[str]:
    while "." in name:
        name = name.rpartition(".")[0]
        yield name
