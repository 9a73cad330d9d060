import warnings

import h5py
import numpy as np
import pytest

from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.interfaces.observer import FieldDeclaration
from mpad_core.records.hdf5 import TrajectoryWriter
from mpad_core.records.header import TrajectoryHeader
from mpad_core.records.reader import read_trajectory


@pytest.fixture
def mdanalysis():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # raised on import by some of its own dependencies
        return pytest.importorskip("MDAnalysis")


def assert_holds(trajectory, toy, steps):
    state = np.arange(3.0 * toy.CELLS).reshape(toy.CELLS, 3)
    for step in range(steps):
        expected, found = toy.frame(step, state), trajectory.frame(step)
        for name in expected.__slots__:
            if name != "__weakref__":
                np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
        state = toy.moved(state, step)
    np.testing.assert_array_equal(trajectory.observed["tilt"], [toy.values(step)[0] for step in range(steps)])
    np.testing.assert_array_equal(trajectory.observed["contacts"], range(steps))
    np.testing.assert_array_equal(trajectory.bond_events, np.concatenate([toy.events(step) for step in range(steps)]))


def test_all_that_was_given_is_read_back(finished, toy):
    trajectory = read_trajectory(finished)
    assert trajectory.finished
    assert trajectory.header == toy.header()
    assert trajectory.fields == toy.FIELDS
    assert len(trajectory) == 9
    assert repr(trajectory) == "Trajectory(9 frames of 3 cells, 12 bond events, 0 to 0.8 s, finished)"
    assert_holds(trajectory, toy, 9)


def test_a_live_file_is_read_as_far_as_it_was_flushed(write, toy, tmp_path):
    with write(tmp_path / "trajectory.h5", steps=5) as writer:
        writer.append(toy.frame(5, np.zeros((toy.CELLS, 3))), toy.values(5))
        trajectory = read_trajectory(writer.path)
        assert not trajectory.finished
        assert writer.rows() == {"frames": 5, "bond_events": 6}
        assert_holds(trajectory, toy, 5)


@pytest.mark.parametrize("count", [1, 5, 64])
def test_frames_may_be_flushed_one_by_one_or_together(count, toy, tmp_path, assert_same):
    paths = tmp_path / "one.h5", tmp_path / "many.h5"
    for path, every in zip(paths, (1, count), strict=True):
        with TrajectoryWriter.create(path, toy.header(), toy.FIELDS) as writer:
            for step in range(20):
                writer.append(toy.frame(step, np.full((toy.CELLS, 3), 0.1 * step)), toy.values(step))
                if step % every == 0:
                    writer.flush(sync=True)
    assert_same(*paths)


def test_a_frame_is_copied_when_it_is_taken(toy, tmp_path):
    state = np.ones((toy.CELLS, 3))
    with TrajectoryWriter.create(tmp_path / "trajectory.h5", toy.header(), toy.FIELDS) as writer:
        writer.append(toy.frame(0, state), toy.values(0))
        state[:] = 7.0
    assert (read_trajectory(writer.path).positions == 1.0).all()


def test_quantities_not_asked_for_take_no_room(write, tmp_path):
    path = tmp_path / "trajectory.h5"
    write(path, quantities=("velocity",)).close()
    with h5py.File(path) as file:
        assert {"overlaps", "bond_counts", "bond_events", "capture_hazards"}.isdisjoint(file["mpad"])
        assert "velocities" in file["mpad"]
    trajectory = read_trajectory(path)
    assert trajectory.header.quantities == ("velocity",)
    assert np.isnan(trajectory.bond_counts).all()
    assert trajectory.overlaps.shape == (9, 3)
    assert len(trajectory.bond_events) == 0


def test_each_dataset_with_a_unit_says_it(finished):
    with h5py.File(finished) as file:
        bare = [
            name for name, item in file["mpad"].items() if isinstance(item, h5py.Dataset) and "unit" not in item.attrs
        ]
        assert set(bare) == {"step", "scene", "quantities", "row_sums", "bond_event_sums"}
        assert file["mpad/positions"].attrs["unit"] == "um"
        assert file["mpad/observers/tilt"].attrs["unit"] == "1"
        assert len(file["mpad/bond_events"].attrs["unit"].split()) == len(file["mpad/bond_events"].dtype.names)
        assert len(file["mpad/velocities"].attrs["unit"].split()) == 6


def test_no_dataset_has_a_type_of_variable_length(finished):
    with h5py.File(finished) as file:
        loose = []
        file.visititems(
            lambda name, item: loose.append(name) if getattr(item, "dtype", np.dtype("f8")).hasobject else None
        )
    assert not loose


