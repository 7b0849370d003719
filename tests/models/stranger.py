"""The hopper of the paper, built as a stranger."""

terms = ()
