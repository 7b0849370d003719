"""The compiled peers and hopform's C loop: built into out/benchmarks with one compiler, loaded by ctypes.

hopform is compiled with the flags it ships with, the peers with -O3 -march=native.
"""

import ctypes
import hashlib
import os
import shlex
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derive.emit.facts import FLAGS
from tests.bench.jobs import Jobs, answers

HERE = Path(__file__).parent / "peers"
ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "out" / "benchmarks"
C = ROOT / "generated" / "c"
PEER_FLAGS = ["-O3", "-march=native", "-fPIC", "-shared"]
REALS = {"f32": "float", "f64": "double"}


class NotBuilt(Exception):
    """Why a peer is left out, in one line."""


@dataclass(frozen=True)
class Library:
    """A shared library whose entry points take (jobs, count, tolerance, loops, answers)."""

    path: Path

    def function(self, name: str, jobs: Jobs, tolerance: float = 0.0) -> Callable[[int], NDArray[np.float64]]:
        """A call that solves all jobs so many times over and returns the answers."""
        call = getattr(_loaded(self.path), name)
        call.restype = None
        table, found = np.ascontiguousarray(jobs.table), answers(len(jobs))

        def run(loops: int) -> NDArray[np.float64]:
            call(_pointer(table), len(jobs), ctypes.c_double(tolerance), loops, _pointer(found))
            return found

        return run

    def prepare(self, jobs: Jobs) -> None:
        """Let hopform's driver make the plans of these jobs."""
        _loaded(self.path).prepare(_pointer(np.ascontiguousarray(jobs.table)), len(jobs))


@cache
def _loaded(path: Path) -> ctypes.CDLL:
    return ctypes.CDLL(str(path))


def _pointer(array: NDArray[np.float64]) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


def compilers() -> tuple[list[str], list[str]]:
    """The C and the C++ compiler, as commands."""
    return shlex.split(os.environ.get("CC") or "cc"), shlex.split(os.environ.get("CXX") or "c++")


def _build(command: list[str], sources: list[Path], name: str, libraries: list[str]) -> Path:
    """Compile unless the same command on the same text has been compiled before;
    NotBuilt with the compiler's first error.
    """
    if not shutil.which(command[0]):
        raise NotBuilt(f"{command[0]} is not installed")
    texts = [
        path for folder in (HERE, C / "src", C / "include") for path in sorted(folder.rglob("*")) if path.is_file()
    ]
    key = hashlib.sha256("".join([*command, *libraries, *(path.read_text("utf-8") for path in texts)]).encode())
    target = OUT / f"{name}-{key.hexdigest()[:12]}"
    if not target.exists():
        OUT.mkdir(parents=True, exist_ok=True)
        aside = target.with_suffix(f".{os.getpid()}.tmp")
        done = subprocess.run(
            [*command, *map(str, sources), "-o", str(aside), *libraries, "-lm"],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            first = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr.strip())
            raise NotBuilt(first.splitlines()[0] if first else f"{command[0]} failed")
        os.replace(aside, target)
    return target


def hopform_driver(precision: str, count_instructions: bool = False) -> Path:
    """hopform's C and the loop around it, as a library, or as a program for a tool that counts instructions."""
    flags = [flag for flag in FLAGS if not count_instructions or flag not in ("-shared", "-fPIC")]
    macros = [f"-DSUFFIX=_{precision}", f"-DREAL={REALS[precision]}"]
    command = [
        *compilers()[0],
        *flags,
        *macros,
        *["-DCOUNT_INSTRUCTIONS"] * count_instructions,
        "-I",
        str(C / "include"),
    ]
    single = (
        path for path in sorted((C / "src").glob("*.c")) if not path.name.startswith(("batch_", "flights_", "hops_"))
    )
    sources = [HERE / "hopform_real.c", *single]
    return _build(command, sources, f"hopform_{precision}{'_count' * count_instructions}", [])


def hopform(precision: str) -> Library:
    return Library(hopform_driver(precision))


def odeint() -> Library:
    command = [*compilers()[1], "-std=c++14", *PEER_FLAGS]
    return Library(_build(command, [HERE / "odeint.cpp"], "odeint", []))


def by_hand() -> Library:
    """The paper's closed form without hopform."""
    return Library(_build([*compilers()[1], "-std=c++14", *PEER_FLAGS], [HERE / "by_hand.cpp"], "by_hand", []))


def cvode() -> Library:
    libraries = ["-lsundials_cvode", "-lsundials_nvecserial"]
    return Library(_build([*compilers()[0], "-std=gnu99", *PEER_FLAGS], [HERE / "cvode.c"], "cvode", libraries))


def versions() -> str:
    """The compiler, with its version."""
    done = subprocess.run([*compilers()[0], "--version"], capture_output=True, text=True, check=False)
    return done.stdout.splitlines()[0] if done.stdout else compilers()[0][0]


def versions_of_peers() -> str:
    """Peers with their versions, those in C and C++ by a macro of a header; without those that are absent."""
    of_python = (f"{name} {_version(name)}" for name in ("scipy", "numba", "diffrax", "casadi") if _version(name))
    macros = (
        ("boost", "boost/version.hpp", "BOOST_LIB_VERSION"),
        ("sundials", "sundials/sundials_config.h", "SUNDIALS_VERSION"),
    )
    of_c = (f"{name} {found}" for name, header, macro in macros if (found := _macro(header, macro)))
    return ", ".join([*of_c, *of_python])


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""


def _macro(header: str, name: str) -> str:
    """The text that a macro of a header stands for; "" where there is no such header."""
    lines = f"#include <{header}>\n{name}\n"
    done = subprocess.run(
        [*compilers()[1], "-E", "-P", "-x", "c++", "-"], input=lines, capture_output=True, text=True, check=False
    )
    return done.stdout.splitlines()[-1].strip('"').replace("_", ".") if done.returncode == 0 else ""
