"""The colours of all pictures."""

from collections.abc import Mapping

PALETTE: Mapping[str, str] = {
    "blue": "#0072B2", "orange": "#D55E00", "green": "#009E73", "sky": "#56B4E9", "pale blue": "#8CC4E8",
    "magenta": "#A6257A", "grey": "#666666", "black": "#222222",
}  # fmt: skip
"""Blue, orange, green and sky are of the palette of Okabe and Ito, which colour-blind readers distinguish."""
