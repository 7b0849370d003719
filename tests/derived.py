"""Models of a user as packages and libraries: each is derived and compiled once per run of the tests."""

import shutil
import sys
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any
from unittest.mock import patch

import hopform
from derive.__main__ import main
from derive.model import mechanism
from derive.model.declare import drafted
from derive.model.equations import Model
from hopform import _front as cli
from hopform._solver import build
from hopform._solver import c as native
from hopform._solver.build import compile_solver
from hopform._solver.package import Package
from tests.objects import key, once

MODELS = Path(__file__).resolve().parent / "models"
SHIPPED = Path(__file__).resolve().parents[1] / "derive" / "models"


def model_of(text: str, name: str = "own") -> Model:
    """The model of a text of elements."""
    with drafted() as draft:
        exec(compile(f"from hopform.model import *\n{text}", name, "exec"), {})  # noqa: S102
    return mechanism.model_of(draft, name, "A model of a test.", text)


NO_HOPPERS = {
    "current": "force(h.x2, h.gamma2 * h.u, 'reaction')",
    "ground": "spring(h.x1, parameter('k1', 'N/m', 'stiffness', 'nonnegative', 0), 'ground spring')",
    "hardening": "k3 = parameter('k3', 'N/m^3', 'how the spring hardens', 'nonnegative', 0)\n"
    "spring(h.x1 - h.x2 + h.L0, k3 * (h.x1 - h.x2) ** 2, 'hardening spring')",
    "rail": "viscous(h.x2, parameter('b_rail', 'N s/m', 'friction of the rail', 'nonnegative', 0), 'rail')",
    "undeclared": "import sympy as sp\nviscous(h.x1, sp.Symbol('k_emf', real=True), 'back-EMF')",
}
"""Elements that no hop can carry, further ones of the hopper `h`."""


def no_hopper(folder: Path, name: str) -> Path:
    """A file of the hopper with one of them."""
    file = folder / f"{name}.py"
    file.write_text(f"from hopform.model import *\nh = include('hopper')\n{NO_HOPPERS[name]}\n", "utf-8")
    return file


def hopper_with(text: str, name: str = "own") -> Model:
    """The hopper with further elements: its symbols are those of `h`."""
    return model_of(f"h = include('hopper')\n{text}", name)


def loaded(folder: Path, name: str) -> Any:
    """The package of a folder that the generator has written, under a name of its own."""
    place = folder / "python" / "hopform_solver"
    spec = spec_from_file_location(name, place / "__init__.py", submodule_search_locations=[str(place)])
    assert spec is not None and spec.loader is not None
    sys.modules[name] = package = module_from_spec(spec)
    spec.loader.exec_module(package)
    return package


@dataclass(frozen=True)
class Derived:
    """A folder that `python -m derive --model` has written; its package and its library once they are asked for."""

    folder: Path
    name: str

    @cached_property
    def package(self) -> Any:
        return loaded(self.folder, f"{self.name}_solver")

    def part(self, name: str) -> Any:
        """A module of the package."""
        return import_module(f"{self.package.__name__}.{name}")

    @cached_property
    def library(self) -> native.Library:
        assert self.package
        path = once(
            self.folder.with_name(f"lib{self.folder.name}.so"),
            lambda aside: compile_solver(self.folder, aside, "-O0"),
        )
        return native.Library(path, "hopform", Package(f"{self.name}_solver"))


def model_file(name: str) -> Path:
    """The file of a model of tests/models, or of one that ships."""
    own = MODELS / f"{name}.py"
    return own if own.is_file() else SHIPPED / f"{name}.py"


def derived(store: Path, model: str, name: str, *options: str) -> Derived:
    """A model, its package named so, in a folder that all processes of the run share."""
    file = model_file(model)

    def make(aside: Path) -> None:
        assert main(["--model", str(file), "--out", str(aside), *options]) == 0

    return Derived(once(store / f"{model}_{key(file.read_text('utf-8'), *options)}", make), name)


def built(store: Path, model: str | Path) -> Path:
    """The folder of a solver of a model, by its name or its file, with its library, for all processes of the run."""
    file = model if isinstance(model, Path) else model_file(model)

    def make(aside: Path) -> None:
        """As the command builds it, but for -O2, which takes long."""
        with patch.object(
            build, "compile_solver", lambda folder, output, progress: compile_solver(folder, output, "-O0")
        ):
            assert cli.main(["model", "build", str(file), "--out", str(aside)]) == 0

    return once(store / f"solver_of_{file.stem}_{key(file.read_text('utf-8'))}", make)


def edited(folder: Path, to: Path, name: str, old: str, new: str) -> Path:
    """A copy of a solver's folder with one text in one file changed, which its MANIFEST knows as its own."""
    shutil.copytree(folder, to)
    text = (to / name).read_text("utf-8")
    assert text.count(old) == 1
    (to / name).write_text(text.replace(old, new), "utf-8")
    was, now = (sha256(each.encode()).hexdigest() for each in (text, text.replace(old, new)))
    manifest = (to / "MANIFEST").read_text("utf-8")
    (to / "MANIFEST").write_text(manifest.replace(f"{was}  {name}\n", f"{now}  {name}\n"), "utf-8")
    return to


def solver_of(store: Path, model: str | Path) -> hopform.Solver:
    """The solver of a model of tests/models, or of one that ships, by its name or its file."""
    return hopform.load_solver(built(store, model))
