"""`python -m tests.conformance.firmware` proves the library on emulated targets: CI's combinations; `--all` every one;
`--report` counts.

Each combination of target, compiler and optimisation runs the selftest, whose digest must be the same everywhere (but
not with the functions of a C library, `-libm`), random stances, flights and commands (digests.c), whose digest must be
that of this computer, the golden vectors of the 50-digit reference, garbage, all that is to be refused, and pointers
that are NULL or overlap; its objects' symbols are looked through.
"""

import argparse
import platform
import re
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from tests.conformance.firmware import costs, strict
from tests.conformance.firmware.targets import (
    BY_NAME,
    DIGEST,
    TARGETS,
    Build,
    Failed,
    emulate,
    link,
    native_digests,
    needed,
    objects,
    run,
)

LEVELS = ("-O0", "-O1", "-O2", "-O3", "-Os", "-Oz")
QUICK = (
    "m4f-gcc-O2", "m4f-gcc-O0", "m4f-clang-Oz", "m7-gcc-O3", "m7-clang-O2", "m33-gcc-Os", "m33-clang-O1",
    "m3-gcc-O2", "m3-clang-Os", "rv32-gcc-O2", "rv32-clang-O2", "rv32-gcc-Os", "m4f-gcc-O2-libm", "rv32-gcc-O2-libm",
)  # fmt: skip
"""What CI runs; with newlib's and picolibc's functions instead of its own, too."""

DOUBLES = ("m4f-gcc-O2", "m7-gcc-O3", "rv32-gcc-O2")
"""Those of them in double precision too: by routines of libgcc, by hardware, and by other routines."""

HOPPING = ("m4f-gcc-O2", "rv32-clang-O2")
"""Where a robot hops, too: the plant in one task, the library in another, at 1 kHz."""

PROGRAMS = ("golden", "garbage", "refusals", "contract")
"""What else runs."""

CONTRACTING = ("-O3", "-march=x86-64-v3")
"""Where gcc forms fused instructions of its own accord; the flags of every build keep it from that."""

LIBM = re.compile(r"^(a?sin|a?cos|a?tan2?|exp2?|expm1|log|pow|cbrt|fmod|hypot|floor|ceil|fmax|fmin)f?$")
DOUBLE = re.compile(r"^(__aeabi_d|__aeabi_f2d|__aeabi_[iu]l?2d|__\w+df\d?$|__extendsfdf2|__truncdfsf2|sqrt$)")


def every_build() -> list[Build]:
    """All combinations that the compilers have; gcc 12 for these targets knows -Oz too."""
    own = [Build(target, compiler, level) for target in TARGETS for compiler in ("gcc", "clang") for level in LEVELS]
    return [*own, *(Build(target, "gcc", "-O2", libm=True) for target in TARGETS)]


def of_name(name: str) -> Build:
    match = re.fullmatch(r"(\w+)-(gcc|clang)(-O\w)(-libm)?", name)
    assert match, name
    target, compiler, level, libm = match.groups()
    return Build(BY_NAME[target], compiler, level, bool(libm))


def symbols(objects_f32: tuple[Path, ...], libm: bool) -> list[str]:
    """What is wrong with the symbols of single precision objects: double helpers, libm, memory of their own."""
    wrong = []
    for path in objects_f32:
        for line in run(["nm", str(path)]).splitlines():
            *_, kind, name = line.split()
            if kind == "U" and (DOUBLE.match(name) or (LIBM.match(name) and not (libm and name.endswith("f")))):
                wrong.append(f"{path.name} calls {name}")
            if kind in "dDbBC":
                wrong.append(f"{path.name} has memory: {name}")
            if kind in "TWVR" and not name.startswith("hopform_"):
                wrong.append(f"{path.name} gives the name {name}")
    return wrong


def unlike(many: dict[str, str], rounds_to_odd: bool) -> list[str]:
    """Digests of random calls that are not those of this computer;
    in double precision none is asked where ties go to odd.
    """
    if "f32" not in many:
        return ["random calls: no digest"]
    asked = {name: digest for name, digest in many.items() if not (rounds_to_odd and name == "f64")}
    return [
        f"random calls: {name} {digest}, here {native_digests()[name]}"
        for name, digest in asked.items()
        if digest != native_digests()[name]
    ]


