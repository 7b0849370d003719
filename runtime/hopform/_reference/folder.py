"""The reference set as a folder of files: what `hopform reference write` writes."""

from pathlib import Path

from hopform._errors import HopformError
from hopform._files import check_folder, name_of, path_of, write_folder
from hopform._reference.cases import DATA, cases

TEXTS = tuple(Path(__file__).resolve().with_name(name) for name in ("README.md", "LICENSE"))


def write(folder: str | Path) -> tuple[Path, ...]:
    """Write the reference set into a new or empty folder, and return the files, relative to it.

    Of each case NAME.json, and NAME.xml (MJCF) and NAME.urdf where these can say it; README.md explains the format,
    LICENSE is CC0-1.0.
    Raises HopformError for a folder that holds files, or cannot be made.
    """
    place = path_of("DIR", folder)
    check_folder(place)
    if place.is_dir() and any(place.iterdir()):
        raise HopformError(f"DIR must be new or empty, got {name_of(place)}, which holds files")
    files = {Path(path.name): path.read_bytes() for path in TEXTS}
    for case in cases():
        files[Path(f"{case.name}.json")] = (DATA / f"{case.name}.json").read_bytes()
        if not case.without["mjcf"]:
            files[Path(f"{case.name}.xml")] = case.mjcf().encode()
        if not case.without["urdf"]:
            files[Path(f"{case.name}.urdf")] = case.urdf().encode()
    write_folder(place, files)
    return tuple(sorted(files))
