"""Kernels are compiled ahead, apart, and counted; what goes wrong apart is no harm."""

import subprocess
import sys

import pytest
from numba.core import event

from particlesim.core.constants import COMPILING
from particlesim.jobs import compiling
from particlesim.scene import Scene

SCENE = Scene(
    world={"size": [2.0, 2.0, 2.0]}, particles=[{"shape": "sphere", "count": 1}], movie={"resolution": [96, 64]}
)


@pytest.fixture
def processes(monkeypatch):
    """As if nothing were compiled yet (each kernel is loaded then); the processes that were started."""
    started = []

    class Process(subprocess.Popen):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            if "compile_apart" in self.args[2]:  # not one that tries what can draw here
                started.append(self)

    monkeypatch.setattr(compiling, "is_compiled", lambda module: False)
    monkeypatch.setattr(subprocess, "Popen", Process)
    return started


def _part(process):
    return process.args[2].split("'")[1]


def test_what_is_compiled_is_not_compiled_again(monkeypatch):
    monkeypatch.setattr(compiling, "is_compiled", lambda module: True)
    monkeypatch.setattr(subprocess, "Popen", None)
    told = []
    compiling.compile_kernels(SCENE, SCENE, lambda *what: told.append(what))
    assert told == []


def test_a_movie_is_compiled_by_three_processes(processes):
    compiling.compile_kernels(SCENE, SCENE, None)
    assert [_part(process) for process in processes] == ["collide", "draw"]
    assert [process.returncode for process in processes] == [0, 0]


def test_a_trajectory_needs_the_kernels_of_drawing_alone(processes):
    compiling.compile_kernels(SCENE, None, None)
    assert [_part(process) for process in processes] == ["collide"]
    compiling.compile_kernels(None, SCENE, None)
    assert len(processes) == 1


def test_a_process_that_fails_is_no_harm(processes, monkeypatch):
    monkeypatch.setattr(sys, "executable", "false")
    compiling.compile_kernels(SCENE, SCENE, None)
    assert [process.returncode for process in processes] == [1, 1]


def test_an_interruption_ends_the_processes(processes, monkeypatch):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(compiling, "_small", interrupted)
    with pytest.raises(KeyboardInterrupt):
        compiling.compile_kernels(SCENE, SCENE, None)
    assert [process.returncode for process in processes] == [-9, -9]


def _compile_one(*arguments):
    with event.trigger_event("numba:compile"):
        pass


def test_kernels_are_counted(monkeypatch):
    told = []
    monkeypatch.setattr(compiling, "is_compiled", lambda module: False)
    monkeypatch.setattr(compiling, "_draw", _compile_one)
    compiling.compile_kernels(None, SCENE, lambda *what: told.append(what))
    assert told == [(COMPILING, 1, compiling.COMPILATIONS["drawing"] + compiling.COMPILATIONS["occlusion"])]


@pytest.mark.parametrize(
    ("change", "part", "sign"),
    [
        ({"movie": {"quality": "normal"}}, "occlusion", "rendering.shading.ambient_occlusion"),
        ({"movie": {"quality": "high"}}, "soft light", "rendering.shading.pixel_light"),
        ({"movie": {"quality": "draft"}, "show": {"outlines": True}}, "outlines", "rendering.shading.outlines"),
    ],
)
def test_kernels_that_only_some_looks_need_are_compiled_for_these(monkeypatch, change, part, sign):
    told = []
    monkeypatch.setattr(compiling, "is_compiled", lambda module: module != sign)
    monkeypatch.setattr(compiling, "_draw", _compile_one)
    draft = Scene(**{**dict(SCENE), "movie": {"quality": "draft"}})
    compiling.compile_kernels(None, draft, lambda *what: told.append(what))
    assert told == []
    compiling.compile_kernels(None, Scene(**{**dict(SCENE), **change}), lambda *what: told.append(what))
    assert told == [(COMPILING, 1, compiling.COMPILATIONS[part])]


def test_kernels_compiled_apart_are_counted(monkeypatch, tmp_path):
    speaker = tmp_path / "speaker"
    speaker.write_text("#!/bin/sh\nprintf ..; sleep 0.1; printf .\n")
    speaker.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(speaker))
    told = []
    with compiling._Tally(told.append) as tally, tally.apart("draw", SCENE):
        _compile_one()
    assert told[-1] == 4
    assert told == sorted(told)
