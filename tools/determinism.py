"""Derive again under other circumstances and compare the bytes: `python tools/determinism.py`.

Every Python from 3.11 up on PATH or in ~/.pyenv/versions, with an older sympy and the newest, and two hash seeds;
`--this-python` keeps to the interpreter that runs this. The reference is what this interpreter derives as it is.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SYMPY = ["sympy==1.13.3", "sympy"]
HASH_SEEDS = ["0", "20261"]

Tree = dict[str, bytes]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--this-python", action="store_true", help="only the interpreter that runs this")
    pythons = [sys.executable] if parser.parse_args().this_python else list(every_python())
    with tempfile.TemporaryDirectory(prefix="hopform-determinism-") as folder:
        reference = derive(sys.executable, Path(folder, "reference"), seed="random")
        failures = sum(differs(name, tree, reference) for name, tree in trees(pythons, Path(folder)))
    return 1 if failures else 0


def trees(pythons: list[str], folder: Path) -> Iterator[tuple[str, Tree]]:
    """What each combination derives, with its name."""
    for number, python in enumerate(pythons):
        for sympy in SYMPY:
            venv = folder / f"venv-{number}-{sympy}"
            interpreter = environment(python, venv, sympy)
            versions = "import platform, sympy; print('Python', platform.python_version(), 'sympy', sympy.__version__)"
            name = subprocess.check_output([interpreter, "-c", versions], text=True).strip()
            for seed in HASH_SEEDS:
                yield f"{name} hash seed {seed}", derive(interpreter, folder / f"{number}-{sympy}-{seed}", seed)
            shutil.rmtree(venv)


def differs(name: str, tree: Tree, reference: Tree) -> bool:
    different = sorted(path for path in tree.keys() | reference.keys() if tree.get(path) != reference.get(path))
    verdict = f"differs in {', '.join(different)}" if different else f"{len(tree)} files, the same bytes"
    print(f"{name}: {verdict}", flush=True)
    return bool(different)


def derive(python: str, out: Path, seed: str) -> Tree:
    """The files that `python -m derive --out` writes; none at all is an error."""
    subprocess.run(
        [python, "-m", "derive", "--out", out],
        cwd=ROOT,
        env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONDONTWRITEBYTECODE": "1"},
        stdout=subprocess.DEVNULL,
        check=True,
    )
    tree = {path.relative_to(out).as_posix(): path.read_bytes() for path in out.rglob("*") if path.is_file()}
    if not tree:
        sys.exit(f"{python} -m derive --out {out} wrote nothing")
    return tree


def environment(python: str, venv: Path, sympy: str) -> str:
    """The interpreter of a new venv with what derive/ needs, sympy as asked for."""
    extra = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]["derive"]
    others = [requirement for requirement in extra if not requirement.startswith("sympy")]
    subprocess.run([python, "-m", "venv", venv], check=True)
    interpreter = str(venv / "bin" / "python")
    pip = [interpreter, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, sympy, *others], check=True)
    return interpreter


def every_python() -> Iterator[str]:
    """One interpreter per minor version from 3.11 up that runs and can make a venv."""
    question = "import ensurepip, sys, venv; print(sys.version_info[:2] >= (3, 11) and sys.version_info[1])"
    folders = [Path(folder) for folder in os.environ["PATH"].split(os.pathsep)]
    folders += sorted(Path.home().glob(".pyenv/versions/*/bin"))
    seen = {"False"}
    for python in (path for folder in folders for path in sorted(folder.glob("python3*"))):
        if re.fullmatch(r"python3(\.\d+)?", python.name):
            answer = subprocess.run([python, "-c", question], capture_output=True, text=True, check=False)
            if answer.returncode == 0 and answer.stdout.strip() not in seen:
                seen.add(answer.stdout.strip())
                yield str(python)


if __name__ == "__main__":
    sys.exit(main())
