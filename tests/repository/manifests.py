"""`make test-manifests`: the manifests of exported packages, by the build systems' own readers.

PlatformIO's schema reads library.json and Arduino's library.properties. ESP-IDF's component manager holds its manifest
against its schema and packs the component. Kconfiglib reads Zephyr's Kconfig with the settings of the sample. These
tools pin versions of what hopform needs, too, so they live in an environment of their own, which has no hopform.

Three schemas come with no package: HOPFORM_SCHEMAS names a folder that holds `PACK.xsd` (Open-CMSIS-Pack-Spec,
schema/), `zephyr_module.py` (Zephyr, scripts/) and the three files of arduino-lint (etc/schemas/) that `ARDUINO` lists.
Without it they are left out, by name.
"""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import jsonschema
import kconfiglib
import xmlschema
import yaml
from platformio.package.manifest.parser import ManifestParserFactory
from platformio.package.manifest.schema import ManifestSchema
from pykwalify.core import Core
from referencing import Registry
from referencing.jsonschema import DRAFT7

SPDX = {"licenses": [{"licenseId": "MIT-0"}]}
"""What the list on the network says of this licence; without it, PlatformIO's reader refuses every licence."""

PACK, MODULE = "PACK.xsd", "zephyr_module.py"
ARDUINO = (
    "arduino-library-properties-strict-schema.json",
    "arduino-library-properties-definitions-schema.json",
    "general-definitions-schema.json",
)


def cmsis_pack(package: Path, schema: Path) -> str:
    (description,) = package.glob("*.pdsc")
    xmlschema.XMLSchema(str(schema)).validate(str(description))
    return f"{PACK} takes {description.name}"


def zephyr_module(package: Path, script: Path) -> str:
    (text,) = re.findall(r"^METADATA_SCHEMA = '''\n(.*?)^'''", script.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    module = yaml.safe_load((package / "zephyr" / "module.yml").read_text("utf-8"))
    Core(source_data=module, schema_data=yaml.safe_load(text)).validate()
    return f"Zephyr's schema takes module.yml of {module['name']}"


def arduino(package: Path, folder: Path) -> str:
    schemas = {name: json.loads((folder / name).read_text("utf-8")) for name in ARDUINO}
    for schema in schemas.values():
        schema.pop("$id", None)  # they find each other by their names
    known = Registry().with_resources((name, DRAFT7.create_resource(schema)) for name, schema in schemas.items())
    lines = (package / "library.properties").read_text("utf-8").splitlines()
    properties = dict(line.split("=", 1) for line in lines)
    lacks = [
        each.message for each in jsonschema.Draft7Validator(schemas[ARDUINO[0]], registry=known).iter_errors(properties)
    ]
    assert lacks == ["'url' is a required property"], lacks  # of an index: the project has no address yet
    return f"arduino-lint's strict schema takes {', '.join(properties)}; an index would ask for url"


def by_schemas(packages: Path) -> Iterator[str]:
    """What the schemas say that come with no package; one that the folder lacks is an error."""
    folder = os.environ.get("HOPFORM_SCHEMAS")
    if not folder:
        yield f"not asked, for want of HOPFORM_SCHEMAS: {', '.join((PACK, MODULE, *ARDUINO))}"
        return
    yield cmsis_pack(packages / "cmsis-pack", Path(folder, PACK))
    yield zephyr_module(packages / "zephyr", Path(folder, MODULE))
    yield arduino(packages / "arduino", Path(folder))


def platformio(manifest: Path) -> str:
    ManifestSchema.load_spdx_licenses = staticmethod(lambda: SPDX)
    read = ManifestSchema().load_manifest(ManifestParserFactory.new_from_file(str(manifest)).as_dict())
    return f"PlatformIO reads {read['name']} {read['version']}, headers {read['headers']}"


def esp_idf(package: Path, out: Path) -> Iterator[str]:
    compote = str(Path(sys.executable).with_name("compote"))
    manifest = yaml.safe_load((package / "idf_component.yml").read_text("utf-8"))
    schema = subprocess.run([compote, "manifest", "schema"], capture_output=True, text=True, check=True).stdout
    jsonschema.validate(manifest, json.loads(schema))
    yield f"ESP-IDF's schema takes version {manifest['version']}"
    command = [compote, "component", "pack", "--name", "hopform", "--dest-dir", str(out)]
    subprocess.run(command, cwd=package, capture_output=True, text=True, check=True)
    (archive,) = out.glob("*.tgz")
    yield f"ESP-IDF packs {archive.name}, {archive.stat().st_size} bytes"


def zephyr(package: Path) -> Iterator[str]:
    os.environ["srctree"] = str(package / "zephyr")  # noqa: SIM112 (Kconfig's name)
    options = kconfiglib.Kconfig("Kconfig", warn_to_stderr=False)
    samples = sorted((package / "samples").rglob("prj.conf"))
    for sample in samples:
        options.load_config(str(sample))
        assert options.syms["HOPFORM"].str_value == "y", sample
    assert samples and not options.warnings, options.warnings
    yield f"Kconfiglib reads {', '.join(symbol.name for symbol in options.unique_defined_syms)}"


def main() -> int:
    packages = Path(sys.argv[1]).resolve()
    print(platformio(packages / "platformio" / "library.json"))
    print(platformio(packages / "arduino" / "library.properties"))
    print(
        *esp_idf(packages / "esp-idf", packages / "packed"),
        *zephyr(packages / "zephyr"),
        *by_schemas(packages),
        sep="\n",
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