def prove(build: Build, doubles: bool) -> tuple[str, list[str]]:
    """A line of the table, and what is wrong."""
    began = time.perf_counter()
    precisions = ("f32", "f64") if doubles else ("f32",)
    define = () if doubles else ("-DSINGLE",)
    try:
        digest = emulate(build.target, link(build, "selftest", precisions=precisions, define=define)).strip()
        many = dict(
            re.findall(DIGEST, emulate(build.target, link(build, "digests", precisions=precisions, define=define)))
        )
        odd = [] if build.libm else unlike(many, "ties-to-odd" in digest)
        digest = "a digest of its own" if build.libm else digest
        images = [link(build, name, precisions=precisions) for name in PROGRAMS]
        lines = [emulate(build.target, image) for image in images]
        hops = emulate(build.target, link(build, "hops", precisions=precisions)) if build.name in HOPPING else ""
        hops = f"{hops.strip().splitlines()[-1]}; " if hops else ""
        wrong = symbols(objects(build, precisions)[:: len(precisions)], build.libm)
    except Failed as error:
        return f"{build.name:16} FAILED", [f"{build.name}: {error}"]
    output = "; ".join(line.strip().splitlines()[-1] for line in lines)
    took = time.perf_counter() - began
    return f"{build.name:16} {digest:39} {output}; {hops}{took:.0f} s", [
        f"{build.name}: {what}" for what in [*odd, *wrong]
    ]


def digests(lines: list[str]) -> dict[str, set[str]]:
    """The selftest's digests by precision; those of an arithmetic that rounds ties to odd apart."""
    found: dict[str, set[str]] = {}
    for line in lines:
        for precision, digest, odd in re.findall(r"(f32|f64) ([0-9a-f]{8})( ties-to-odd)?", line):
            found.setdefault(precision + odd, set()).add(digest)
    return found


def of_python() -> dict[str, str]:
    """The digests of the library that Python loads."""
    import hopform
    from hopform._export import selftest

    if (message := hopform.library_message()) is not None:
        sys.exit(f"hopform: {message}")
    return {name: f"{selftest(dtype):08x}" for name, dtype in (("f32", "float32"), ("f64", "float64"))}


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.conformance.firmware", description=__doc__)
    parser.add_argument("--all", action="store_true", help="every combination, in both precisions")
    parser.add_argument("--report", action="store_true", help="count, and write docs/evidence/firmware-costs.*")
    chosen = parser.parse_args()
    if missing := needed():
        sys.exit(f"hopform: not installed: {', '.join(missing)} (.ci/run has Debian's packages)")
    if chosen.report:
        costs.report()
        return 0
    builds = every_build() if chosen.all else [of_name(name) for name in QUICK]
    lines, wrong = [], []
    with ThreadPoolExecutor(2) as pool:
        proofs = [pool.submit(partial(prove, build, chosen.all or build.name in DOUBLES)) for build in builds]
        for proof in proofs:
            line, found = proof.result()
            print(line, flush=True)
            lines.append(line)
            wrong += found
        for build, figures in [
            (b, pool.submit(costs.measure, b)) for b in (costs.BUILDS if chosen.all else costs.QUICK)
        ]:
            wrong += [*costs.grown(build, figures.result()), *costs.apart(figures.result())]
        checks = [pool.submit(strict.compilers), pool.submit(strict.misra)]
        wrong += [what for check in checks for what in check.result()]
    python, found = of_python(), digests(lines)
    wrong += [
        f"the selftest's digests differ: {name} {sorted(found[name])}, Python {digest}"
        for name, digest in python.items()
        if found[name] != {digest}
    ]
    if len(found.get("f64 ties-to-odd", ())) > 1:
        wrong.append(f"the selftest's digests differ where ties are rounded to odd: {sorted(found['f64 ties-to-odd'])}")
    if platform.machine() == "x86_64" and native_digests(*CONTRACTING) != native_digests():
        wrong.append(f"random calls at {' '.join(CONTRACTING)}: {native_digests(*CONTRACTING)}, not {native_digests()}")
    for what in wrong:
        print(what, file=sys.stderr)
    print(f"{len(builds)} combinations; Python {python}; {len(wrong)} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
