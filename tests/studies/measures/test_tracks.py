"""Tracks from runs and from tables: what is read, what is refused, and at what times a camera looks."""

import numpy as np
import pytest

from mpad_core.interfaces.errors import InputError
from mpad_core.records.reader import read_trajectory
from mpad_core.studies.measures.track_tables import read_tracks, write_tracks
from mpad_core.studies.measures.tracks import Track, resampled, tracks_of, usual_interval

TRACKMATE = """\
LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y,POSITION_Z,POSITION_T,FRAME,RADIUS
Label,Spot ID,Track ID,Quality,X,Y,Z,T,Frame,Radius
Label,Spot ID,Track ID,Quality,X,Y,Z,T,Frame,R
,,,(quality),({unit}),({unit}),({unit}),(sec),,({unit})
ID7,7,1,3.5,12.0,4.0,0,0.066,2,5
ID5,5,1,3.5,10.0,4.5,0,0.0,0,5
ID6,6,0,3.5,3.0,1.0,0,0.033,1,5
ID9,9,None,3.5,99,99,0,0.033,1,5
ID8,8,,3.5,99,99,0,0.033,1,5
"""


@pytest.fixture
def table(tmp_path):
    def written(text, name="tracks.csv"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return written


class TestTracks:
    def test_a_camera_looks_at_whole_multiples_of_its_interval(self):
        track = Track(times=[0.05, 0.15, 0.31], x=[0.0, 1.0, 2.6], y=[1.0, 1.0, 1.0], name="a")
        seen = resampled(track, 0.1)
        assert seen.times.tolist() == pytest.approx([0.1, 0.2, 0.3])
        assert seen.x.tolist() == pytest.approx([0.5, 1.5, 2.5])
        assert resampled(track, 0.1, after=0.15).times.tolist() == pytest.approx([0.2, 0.3])
        assert len(resampled(track, 1.0)) == 0

    def test_frames_at_those_times_are_kept_to_the_last_bit(self):
        times = 0.033 * np.arange(1000)
        x = np.random.default_rng(1).normal(size=1000)
        seen = resampled(Track(times=times, x=x, y=x, name="a"), 0.033)
        assert np.array_equal(seen.x, x)
        assert np.array_equal(seen.times, times)

    def test_tracks_of_a_run(self, rolling_run):
        trajectory = read_trajectory(rolling_run / "trajectory.h5")
        first, second = tracks_of(trajectory, run="here")
        assert (first.name, second.kind, second.radius, second.run) == ("cell-0", "bead", 5.0, "here")
        assert np.array_equal(second.y, np.full(2001, 20.0))
        assert usual_interval([first, second]) == 0.01
        assert repr(first) == "Track('cell-0', 2001 frames, 0 to 20 s)"


class TestTables:
    def test_a_plain_table_of_one_cell(self, table):
        (track,) = read_tracks(table("t,x,y\n0,1,2\n1,3,2\n"))
        assert (track.name, track.times.tolist(), track.x.tolist()) == ("tracks", [0, 1], [1, 3])

    @pytest.mark.parametrize("mark", [",", ";", "\t"])
    def test_any_order_case_and_mark(self, table, mark):
        text = "\ufeffCell,Note,Y,Time,X\nb,?,2,1,5\na,?,0,0,7\nb,?,2,0,4\n".replace(",", mark)
        first, second = read_tracks(table(text), length_unit=0.5, time_unit=2.0)
        assert (first.name, second.name) == ("b", "a")
        assert (first.times.tolist(), first.x.tolist(), first.y.tolist()) == ([0, 2], [2, 2.5], [1, 1])

    def test_spots_as_trackmate_exports_them(self, table):
        one, other = read_tracks(table(TRACKMATE.format(unit="micron")))
        assert (one.name, one.times.tolist(), one.x.tolist()) == ("1", [0.0, 0.066], [10.0, 12.0])
        assert (other.name, len(other)) == ("0", 1)

    def test_what_was_written_is_read_to_the_last_bit(self, tmp_path, rolling_track):
        written = [rolling_track(1, duration=5.0, name="a"), rolling_track(2, duration=5.0, name="b, c")]
        write_tracks(tmp_path / "out.csv", written)
        for one, other in zip(written, read_tracks(tmp_path / "out.csv"), strict=True):
            assert one.name == other.name
            assert all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("times", "x", "y"))

    @pytest.mark.parametrize(("text", "says"), [
        ("", "is empty"),
        ("t,y\n0,1\n", ":1: no column for x; one must be called x or position_x"),
        ("t,x,y\n", "holds no track"),
        ("t,x,y\n0,1,2\n1,oops,2\n", ":3: x: 'oops' is not a finite number"),
        ("t,x,y\n0,1,2\n\nnan,1,2\n", ":4: time: 'nan' is not a finite number"),
        ("t,x,y\n0,1,2\n1,2\n", ":3: has only 2 columns"),
        ("t,x,y,cell\n0,1,2,a\n1,1,2,a\n0,1,2,b\n1,2,2,a\n", ":5: cell 'a' has time 1 twice"),
        ("frame,x,y\n0,1,2\n", ":1: times are numbers of frames; say how long one is (--time-unit 33ms)"),
        (TRACKMATE.format(unit="pixel"), ":4: lengths are in pixels; say how long one is (--length-unit 0.65um)"),
        ("t,x,y\n0,\0,2\n", ":2: x: "),
    ])  # fmt: skip
    def test_what_cannot_be_read_is_told_in_a_line(self, table, text, says):
        path = table(text)
        with pytest.raises(InputError) as refused:
            read_tracks(path)
        assert str(refused.value).startswith(str(path))
        assert says in str(refused.value)
        assert "\n" not in str(refused.value)

    def test_units_that_are_told_will_do(self, table):
        assert read_tracks(table("frame,x,y\n0,1,2\n3,1,2\n"), time_unit=0.033)[0].times.tolist() == [0, 0.099]
        assert read_tracks(table(TRACKMATE.format(unit="pixel")), length_unit=0.5)[0].x.tolist() == [5, 6]

    def test_what_is_no_table(self, tmp_path):
        with pytest.raises(InputError, match="cannot be read"):
            read_tracks(tmp_path / "none.csv")
        (tmp_path / "bytes.csv").write_bytes(b"t,x,y\n\xff\xfe,1,2\n")
        with pytest.raises(InputError, match="is no table of text"):
            read_tracks(tmp_path / "bytes.csv")
