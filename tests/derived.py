"""Models of a user as packages and libraries: each is derived and compiled once per run of the tests."""

import importlib
import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import hopform
from derive.__main__ import main
from hopform._solver import c as native
from hopform._solver.folder import folder_at
from hopform._solver.package import Package
from tests.objects import key, once
from tools.build_library import compile_sources

MODELS = Path(__file__).resolve().parent / "models"


@dataclass(frozen=True)
class Derived:
    """A folder that `python -m derive --model` has written; its package and its library once they are asked for."""

    folder: Path
    prefix: str

    @cached_property
    def package(self) -> Any:
        sys.path.insert(0, str(self.folder / "python"))
        try:
            return importlib.import_module(f"{self.prefix}_solver")
        finally:
            sys.path.remove(str(self.folder / "python"))

    def part(self, name: str) -> Any:
        """A module of the package."""
        return importlib.import_module(f"{self.package.__name__}.{name}")

    @cached_property
    def library(self) -> native.Library:
        assert self.package
        path = once(
            self.folder.with_name(f"lib{self.folder.name}.so"),
            lambda aside: compile_sources(self.folder / "c", aside, "-O0"),
        )
        return native.Library(path, self.prefix, Package(f"{self.prefix}_solver"))


def derived(store: Path, name: str, prefix: str, *options: str) -> Derived:
    """A model of tests/models under a prefix, in a folder that all processes of the run share."""
    model = MODELS / f"{name}.py"

    def make(aside: Path) -> None:
        assert main(["--model", str(model), "--out", str(aside), "--prefix", prefix, *options]) == 0

    return Derived(once(store / f"{prefix}_{key(model.read_text('utf-8'), *options)}", make), prefix)


def built(store: Path, name: str) -> Path:
    """The folder of a solver of a model of tests/models, with its library, for all processes of the run."""

    def make(aside: Path) -> None:
        assert main(["--model", str(MODELS / f"{name}.py"), "--out", str(aside)]) == 0
        compile_sources(aside / "c", aside / folder_at(aside).library.name, "-O0")

    return once(store / f"solver_of_{name}_{key((MODELS / f'{name}.py').read_text('utf-8'))}", make)


def solver_of(store: Path, name: str) -> hopform.Solver:
    """The solver of a model of tests/models."""
    return hopform.load_solver(built(store, name))
