"""What `make lint` asks of C: that its tools look at the formulas, and that what they find is a failure. And that the
driver of Eva names functions of the library as it is.
"""

import os
import re
import shutil
import subprocess
from pathlib import Path

from tests.conformance.firmware import eva

ROOT = Path(__file__).resolve().parents[2]
SOUND = "static inline float half(float value)\n{\n    return value / 2.0f;\n}\n"
BROKEN = {
    "a float that becomes an int": "static inline int f(float a)\n{\n    int b = a;\n    return b;\n}\n",
    "a division by zero": "static inline int f(int a)\n{\n    int b = 0;\n    return a / b;\n}\n",
}


def lint(*files: Path, path: str | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [shutil.which("sh") or "sh", ROOT / "tools" / "lint_c.sh", *files],
        env={**os.environ, "HOPFORM_CI": "", "PATH": path or os.environ["PATH"], **environment},
        capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_what_clang_tidy_or_cppcheck_finds_is_a_failure(tmp_path):
    header = tmp_path / "formulas.h"
    for text in BROKEN.values():
        header.write_text(text, "utf-8")
        assert lint(header).returncode != 0, text
    header.write_text(SOUND, "utf-8")
    done = lint(header)
    assert done.returncode == 0, done.stdout + done.stderr


def test_without_cppcheck_it_says_so_and_in_ci_it_fails(tmp_path):
    header = tmp_path / "formulas.h"
    header.write_text(SOUND, "utf-8")
    bare = tmp_path / "bin"
    bare.mkdir()
    for name in ("dirname", "sh"):
        (bare / name).symlink_to(str(shutil.which(name)))
    done = lint(header, path=str(bare))
    assert done.returncode == 0 and "cppcheck is not installed: skipped" in done.stdout, done.stderr
    assert lint(header, path=str(bare), HOPFORM_CI="1").returncode == 1


def test_eva_calls_each_function_for_firmware_and_its_options_name_functions_that_exist():
    library = "".join(path.read_text("utf-8") for path in sorted((eva.C / "src").glob("*_f32.*")))
    options = ",".join([*eva.UNROLLED.values(), *eva.SPLIT.values()]).split(",")
    assert not {name for name, *_ in (each.split(":") for each in options) if f" {name}(" not in library}
    driver = (eva.HERE / "eva.c").read_text("utf-8")
    header = (eva.C / "include" / "hopform" / "hopform_f32.h").read_text("utf-8")
    defined = "".join(path.read_text("utf-8") for path in sorted((eva.C / "src").glob("*_f32.inc")))
    public = {name for name in re.findall(r"^\w+ (hopform_\w+_f32)\(", defined, re.MULTILINE) if name in header}
    through_another = {"hopform_choose_current_begin_f32", "hopform_choose_current_step_f32"}
    public -= {"hopform_selftest_f32"}  # reads nothing that is given
    assert {name for name in public if f"{name}(" not in driver} == through_another
