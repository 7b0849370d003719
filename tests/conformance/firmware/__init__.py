"""The generated C on emulated processors: build, run, compare and count."""
