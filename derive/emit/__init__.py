"""From the program to files: the intermediate form, its spelling in NumPy and C, what writes generated/."""
