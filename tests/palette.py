"""Pictures of the pages of evidence: small files of few colours, as a repository keeps each of their versions."""

import io
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

COLOURS = 32


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG with a palette."""
    picture = io.BytesIO()
    figure.savefig(picture, format="png")
    Image.open(picture).convert("P", palette=Image.Palette.ADAPTIVE, colors=COLOURS).save(path, optimize=True)
