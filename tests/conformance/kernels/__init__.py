"""Every float32 input of every kernel."""
