"""Identification: a robot's parameters from its own measurements, with what the data can and cannot tell."""
