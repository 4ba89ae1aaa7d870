"""Frames are drawn in any order, by any renderer, in any process, to the same bytes."""

import itertools
import pickle
import random

import numpy as np

from particlesim.jobs.frame_source import frame_source
from particlesim.rendering import Renderer
from particlesim.rendering.hud.history import History
from particlesim.rendering.look import look_of
from tests.worlds import gas

ROWS = ["time", "particles", "impacts", "energy change", "temperature", "pressure", "speed", "pairs tested"]


def tasks():
    """The look of a short movie with every kind of readout, field and line, and its frames with their histories."""
    movie = {"fps": 20.0, "resolution": [480, 360]}
    show = {"readout": ROWS, "cells": True, "legend": True}
    scene = gas(12, gravity=(0, 0, -9.81), boundary=("wall", "periodic", "wall"), duration=0.45, movie=movie, show=show)
    for group, colour in zip(scene.particles, ("by_speed", "by_height", "by_impacts", "by_shape"), strict=True):
        group.colour = colour
    source = frame_source(scene, None, None, None)
    history, drawn = History().then(source.first.ledger), []
    for _, frame in source.frames:
        if frame is not None:
            drawn.append((frame, history))
            history = history.then(frame.ledger)
    return look_of(scene, source.header, source.first), drawn


def test_pictures_depend_on_nothing_drawn_before():
    look, drawn = tasks()
    with Renderer(look) as renderer:
        in_order = [renderer.draw(*task) for task in drawn]
    shuffled = list(range(len(drawn)))
    random.Random(1).shuffle(shuffled)
    # What another machine would be sent.
    look, drawn = pickle.loads(pickle.dumps((look, drawn)))
    with Renderer(look) as one, Renderer(look) as two:
        for turn, k in enumerate([*reversed(range(len(drawn))), *shuffled]):
            picture = (one, two)[turn % 2].draw(*drawn[k])
            assert np.array_equal(picture, in_order[k]), k
    assert all(not np.array_equal(a, b) for a, b in itertools.pairwise(in_order))


def test_a_pressure_needs_a_past_and_no_other_row_does():
    look, drawn = tasks()
    frame, history = drawn[5]
    bare = look.scene.show.model_copy(update={"readout": [row for row in ROWS if row != "pressure"]})
    with Renderer(look) as renderer:
        assert not np.array_equal(renderer.draw(frame, history), renderer.draw(frame))
    look.scene.show = bare
    with Renderer(look) as renderer:
        assert np.array_equal(renderer.draw(frame, history), renderer.draw(frame))
