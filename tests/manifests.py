"""`make test-manifests`: the manifests of exported packages, by the build systems' own readers.

PlatformIO's schema reads library.json and Arduino's library.properties. ESP-IDF's component manager holds its manifest against
its schema and packs the component. Kconfiglib reads Zephyr's Kconfig with the settings of the sample. These tools pin versions of
what hopform needs, too, so they live in an environment of their own, which has no hopform.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import jsonschema
import kconfiglib
import yaml
from platformio.package.manifest.parser import ManifestParserFactory
from platformio.package.manifest.schema import ManifestSchema

SPDX = {"licenses": [{"licenseId": "MIT-0"}]}
"""What the list on the network says of this licence; without it, PlatformIO's reader refuses every licence."""


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
    print(*esp_idf(packages / "esp-idf", packages / "packed"), *zephyr(packages / "zephyr"), sep="\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
