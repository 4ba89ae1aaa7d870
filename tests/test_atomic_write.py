"""Files appear whole or not at all, whatever else writes to the same path."""

import errno
import threading

import imageio.v3 as iio
import numpy as np
import pytest
from PIL import Image

import particlesim as ps
from particlesim.core.atomic_write import atomic_write
from particlesim.jobs.partial_run import PartialRunError
from particlesim.rendering import write_image
from tests.worlds import gas

SMALL = {"movie": {"fps": 20.0, "resolution": [64, 64]}, "duration": 0.5}


def both(work):
    """Run ``work`` in two threads at once; what they raised."""
    raised, ready = [], threading.Barrier(2)

    def run():
        ready.wait()
        try:
            work()
        except BaseException as error:
            raised.append(error)

    threads = [threading.Thread(target=run) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return raised


def test_the_last_of_two_wins_and_neither_sees_the_other(tmp_path):
    path = tmp_path / "a.txt"
    with atomic_write(path) as one, atomic_write(path) as other:
        assert one != other
        one.write_text("one")
        other.write_text("other")
    assert path.read_text() == "one"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


@pytest.mark.parametrize("name", ["a" * 251 + ".txt", "ä" * 125 + ".txt", ".txt", "12:30.txt", "a b%d\n.txt"])
def test_any_legal_name_works(tmp_path, name):
    with atomic_write(tmp_path / name) as hidden:
        hidden.write_text("whole")
    assert [p.name for p in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize(("make", "files"), [(ps.render, ["run.mp4", "run.png"]), (ps.simulate, ["run.gsd"])])
def test_of_two_runs_of_one_name_one_is_refused_and_the_other_whole(tmp_path, make, files):
    path = tmp_path / files[0]
    (refused,) = both(lambda: make(gas(3, **SMALL), path))
    assert isinstance(refused, PartialRunError) and "another run is at work" in str(refused)
    assert sorted(p.name for p in tmp_path.iterdir()) == files
    if make is ps.render:
        assert len(list(iio.imiter(path, plugin="FFMPEG"))) == 11
    else:
        with ps.Trajectory(path) as trajectory:
            assert len(list(trajectory)) == 11


def test_a_full_disk_names_the_file(tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Image.Image, "save", full)
    with pytest.raises(OSError, match=r"No space left on device: '.*a\.png'"):
        write_image(tmp_path / "a.png", np.zeros((8, 8, 3), dtype=np.uint8))
    assert list(tmp_path.iterdir()) == []
