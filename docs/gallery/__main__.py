"""`python -m docs.gallery DIR [NUMBER ...]`: write figures as SVG, all if none is named, captions.md and animation.gif."""

import argparse
from pathlib import Path

from docs.gallery import DRAWN, draw
from docs.gallery.picture import as_svg
from docs.gallery.runs import hopping


def figure(text: str) -> int:
    """A number of `DRAWN`."""
    if text not in map(str, DRAWN):
        raise argparse.ArgumentTypeError(f"the figures are 1 to {max(DRAWN)}, got {text!r}")
    return int(text)


def main(folder: Path, numbers: list[int]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    captions = ["# The figures\n\nWritten by `make figures`; the numbers are computed as they are drawn.\n"]
    for number in numbers:
        picture = draw(number)
        (folder / f"fig_{number:02d}.svg").write_bytes(as_svg(picture.figure))
        captions.append(picture.in_markdown(f"fig_{number:02d}.svg"))
    (folder / "captions.md").write_text("\n".join(captions), "utf-8")
    (folder / "animation.gif").write_bytes(hopping())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        prog="python -m docs.gallery", description="Write the paper's figures into a folder."
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="the folder, made if it is missing")
    parser.add_argument("numbers", type=figure, nargs="*", default=[], metavar="NUMBER", help="1 to 17; default: all")
    given = parser.parse_args()
    main(given.folder, given.numbers or [*DRAWN])
