"""`python -m docs.gallery DIR [NUMBER ...]`: write figures as SVG, all if none is named, captions.md and animation.gif."""

import sys
from pathlib import Path

from docs.gallery import DRAWN, draw
from docs.gallery.picture import as_svg
from docs.gallery.runs import hopping


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
    main(Path(sys.argv[1]), [int(each) for each in sys.argv[2:]] or [*DRAWN])
