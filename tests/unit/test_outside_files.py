"""Files by a grammar, spoilt here and there: each is read, or refused in one message that names it."""

import tempfile
import warnings
from pathlib import Path

import numpy as np
from hypothesis import given

import hopform
import hopform.hopping
import hopform.identify
from derive.model.equations import Model, ModelError
from derive.model_file import read_model
from hopform._robots import robot_from_toml
from tests.outside import examples, model_files, robot_files, tables


def outcome(read, content, name, refusal=hopform.HopformError):
    """What is read of a file of this content; None where it is refused by its name."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        path = Path(folder) / name
        path.write_bytes(content)
        try:
            return read(path)
        except refusal as error:
            message = str(error)
            assert name in message and "\n" not in message and len(message) < 700, message
    return None


def test_any_robot_file_is_read_or_refused():
    found = []

    @given(robot_files())
    @examples(100)
    def each(content):
        robot = outcome(hopform.load_robot, content, "robot.toml")
        found.append(robot is not None)
        assert robot is None or robot_from_toml(robot.to_toml()) == robot

    each()
    assert 0 < sum(found) < len(found)


def test_any_table_is_read_or_refused():
    found = []

    @given(tables())
    @examples(100)
    def each(content):
        recording = outcome(hopform.identify.read_recording, content, "table.csv")
        if recording is not None:
            assert all(np.isfinite(column.values).all() for column in recording.columns.values())
            assert (np.diff(recording.time) > 0.0).all()
        heights = outcome(hopform.hopping.terrain.read, content, "table.csv")
        assert heights is None or (heights and np.isfinite(heights).all())
        found.append((recording is not None, heights is not None))

    each()
    assert all(0 < sum(of) < len(found) for of in zip(*found, strict=True))


def test_any_model_file_is_read_or_refused():
    found = []

    @given(model_files())
    @examples(30)
    def each(content):
        model = outcome(read_model, content, "model.py", ModelError)
        assert model is None or isinstance(model, Model)
        found.append(model is not None)

    each()
    assert 0 < sum(found) < len(found)
