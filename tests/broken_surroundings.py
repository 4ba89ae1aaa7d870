"""Broken emitters, sinks, fields and obstacles, and the line that each gets."""

from tests.scene_texts import BALL_IN, GOOD, LID, VECTOR, emitter, moving, obstacle, world

BROKEN_SURROUNDINGS = [
    (emitter(rate=None), "emitters[0]: the key 'rate' is missing"),
    (emitter(rate="0"), "emitters[0].rate = 0: must be a number above 0"),
    (emitter(count=None), "emitters[0]: the key 'count' is missing"),
    (emitter(region=None), "emitters[0]: the key 'region' is missing"),
    (emitter(placement='"lattice"'), "emitters[0]: an emitter has a region in place of a placement"),
    (emitter(size="0.6"), "emitters[0].size: too large: there are particles wider than the region they are placed in"),
    (emitter(LID), "emitters[0].region: is inside an obstacle or a wall: its particles find no room"),
    (
        emitter(velocity='{ kind = "outward", speed = 1 }'),
        "emitters[0]: velocity must be another than outward and inward, which are those of a start",
    ),
    (
        GOOD + "[[sinks]]\nregion = { lower = [0, 0, 0], upper = [1, 0, 1] }\n",
        "sinks[0].region: every coordinate of lower must be below that of upper",
    ),
    (GOOD + "[[sinks]]\nrate = 1\n", "sinks[0].rate = 1: unknown key; allowed: name, region"),
    (GOOD + '[[fields]]\nkind = "centre"\n', "fields[0].kind = \"centre\": unknown kind; did you mean 'central'?"),
    (GOOD + '[[fields]]\nkind = "drag"\n', "fields[0]: the key 'coefficient' is missing"),
    (
        GOOD + '[[fields]]\nkind = "drag"\ncoefficient = 0\n',
        "fields[0].coefficient = 0: must be a number above 0",
    ),
    (obstacle('"plan"'), "obstacles[0].shape = \"plan\": unknown kind; did you mean 'plane'?"),
    (
        obstacle('{ kind = "plane", normal = [0, 0, 0] }'),
        "obstacles[0].shape.normal = [0, 0, 0]: must not be zero",
    ),
    (
        world(boundary='"periodic"') + '[[obstacles]]\nshape = "cube"\nsize = 1.5\n',
        "obstacles[0].size = 1.5: too large: it spans 2.598 m; in a periodic world it must span less than half of it",
    ),
    (
        world(boundary='["wall", "periodic", "wall"]')
        + '[[obstacles]]\nshape = { kind = "plane", normal = [0, 1, 1] }\n',
        "obstacles[0].shape.normal = [0.0, 1.0, 1.0]: must be at right angles to the periodic axes",
    ),
    (obstacle(opacity="2"), "obstacles[0].opacity = 2: must be a number from 0 to 1"),
    (obstacle(name='"walls"'), 'obstacles[0].name = "walls": the walls have this name already'),
    (obstacle(friction="-1"), "obstacles[0].friction = -1: must be a number of 0 or more"),
    (obstacle('{ kind = "mesh", file = "no.stl" }'), 'obstacles[0].shape.file = "no.stl": no such file'),
    (obstacle(surface_velocity="1"), f"obstacles[0].surface_velocity = 1: {VECTOR}"),
    (moving(kind='"spinn"', rate=1), "obstacles[0].motion.kind = \"spinn\": unknown kind; did you mean 'spin'?"),
    (moving(kind='"spin"', rate=1, axis="[0, 0, 0]"), "obstacles[0].motion.axis = [0, 0, 0]: must not be zero"),
    (moving(kind='"vibrate"', amplitude=1), "obstacles[0].motion: the key 'frequency' is missing"),
    (moving(kind='"keys"', keys="[]"), "obstacles[0].motion.keys = []: must not be empty"),
    (
        moving(kind='"keys"', keys="[{ time = 1 }, { time = 1 }]"),
        "obstacles[0].motion.keys: times must grow from key to key, but 1 follows 1",
    ),
    (
        moving(kind='"translate"', velocity="[1, 0, 0]", frm=3),
        "obstacles[0].motion.frm = 3: unknown key; did you mean 'from'?",
    ),
    (
        moving(kind='"translate"', velocity="[1, 0, 0]", **{"from": 3, "until": 2}),
        "obstacles[0].motion: until must be after from, but 2 is not after 3",
    ),
    (
        BALL_IN,
        "particles[0].placement.poses[0].position = [0.3, 0.0, 0.0]: starts 0.05 m inside obstacles[0]",
    ),
    (
        BALL_IN + 'name = "post"\n',
        "particles[0].placement.poses[0].position = [0.3, 0.0, 0.0]: starts 0.05 m inside obstacles[0] (post)",
    ),
]
