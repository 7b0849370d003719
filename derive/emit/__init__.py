"""From the program to files: the intermediate form, its spelling in NumPy and C, templates and engine into generated/.
"""
