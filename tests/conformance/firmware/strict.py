"""The generated C under strict compilers, gcc's analyzer, and cppcheck with MISRA:
nothing but what docs/developers/misra.md argues.
"""

import re
import shutil

from tests.conformance.firmware.targets import COMMON, ROOT, C, Failed, run, sources

PAGE = ROOT / "docs" / "developers" / "misra.md"
GCC = (
    "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wsign-conversion", "-Wdouble-promotion", "-Wfloat-equal",
    "-Wshadow", "-Wundef", "-Werror",
)  # fmt: skip
CLANG = ("-Weverything", "-Werror", "-Wno-declaration-after-statement")
KNOWN_FALSE = {"ctuuninitvar"}


def argued() -> set[str]:
    """Rules and warnings that the page gives reasons for."""
    text = PAGE.read_text("utf-8")
    rules = {rule for cell in re.findall(r"^\| ([\d., ]+) \|", text, re.MULTILINE) for rule in cell.split(", ")}
    return rules | set(re.findall(r"^\| `(-W[\w-]+)` \|", text, re.MULTILINE))


def compilers() -> list[str]:
    """Sources that a strict compiler refuses."""
    include = ["-I", str(C / "include"), "-c", "-o", "/dev/null"]
    off = ["-Wno-" + warning.removeprefix("-W") for warning in sorted(argued()) if warning.startswith("-W")]
    wrong = []
    for source in sources():
        analyzer = ["-fanalyzer"] if "_f32" in source.name else []
        for command in (["gcc", *COMMON, "-O2", *GCC, *analyzer], ["clang", *COMMON, "-O1", *CLANG, *off]):
            try:
                run([*command, *include, str(source)])
            except Failed as error:
                wrong.append(str(error))
    return wrong


def misra() -> list[str]:
    """What cppcheck finds in single precision that is not argued."""
    if shutil.which("cppcheck") is None:
        return ["cppcheck is not installed"]
    form = "--template={file}:{line}: {id}"
    flags = [
        "--addon=misra",
        "--platform=unix32",
        "--std=c99",
        "-DFLT_MANT_DIG=24",  # of float.h, which cppcheck has not: the sources refuse to be compiled without
        "-DFLT_MAX_EXP=128",
        "--enable=warning,portability,performance,information",
        "--suppress=missingIncludeSystem",
        "--quiet",
        form,
    ]
    found = run(["cppcheck", *flags, "-I", str(C / "include"), *map(str, sources(("f32",)))], timeout=300)
    allowed = {f"misra-c2012-{rule}" for rule in argued()} | KNOWN_FALSE
    lines = [line for line in found.splitlines() if re.search(r":\d+: \S+$", line)]
    if not any(line.endswith("misra-c2012-15.5") for line in lines):
        return ["cppcheck found not even what docs/developers/misra.md argues most often: it did not look"]
    return [line for line in lines if line.rsplit(" ", 1)[1] not in allowed]
