"""Runs in a process of their own that can be killed at any moment, and what came of them."""

import hashlib
import subprocess
import sys

import imageio_ffmpeg

from particlesim.trajectory.gsd_file import Trajectory

# A run that keeps what it has four times a second, and kills itself, if told to, so many seconds after its work began.
RUN = """
import os, signal, sys, threading
from particlesim.jobs import movie, partial_run
from particlesim.scene.file import load_scene
partial_run.INTERVAL, partial_run._SPARE = 0.25, 1.0
scene, path, delay = sys.argv[1:]
if delay:
    threading.Timer(float(delay), os.kill, (os.getpid(), signal.SIGKILL)).start()
make = movie.simulate if path.endswith(".gsd") else movie.render
make(load_scene(scene), path, resume=True)
os._exit(0)
"""


def run(scene, path, delay=""):
    """The exit code of a run of a scene file to ``path``, which is killed after ``delay`` seconds if it still works."""
    command = [sys.executable, "-c", RUN, str(scene), str(path), str(delay)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode in (0, -9), done.stderr
    return done.returncode


def content(path):
    """What is in a movie or a trajectory, as one digest: all decoded frames, or all that its file holds of each."""
    found = hashlib.sha256()
    if path.suffix == ".gsd":
        with Trajectory(path) as trajectory:
            chunks = trajectory._chunks
            for k in range(len(trajectory)):
                for name in chunks._file.find_matching_chunk_names(""):
                    if chunks.has(name, k):
                        found.update(name.encode() + chunks._file.read_chunk(k, name).tobytes())
        return found.hexdigest()
    reader = imageio_ffmpeg.read_frames(str(path))
    next(reader)
    for frame in reader:
        found.update(frame)
    return found.hexdigest()
