"""`python tools/wheels.py DIR [PLATFORM ...]` builds the sdist and a wheel for each platform, and runs what it can.

ziglang, pinned, cross compiles. auditwheel says whether a wheel for Linux keeps to its tag. The selftest, linked with
the very library of a wheel, must print the digests of this computer: under qemu-user for aarch64 and under wine for
Windows, where they are installed. What was not run is said.
"""

import importlib.resources
import json
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from os import environ
from pathlib import Path
from typing import NamedTuple

from hopform._export import selftest

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "tests" / "conformance" / "firmware"
QEMU = ("qemu-aarch64", "-L", "/usr/aarch64-linux-gnu")  # of Debian's qemu-user and libc6-arm64-cross
WINE = (shutil.which("wine64") or "/usr/lib/wine/wine64",)  # of Debian's wine64


class Target(NamedTuple):
    """A wheel's platform, what zig calls it, and what runs its programs here; None: they are not tried."""

    platform: str
    zig: str
    run: tuple[str, ...] | None


TARGETS = (
    Target("manylinux_2_17_x86_64", "x86_64-linux-gnu.2.17", ()),
    Target("manylinux_2_17_aarch64", "aarch64-linux-gnu.2.17", QEMU),
    Target("musllinux_1_2_x86_64", "x86_64-linux-musl", None),
    Target("musllinux_1_2_aarch64", "aarch64-linux-musl", None),
    Target("macosx_10_15_x86_64", "x86_64-macos.10.15", None),
    Target("macosx_11_0_arm64", "aarch64-macos.11.0", None),
    Target("win_amd64", "x86_64-windows-gnu", WINE),
    Target("win_arm64", "aarch64-windows-gnu", None),
)


def compiler(target: Target) -> list[str]:
    """zig for a target. On aarch64 a library for musl takes functions of libc but names no libc: Python has loaded the
    one that there is, whose name is not zig's. On x86-64 it takes none."""
    command = [sys.executable, "-m", "ziglang", "cc", "-target", target.zig, "-fno-sanitize=undefined", "-s"]
    if target.zig != "aarch64-linux-musl":
        return command
    headers = importlib.resources.files("ziglang") / "lib" / "libc" / "include"
    folders = (headers / target.zig, headers / "generic-musl")
    return [*command, "-nostdlib", "-Wl,-z,undefs", *(f"-isystem{folder}" for folder in folders)]


def unpacked(folder: Path, dist: Path) -> Path:
    """The sdist, built and unpacked: wheels are made of what it holds."""
    build("--sdist", dist, ROOT)
    (sdist,) = dist.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    return folder / sdist.name.removesuffix(".tar.gz")


def build(kind: str, dist: Path, source: Path, **environment: str) -> None:
    command = [sys.executable, "-m", "build", kind, "--no-isolation", "--outdir", str(dist), str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environ | environment)
    if done.returncode:
        sys.exit(f"hopform: {source.name} is not built: {(done.stdout + done.stderr)[-2000:]}")


def wheel(source: Path, folder: Path, dist: Path, target: Target) -> str:
    """Build and try the wheel of a target in a folder of its own; a line for the table."""
    copy = shutil.copytree(source, folder / target.platform)
    command = " ".join(compiler(target))
    build("--wheel", dist, copy, CC=command, HOPFORM_PLATFORM=target.platform, HOPFORM_COMPILE_LATER="")
    (found,) = dist.glob(f"*-{target.platform}.whl")
    audited = audit(found, target) if "linux" in target.platform else "-"
    return f"{target.platform:<24} {found.stat().st_size / 1e6:4.1f} MB  {audited:<22} {tried(found, copy, target)}"


def audit(found: Path, target: Target) -> str:
    """The oldest platform on which a wheel for Linux runs, by auditwheel; not a newer one than its tag says."""
    command = [sys.executable, "-m", "auditwheel", "show", "--json", str(found)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    oldest = str(json.loads(said)["overall_tag"])
    kind = target.platform.partition("_")[0]
    if not oldest.startswith(kind) or numbers(oldest) > numbers(target.platform):
        sys.exit(f"hopform: {found.name} runs from {oldest} on")
    return oldest


def numbers(platform: str) -> list[int]:
    return [int(number) for number in re.findall(r"_(\d+)(?=_)", platform)[:2]]


def tried(found: Path, folder: Path, target: Target) -> str:
    """The digests that the library of a wheel prints, which must be those of this computer; or why there are none."""
    if target.run is None:
        return "not run"
    if target.run and shutil.which(target.run[0]) is None:
        return f"not run: {target.run[0]} is absent"
    with zipfile.ZipFile(found) as archive:
        (name,) = (name for name in archive.namelist() if "_libhopform." in name and not name.endswith(".sha256"))
        library = Path(archive.extract(name, folder / "tried"))
    program = library.with_name("selftest.exe")
    files = [PROGRAM / "selftest.c", PROGRAM / "boards" / "board.c", library]
    include = [f"-I{path}" for path in (ROOT / "generated" / "c" / "include", PROGRAM / "boards")]
    linked = [*compiler(target), *include, "-Wl,-rpath,$ORIGIN", *map(str, files), "-o", str(program)]
    subprocess.run(linked, check=True, capture_output=True)
    done = subprocess.run([*target.run, str(program)], capture_output=True, text=True, check=False, cwd=program.parent)
    wanted = f"f32 {selftest('float32'):08x} f64 {selftest('float64'):08x}"
    if wanted not in done.stderr:
        sys.exit(f"hopform: {found.name} prints {done.stderr.strip()!r}, not {wanted!r}")
    return wanted


def main(dist: Path, *platforms: str) -> None:
    """Two at a time."""
    unknown = set(platforms) - {target.platform for target in TARGETS}
    if unknown:
        sys.exit(f"hopform: no platform {', '.join(unknown)}; there are {', '.join(each.platform for each in TARGETS)}")
    chosen = [target for target in TARGETS if not platforms or target.platform in platforms]
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        source = unpacked(Path(folder), dist)
        for line in pool.map(partial(wheel, source, Path(folder), dist), chosen):
            print(line, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
