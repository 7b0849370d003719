"""The solver: the generated package and its compiled library, which nothing outside this folder imports by name."""
