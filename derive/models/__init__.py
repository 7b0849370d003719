"""The mechanisms that ship."""
