"""Runs in a process of their own that are killed at any moment of any part of their work, and what came of them."""

import hashlib
import json
import random
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import imageio_ffmpeg

from particlesim.trajectory.gsd_file import Trajectory

# A scene to be killed in. Its scale is given: one that is settled by the frames is simulated anew by those who go on.
SCENE = """
title = "Left"
duration = 2.5
[world]
size = [3, 3, 3]
[movie]
resolution = [96, 64]
[show]
readout = true
plot = "energy"
[[particles]]
shape = "cube"
count = 25
size = 0.4
colour = { field = "speed", range = [0, 30] }
velocity = { kind = "maxwell", temperature = 10 }
"""

# A run that keeps what it has twenty times a second. It says how often it began each part of its work, and the hash of
# its last state. Told to, it kills itself so many seconds after it began a part for the nth time: alone, or with ffmpeg
# as one does who kills a whole group or pulls the plug. Before that it says which parts it was in the midst of.
RUN = """
import collections, functools, json, os, signal, sys, threading
import psutil
from particlesim.jobs import movie, partial_run
from particlesim.rendering import Renderer
from particlesim.rendering.video.segments import Segments
from particlesim.scene.file import load_scene
from particlesim.simulation.simulation import Simulation
from particlesim.trajectory.gsd_file import TrajectoryWriter

partial_run.INTERVAL, partial_run._SPARE = 0.05, 1.0
scene, path, aim = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
begun, under_way, last = collections.Counter(), collections.Counter(), None

def say(table):
    os.write(1, json.dumps(table).encode() + b"\\n")

def kill():
    say({"killed in": sorted(+under_way)})
    for child in psutil.Process().children() if aim["all"] else ():
        child.kill()
    os.kill(os.getpid(), signal.SIGKILL)

def watch(part, owner, name):
    call = getattr(owner, name)
    @functools.wraps(call)
    def watched(*args, **options):
        begun[part] += 1
        if aim and (part, begun[part]) == (aim["part"], aim["nth"]):
            threading.Timer(aim["delay"], kill).start()
        under_way[part] += 1
        try:
            return call(*args, **options)
        finally:
            under_way[part] -= 1
    setattr(owner, name, watched)

def remember(simulation, *args):
    global last
    last = simulation
    begin(simulation, *args)

begin, Simulation._begin = Simulation._begin, remember
watch("simulate", Simulation, "step_towards")
watch("write", TrajectoryWriter, "append")
watch("draw", Renderer, "draw")
watch("encode", Segments, "send")
watch("keep", partial_run.PartialRun, "keep")
watch("join", Segments, "join")
watch("end", partial_run.PartialRun, "__exit__")
make = movie.simulate if path.endswith(".gsd") else movie.render
make(load_scene(scene), path, resume=True)
say({"begun": begun, "hash": last.state_hash()})
os._exit(0)
"""

# The parts of a run, by the ending of its output, each with about how long it takes at the most [s].
PARTS = {
    ".gsd": {"simulate": 0.003, "write": 0.003, "keep": 0.05, "end": 0.005},
    ".mp4": {"simulate": 0.003, "draw": 0.03, "encode": 0.05, "keep": 0.05, "join": 0.2, "end": 0.005},
}


class Killed(NamedTuple):
    """A run that was killed."""

    aim: str  # the part that it was to be killed in
    midst: tuple[str, ...]  # the parts that it was in the midst of
    all: bool  # whether ffmpeg was killed with it
    resumed: bool  # whether it went on with one that had been killed


def run(scene, path, **aim):
    """What a run of a scene file to ``path`` says: where it was killed, or what it did."""
    command = [sys.executable, "-c", RUN, str(scene), str(path), json.dumps(aim)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode in (0, -9), done.stderr
    said = [json.loads(line) for line in done.stdout.splitlines()]
    # One that ends while it kills itself may say both.
    return next(table for table in said if ("killed in" in table) == (done.returncode != 0))


def kills(scene, path, count, seed):
    """Kill at least ``count`` runs of a scene file to ``path``, at random; each is gone on with, some are killed again.

    Yields those that were killed until one came to its end, and what that says.
    """
    rng = random.Random(seed)
    straight = run(scene, path)
    yield [], straight
    parts = list(PARTS[path.suffix].items())
    done = turn = 0
    while done < count:
        for old in path.parent.glob(f"{path.stem}.*"):
            old.unlink()
        killed = []
        left = straight["begun"]
        for again in range(rng.choice((1, 1, 2, 3))):
            part, longest = parts[turn % len(parts)]
            turn += 1
            # What is left to be done, if it is gone on with, is less than all.
            nth = rng.randint(1, max(1, left[part] // (1 + 3 * bool(again))))
            aim = {"part": part, "nth": nth, "delay": rng.uniform(0.0, longest), "all": rng.random() < 0.5}
            said = run(scene, path, **aim)
            if "killed in" not in said:
                break
            killed.append(Killed(part, tuple(said["killed in"]), aim["all"], bool(again)))
        else:
            said = run(scene, path)
        done += len(killed)
        yield killed, said


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


def bytes_of(path: Path):
    """Of a movie, which is to be the same to the byte, and of its poster; of a trajectory what it holds is."""
    return [path.with_suffix(suffix).read_bytes() for suffix in (".mp4", ".png")] if path.suffix == ".mp4" else []
