"""Pictures: what `.plot()` of a result, `--plot` of a command and `animate` draw. They need the extra `plot`."""
