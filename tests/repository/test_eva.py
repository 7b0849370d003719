"""The driver of Eva names functions of the library as it is: Eva itself runs in `make frama-c` alone."""

import re

from tests.conformance.firmware import eva


def test_eva_calls_each_function_for_firmware_and_its_options_name_functions_that_exist():
    library = "".join(path.read_text("utf-8") for path in sorted((eva.C / "src").glob("*_f32.*")))
    options = ",".join([*eva.UNROLLED.values(), *eva.SPLIT.values()]).split(",")
    assert not {name for name, *_ in (each.split(":") for each in options) if f" {name}(" not in library}
    driver = (eva.HERE / "eva.c").read_text("utf-8")
    header = (eva.C / "include" / "hopform" / "hopform_f32.h").read_text("utf-8")
    defined = "".join(path.read_text("utf-8") for path in sorted((eva.C / "src").glob("*_f32.h")))
    public = {name for name in re.findall(r"^\w+ (hopform_\w+_f32)\(", defined, re.MULTILINE) if name in header}
    public -= {"hopform_selftest_f32"}  # reads nothing that is given
    assert not {name for name in public if f"{name}(" not in driver}
