"""What stands by friction: arches, houses of cards and walls of bricks; and when they do, by statics."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy.optimize import brentq, linprog

from particlesim.scene import Scene
from tests.worlds import listed, scene

GRAVITY = (0.0, 0.0, -9.81)

# A playing card [m]: width, thickness, length.
CARD = 0.063, 0.0003, 0.088

# A brick [m], that of the British Standard with its joint.
BRICK = 0.225, 0.1125, 0.075


def wall_of_bricks(rows: int = 8, bricks: int = 6) -> Scene:
    """A wall in stretcher bond, dry, with half bricks at the ends of every second row."""
    length, depth, height = BRICK
    whole: list[dict[str, Any]] = []
    half: list[dict[str, Any]] = []
    for row in range(rows):
        z, short = -1.0 + height * (row + 0.5), row % 2
        middle = 0.5 * (bricks - short - 1)
        whole += [{"position": (length * (k - middle), 0.0, z)} for k in range(bricks - short)]
        half += [{"position": (side * length * (0.5 * bricks - 0.25), 0.0, z)} for side in (-1, 1) if short]
    return scene(
        listed({"kind": "box", "edges": BRICK}, *whole),
        listed({"kind": "box", "edges": (0.5 * length, depth, height)}, *half),
        size=(4.0, 4.0, 2.0),
        gravity=GRAVITY,
        restitution=0.0,
        friction=0.6,
    )


# ---- arches --------------------------------------------------------------------------------------------------------


def arch(folder: Path, thickness: float, friction: float = 0.6, stones: int = 15) -> Scene:
    """A semicircular arch of wedges, of middle radius 1 m; ``thickness`` in metres. Its mesh is left in the folder."""
    half = 0.5 * math.pi / stones
    corners = [
        (r * side * math.sin(half), y, r * math.cos(half))
        for r in (1.0 - 0.5 * thickness, 1.0 + 0.5 * thickness)
        for side in (-1, 1)
        for y in (-0.15, 0.15)
    ]
    mesh = trimesh.convex.convex_hull(np.array(corners))
    path = folder / "voussoir.ply"
    mesh.export(path)
    # What rounding of the file's numbers might put into each other is this part of the radius away.
    out = (1.0 + 1e-6) * float(mesh.center_mass[2])
    angles = half * (2.0 * np.arange(stones) + 1.0) - 0.5 * math.pi
    poses = [
        {
            "position": (out * math.sin(a), 0.0, -2.0 + 1e-7 + out * math.cos(a)),
            "orientation": {"axis": (0, 1, 0), "angle": math.degrees(a)},
        }
        for a in angles.tolist()
    ]
    stone = listed({"kind": "mesh", "file": path}, *poses, density=2000.0)
    return scene(stone, size=(4.0, 4.0, 4.0), gravity=GRAVITY, restitution=0.0, friction=friction)


def least_thickness(friction: float = 0.6, stones: int = 15) -> float:
    """How thick an arch must be to stand [radii]: forces in its joints that hold it exist from there on.

    That is the safe theorem of limit analysis (J. Heyman, The Stone Skeleton, Int. J. Solids Struct. 2 (1966) 249); of
    infinitely many stones it would be 0.1075 (M. Milankovitch, Z. Math. Phys. 55 (1907) 1).
    """
    return brentq(lambda t: _spare_weight(t, friction, stones), 0.02, 0.3, xtol=1e-6)


def _spare_weight(thickness: float, friction: float, stones: int) -> float:
    """The largest force x such that all joints of an arch push with x or more at their inner and outer edges.

    Below 0 some would have to pull. Stones weigh 1; friction is within its cone in each joint.
    """
    inner, outer = 1.0 - 0.5 * thickness, 1.0 + 0.5 * thickness
    angle = math.pi / stones
    centroid = 4.0 * math.sin(0.5 * angle) / (3.0 * angle) * (outer**3 - inner**3) / (outer**2 - inner**2)
    joints = angle * np.arange(stones + 1) - 0.5 * math.pi  # from the vertical
    equilibrium, weights = np.zeros((3 * stones, 3 * (stones + 1) + 1)), np.zeros(3 * stones)
    for k in range(stones):
        for joint, sign in ((k, 1.0), (k + 1, -1.0)):
            along = np.array([math.sin(joints[joint]), math.cos(joints[joint])])  # outwards
            normal = sign * np.array([along[1], -along[0]])  # into stone k
            for column, point, force in ((0, inner, normal), (1, outer, normal), (2, 1.0, sign * along)):
                at = point * along
                moment = at[0] * force[1] - at[1] * force[0]
                equilibrium[3 * k : 3 * k + 3, 3 * joint + column] = (*force, moment)
        middle = centroid * math.sin(0.5 * (joints[k] + joints[k + 1]))
        weights[3 * k : 3 * k + 3] = (0.0, 1.0, middle)
    bounds = np.zeros((4 * (stones + 1), 3 * (stones + 1) + 1))
    for j in range(stones + 1):
        pushes, slides = slice(3 * j, 3 * j + 2), 3 * j + 2
        bounds[4 * j, 3 * j], bounds[4 * j + 1, 3 * j + 1] = -1.0, -1.0
        bounds[4 * j : 4 * j + 2, -1] = 1.0
        bounds[4 * j + 2 : 4 * j + 4, pushes] = -friction
        bounds[4 * j + 2 : 4 * j + 4, slides] = (1.0, -1.0)
    best = linprog(
        [*[0.0] * (3 * (stones + 1)), -1.0],
        A_ub=bounds,
        b_ub=np.zeros(len(bounds)),
        A_eq=equilibrium,
        b_eq=weights,
        bounds=[(None, None)] * (3 * (stones + 1) + 1),
    )
    return float(best.x[-1])


# ---- cards ---------------------------------------------------------------------------------------------------------


def house_of_cards(floors: int, friction: float, lean: float = math.radians(20.0)) -> Scene:
    """Pairs of cards that lean on each other, ``lean`` [rad] from upright, with level cards between their floors."""
    _, thickness, length = CARD
    # The upper edges of a pair are exactly on each other: of their fan of normals the one in the middle is level.
    reach = 0.5 * (length * math.sin(lean) + thickness * math.cos(lean))
    rise = 0.5 * (length * math.cos(lean) + thickness * math.sin(lean))
    apart = 4.0 * reach + 0.002
    poses, floor = [], -0.5
    for level in range(floors):
        pairs = floors - level
        for k in range(pairs):
            y = apart * (k - 0.5 * (pairs - 1))
            poses += [_turned((0.0, y - side * reach, floor + rise), -side * math.degrees(lean)) for side in (-1, 1)]
        floor += 2.0 * rise
        for k in range(pairs - 1):
            poses.append(_turned((0.0, apart * (k - 0.5 * (pairs - 2)), floor + 0.5 * thickness), 90.0))
        floor += thickness
    cards = listed({"kind": "box", "edges": CARD}, *poses, density=700.0)
    return scene(cards, size=(1.0, 1.0, 1.0), gravity=GRAVITY, restitution=0.0, friction=friction)


def _turned(position: tuple[float, float, float], degrees: float) -> dict[str, Any]:
    return {"position": position, "orientation": {"axis": (1, 0, 0), "angle": degrees}}


def least_friction_of_cards(lean: float = math.radians(20.0)) -> float:
    """What a pair of cards needs to stand: moments about its foot; a card's middle is half its thickness behind."""
    _, thickness, length = CARD
    return 0.5 * (math.tan(lean) - thickness / length)
