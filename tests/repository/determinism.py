"""Derive again under other circumstances, compare the bytes with generated/: `python -m tests.repository.determinism`.

Every Python from 3.11 up in ~/.pyenv/versions or on PATH, with an older sympy and the newest, and two hash seeds;
`--this-python` keeps to the interpreter that runs this. `python -m derive --check` compares, and says what differs.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SYMPY = ["sympy==1.13.3", "sympy"]
HASH_SEEDS = ["0", "20261"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--this-python", action="store_true", help="only the interpreter that runs this")
    pythons = [sys.executable] if parser.parse_args().this_python else every_python()
    with tempfile.TemporaryDirectory(prefix="hopform-determinism-") as venv:
        same = [derives_the_same(environment(python, venv, sympy)) for python in pythons for sympy in SYMPY]
    return 0 if all(same) else 1


def derives_the_same(interpreter: str) -> bool:
    """Whether an interpreter derives generated/ with each hash seed; a line for each."""
    versions = "import platform, sympy; print('Python', platform.python_version(), 'sympy', sympy.__version__)"
    name = subprocess.check_output([interpreter, "-c", versions], text=True).strip()
    codes = list[int]()
    for seed in HASH_SEEDS:
        surroundings = os.environ | {"PYTHONHASHSEED": seed, "PYTHONDONTWRITEBYTECODE": "1"}
        checked = subprocess.run([interpreter, "-m", "derive", "--check"], cwd=ROOT, env=surroundings, check=False)
        print(f"{name} hash seed {seed}: {'differs' if checked.returncode else 'the same bytes'}", flush=True)
        codes.append(checked.returncode)
    return not any(codes)


def environment(python: str, venv: str, sympy: str) -> str:
    """The interpreter of a new venv with what derive/ needs, sympy as asked for."""
    extra = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]["derive"]
    others = [requirement for requirement in extra if not requirement.startswith("sympy")]
    subprocess.run([python, "-m", "venv", "--clear", venv], check=True)
    interpreter = str(Path(venv, "bin", "python"))
    pip = [interpreter, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, sympy, *others], check=True)
    return interpreter


def every_python() -> Iterator[str]:
    """One interpreter per minor version from 3.11 up that runs and can make a venv."""
    folders = os.pathsep.join([*map(str, Path.home().glob(".pyenv/versions/*/bin")), os.environ["PATH"]])
    for python in filter(None, (shutil.which(f"python3.{minor}", path=folders) for minor in range(11, 30))):
        tried = subprocess.run([python, "-c", "import ensurepip, venv"], capture_output=True, check=False)
        if tried.returncode == 0:
            yield python


if __name__ == "__main__":
    sys.exit(main())
