"""Labels of particles: beside what they are of, in the picture, and in the words of the scene."""

import numpy as np
import pytest

import particlesim as ps
from particlesim.rendering import Renderer
from particlesim.rendering.hud.labels import Labels
from particlesim.rendering.hud.panel import Style
from particlesim.rendering.look import look_of
from particlesim.simulation.simulation import Simulation

SIZE = (320, 180)


def scene(poses, labels, **keys):
    """Unit spheres, all of them red, in a world without floor and edges."""
    group = {
        "name": "balls",
        "shape": "sphere",
        "size": 1.0,
        "colour": "#ff0000",
        "placement": {"kind": "list", "poses": [{"position": position} for position in poses]},
    }
    camera = {"kind": "look-at", "position": [12, 1, 2], "target": [0, 0, 0]}
    return ps.Scene(
        world={"size": [20, 20, 20], "boundary": "open"},
        particles=[group],
        camera=camera,
        movie={"resolution": list(SIZE)},
        show={"labels": labels, "readout": False},
        **keys,
    )


def picture(made, labels):
    """The first picture with and without its labels."""
    sim = Simulation(made)
    images = []
    for shown in (labels, []):
        made.show.labels = shown
        with Renderer(look_of(made, sim.header, sim.frame())) as renderer:
            images.append(renderer.draw(sim.frame()))
    return images


def box_of(mask):
    """First and last row and column of what is set."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return rows[0], rows[-1], columns[0], columns[-1]


@pytest.mark.parametrize("position", [(0, 0, 0), (0, -3, 1.5), (2, 3, -1.5)])
def test_a_label_stands_at_the_upper_right_of_its_particle(position):
    labels = [{"particle": 0, "text": "here"}]
    shown, bare = picture(scene([position], labels), labels)
    red = bare[:, :, 0].astype(int) - bare[:, :, 1] > 60
    top, bottom, left, right = box_of(red)
    changed = np.any(shown != bare, axis=2)
    _, low, begin, _ = box_of(changed)
    middle, radius = (0.5 * (top + bottom), 0.5 * (left + right)), 0.5 * (right - left)
    assert 0.6 * radius < begin - middle[1] < 0.9 * radius + 1
    assert 0.6 * radius - 1 < middle[0] - low < 0.9 * radius + 1


def test_all_of_a_group_and_single_ones_by_name_number_and_text():
    labels = [{"group": "balls"}, {"particle": 1}, {"particle": 2, "text": "the third"}]
    made = scene([(0, 3 * k, 0) for k in range(-1, 2)], labels)
    sim = Simulation(made)
    panels, style = Labels(made, sim.header, dark=False)._panels, Style(SIZE, False)
    assert [panels[k].size[1] for k in range(3)] == [
        style.width(text) + 2 * (style.pad // 2) for text in ("balls", "1", "the third")
    ]


def test_a_label_stays_in_the_picture_and_goes_with_its_particle():
    labels = [{"group": "balls", "text": "a rather long label"}]
    edge, far, behind = (0, 7.0, 0), (0, 30.0, 0), (14, 1, 2)
    shown, bare = picture(scene([edge], labels), labels)
    changed = np.any(shown != bare, axis=2)
    panel = Style(SIZE, False)
    _, _, left, right = box_of(changed)
    assert right == SIZE[0] - 1 and right - left > panel.width("a rather long label")
    for away in (far, behind):
        shown, bare = picture(scene([away], labels), labels)
        assert (shown == bare).all()


def test_nearer_labels_lie_over_those_behind():
    near, far = (3, 0, 0), (-3, 0, 0)
    labels = [{"particle": 0, "text": "near"}, {"particle": 1, "text": "far, and wide"}]
    both, _ = picture(scene([near, far], labels), labels)
    alone, bare = picture(scene([near, far], labels), labels[:1])
    of_near = np.any(alone != bare, axis=2)
    ink = (alone.max(axis=2) < 60) & of_near
    assert ink.any() and (both.max(axis=2)[ink] < 60).all()


def test_a_picture_without_background_has_opaque_labels():
    labels = [{"particle": 0}]
    made = scene([(0, 0, 0)], labels)
    made.movie.background = "transparent"
    shown, bare = picture(made, labels)
    changed = np.any(shown != bare, axis=2)
    assert changed.any() and (shown[changed][:, 3] > 200).all()


@pytest.mark.parametrize(
    ("labels", "line"),
    [
        ([{}], "show.labels[0]: give particle or group, one of them"),
        ([{"particle": 0, "group": "balls"}], "show.labels[0]: give particle or group, one of them"),
        ([{"particle": 1}], "show.labels[0].particle = 1: there are the particles 0 to 0"),
        ([{"particle": -1}], "show.labels[0].particle = -1: must be the number of a particle, 0 the first"),
        (
            [{"particle": 0}, {"group": "bals"}],
            "show.labels[1].group = \"bals\": no group has this name; did you mean 'balls'?",
        ),
        ([{"particle": 0, "text": ""}], 'show.labels[0].text = "": must be 1 to 60 letters in quotes'),
    ],
)
def test_wrong_labels_have_one_line(labels, line):
    with pytest.raises(ps.SceneError) as error:
        scene([(0, 0, 0)], labels)
    assert str(error.value) == line


def test_a_thousand_labels_are_the_most():
    with pytest.raises(ps.SceneError, match=r"show.labels: are beside 1,001 particles; there may be up to 1,000"):
        scene([(0, 0, 2.0 * k) for k in range(1001)], [{"group": "balls"}])
