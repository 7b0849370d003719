"""Identification: a robot's parameters from its own measurements, with what the data can and cannot identify.

    >>> import hopform
    >>> recording = hopform.record(hopform.load_robot("hopper_c"), "drop", height=0.2, seed=1)
    >>> fit = hopform.fit_drop_test(recording, known={"m_s": 3.0})
    >>> fit["k"].low < 1200.0 < fit["k"].high
    True

Importing its modules needs NumPy alone; fitting needs the extra `identify` (scipy).
"""