def test_an_existing_file_is_never_opened_anew(finished, toy):
    before = finished.read_bytes()
    with pytest.raises(FileExistsError):
        TrajectoryWriter.create(finished, toy.header(), toy.FIELDS)
    assert finished.read_bytes() == before


@pytest.mark.filterwarnings("ignore::UserWarning:MDAnalysis")  # no masses and types to guess from
@pytest.mark.filterwarnings("ignore::DeprecationWarning:MDAnalysis")
def test_mdanalysis_opens_the_file_unchanged(finished, mdanalysis):
    ours = read_trajectory(finished)
    universe = mdanalysis.Universe.empty(len(ours.header.cells), trajectory=True)
    universe.load_new(str(finished), format="H5MD")
    assert len(universe.trajectory) == 9
    assert universe.dimensions is None
    for step, theirs in enumerate(universe.trajectory):
        np.testing.assert_allclose(theirs.positions, ours.positions[step] * 1e4, rtol=1e-6)  # Å, single precision
        assert theirs.time == pytest.approx(ours.times[step] * 1e12)  # ps
        assert theirs.data["step"] == ours.steps[step]


@pytest.mark.filterwarnings("ignore::UserWarning:MDAnalysis")
@pytest.mark.filterwarnings("ignore::DeprecationWarning:MDAnalysis")
def test_under_the_name_h5md_mdanalysis_asks_nothing(finished, mdanalysis):
    link = finished.with_suffix(".h5md")
    link.symlink_to(finished.name)
    universe = mdanalysis.Universe(str(link))
    assert (len(universe.atoms), len(universe.trajectory)) == (3, 9)


def test_wrong_values_are_refused_by_name_and_nothing_is_taken(write, toy, tmp_path):
    with write(tmp_path / "trajectory.h5", steps=2) as writer:
        frame = toy.frame(2, np.zeros((toy.CELLS, 3)))
        with pytest.raises(PartError, match=r"field tilt: declared with shape \(2, 3\), given \(3,\)"):
            writer.append(frame, (np.zeros(3), 1))
        with pytest.raises(PartError, match="2 declared, 1 values given"):
            writer.append(frame, (np.zeros((2, 3)),))
        with pytest.raises(PartError, match="field contacts: cannot be stored as"):
            writer.append(frame, (np.zeros((2, 3)), "many"))
        for wrong in (1.5, np.nan, np.array(np.nan)):
            with pytest.raises(PartError, match=r"field contacts: (declared|cannot be stored) as <i4"):
                writer.append(frame, (np.zeros((2, 3)), wrong))
        writer.flush()
        assert writer.rows()["frames"] == 2


@pytest.mark.parametrize(
    ("field", "fault"),
    [
        ({"name": "../x"}, "a name holds letters"),
        ({"name": ".x"}, "a name holds letters"),
        ({"shape": (0,)}, "shape"),
        ({"dtype": "O"}, "is not a number"),
        ({"dtype": "no such type"}, "is not a number"),
        ({"dtype": "c16"}, "is not a number"),
    ],
)
def test_fields_that_cannot_be_stored_are_refused_before_a_file_is_made(field, fault, toy, tmp_path):
    declared = FieldDeclaration(**{"name": "x", "unit": "1", **field})
    with pytest.raises(InputError, match=fault):
        TrajectoryWriter.create(tmp_path / "trajectory.h5", toy.header(), (declared,))
    assert not list(tmp_path.iterdir())


def test_two_fields_of_one_name_are_refused(toy, tmp_path):
    with pytest.raises(InputError, match="'x': declared twice"):
        TrajectoryWriter.create(tmp_path / "t.h5", toy.header(), [FieldDeclaration(name="x", unit="1")] * 2)


@pytest.mark.parametrize(
    "wrong",
    [{"cells": ()}, {"cells": ("a", "a")}, {"kinds": ()}, {"radii": (1.0, 2.0)}, {"seed": -1}, {"quantities": ("x",)}],
)
def test_headers_that_make_no_sense_are_refused(wrong):
    with pytest.raises(InputError):
        TrajectoryHeader(**{"cells": ("a",), "kinds": ("k",), "radii": (1.0,), "seed": 1, **wrong})


def test_observers_of_all_plain_types_come_back_as_declared(toy, tmp_path):
    fields = tuple(FieldDeclaration(name=f"x{d}", unit="", dtype=d) for d in ("f8", "f4", "i8", "u1", "bool", "i2"))
    with TrajectoryWriter.create(tmp_path / "t.h5", toy.header(), fields) as writer:
        writer.append(toy.frame(0, np.zeros((toy.CELLS, 3))), (1,) * len(fields))
    found = read_trajectory(tmp_path / "t.h5")
    assert found.fields == fields
    assert [found.observed[field.name].dtype for field in fields] == [np.dtype(field.dtype) for field in fields]
