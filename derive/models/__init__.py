"""The mechanisms that ship: a model file each."""
