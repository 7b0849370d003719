"""Texts of a model on pages of Markdown, where they must be neither markup nor a column of a table."""

import html


def cell(text: str) -> str:
    """A text as a cell of a table or in a heading; the page shows it as it is.

    >>> cell("<b> | a & b")
    '&lt;b&gt; \\\\| a &amp; b'
    """
    return html.escape(text, quote=False).replace("|", "\\|")
