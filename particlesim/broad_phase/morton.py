"""Where an AABB belongs in the octree, as one number: its size class, then its octant level by level.

The octants are interleaved bits of the centre's coordinates: the code of G. M. Morton, "A Computer Oriented Geodetic
Data Base and a New Technique in File Sequencing", IBM, 1966.  Sorted by code, the AABBs of every node of the tree
are one range.
"""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase.aabb_statistics import wrapped_centre
from particlesim.broad_phase.aabb_test import Aabbs
from particlesim.core.jit import entry_kernel, kernel
from particlesim.core.math3d import to_vec3
from particlesim.core.parallel import ThreadTeam

# Levels of octants in a code, three bits each; three bits for the size class stand above them.
LEVELS = 20
CLASS_SHIFT = 3 * LEVELS
CODE_BITS = CLASS_SHIFT + 3

# Classes of AABBs by their longest edge: the largest and those down to a quarter of it, down to a sixteenth, ...
# A large one among small ones would stretch its leaf over many others; in a tree of its own size it does not.
CLASS_RATIO = 4.0
_LAST_CLASS = 7


@kernel
def _spread(number):
    """Bits of a 20-bit number moved to every third place."""
    number = (number | number << 32) & 0x1F00000000FFFF
    number = (number | number << 16) & 0x1F0000FF0000FF
    number = (number | number << 8) & 0x100F00F00F00F00F
    number = (number | number << 4) & 0x10C30C30C30C30C3
    return (number | number << 2) & 0x1249249249249249


@kernel
def octants(x, y, z):
    """Code of a point in the unit cube; a point outside is taken as the nearest inside."""
    last = 2.0**LEVELS - 1.0
    return (
        _spread(int(min(max(x * 2.0**LEVELS, 0.0), last)))
        | _spread(int(min(max(y * 2.0**LEVELS, 0.0), last))) << 1
        | _spread(int(min(max(z * 2.0**LEVELS, 0.0), last))) << 2
    )


@kernel
def _size_class(width, widest):
    """0 for the largest AABBs, 7 for all that are at most 4**-7 of the widest."""
    found = 0
    bound = widest / CLASS_RATIO
    for _ in range(_LAST_CLASS):
        found += int(width <= bound)
        bound /= CLASS_RATIO
    return found


@entry_kernel
def _fill_codes(first, last, aabbs, statistics, codes):
    """Codes of AABBs ``first .. last`` in the root cube, which is as wide as the region of most centres."""
    lower, upper, period = aabbs
    scale, longest = statistics[0].scale, statistics[0].longest
    period_x, period_y, period_z = to_vec3(period)
    origin_x, origin_y, origin_z = to_vec3(statistics[0].region_lower)
    for index in range(first, last):
        a, b, c = lower[index, 0], lower[index, 1], lower[index, 2]
        d, e, f = upper[index, 0], upper[index, 1], upper[index, 2]
        code = octants(
            (wrapped_centre(a, d, period_x) - origin_x) * scale,
            (wrapped_centre(b, e, period_y) - origin_y) * scale,
            (wrapped_centre(c, f, period_z) - origin_z) * scale,
        )
        codes[index] = _size_class(max(d - a, e - b, f - c), longest) << CLASS_SHIFT | code


def codes_of(aabbs: Aabbs, statistics: np.ndarray, team: ThreadTeam) -> np.ndarray:
    """Codes (n,) int64 of all AABBs, with their ``aabb_statistics``."""
    codes = np.empty(len(aabbs.lower), dtype=np.int64)
    team.each(lambda _, first, last: _fill_codes(first, last, aabbs, statistics, codes), len(codes))
    return codes


@entry_kernel
def fill_octants(points, lower, inverse, codes):
    """Codes of ``points`` (n, 3) in a cuboid at ``lower`` (3,) of edges 1 / ``inverse`` (3,)."""
    for index in range(points.shape[0]):
        codes[index] = octants(
            (points[index, 0] - lower[0]) * inverse[0],
            (points[index, 1] - lower[1]) * inverse[1],
            (points[index, 2] - lower[2]) * inverse[2],
        )
