"""What the fuzzer once found, tried again with any compiler: nothing undefined, no endless search, no answer out of bounds."""

import os
import shlex
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FUZZ, C = ROOT / "tests" / "fuzz", ROOT / "generated" / "c"
FOUND = sorted(path for path in (FUZZ / "found").iterdir())
SOURCES = ("stance", "energy", "control", "flight", "touchdown")
CHECKS = "-fsanitize=undefined,float-divide-by-zero,float-cast-overflow -fno-sanitize-recover=all"
FLAGS = f"-std=c99 -O1 -ffp-contract=off -D_GNU_SOURCE {CHECKS} -I{C / 'include'}".split()
ENTRIES = {"3": "entry", "4": "entry", "flight": "flight", "control": "control"}
COMPILER = shlex.split(os.environ.get("CC") or "cc")

pytestmark = pytest.mark.skipif(not shutil.which(COMPILER[0]), reason="no C compiler")


def compiled(*arguments: str) -> None:
    done = subprocess.run([*COMPILER, *FLAGS, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def objects(tmp_path_factory) -> list[str]:
    """The library and the loop over the files, compiled with every check."""
    folder = tmp_path_factory.mktemp("objects")
    sources = [C / "src" / f"{name}_{precision}.c" for name in SOURCES for precision in ("f32", "f64")]
    sources.append(FUZZ / "each.c")
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda path: compiled("-c", str(path), "-o", str(folder / f"{path.stem}.o")), sources))
    return [str(folder / f"{path.stem}.o") for path in sources]


@pytest.mark.parametrize("precision", ["SINGLE", "DOUBLE"])
@pytest.mark.parametrize("entry", ENTRIES)
def test_what_was_found_once_is_found_no_more(objects, tmp_path, entry, precision):
    program = str(tmp_path / "each")
    target = str(FUZZ / f"fuzz_{ENTRIES[entry]}.c")
    compiled(f"-D{precision}", f"-DENTRY={entry}", target, *objects, "-o", program, "-lm")
    assert len(FOUND) >= 10
    done = subprocess.run([program, *map(str, FOUND)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
