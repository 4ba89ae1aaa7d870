"""Broken scenes, and the line that each gets."""
# ruff: noqa: E501  (the expected lines stand here whole)

from tests.scene_texts import (
    ALL_KEYS,
    BOUNDARY,
    COLOUR,
    COUNT,
    FIELD,
    GOOD,
    GROUP,
    KEPT,
    NARROW,
    PIXELS,
    RANGE,
    ROUND,
    ROWS,
    SIZE,
    TURN,
    TWO,
    VECTOR,
    WORLD,
    contact,
    contact_table,
    group,
    path_of,
    poses,
    world,
)

BROKEN = [
    (WORLD, "there must be [[particles]] or [[emitters]]"),
    ("", "the file is empty"),
    ("[world\n", "not valid TOML: Expected ']' at the end of a table declaration (at line 1, column 7)"),
    ("a = " + "[" * 5000, "not valid TOML: brackets within brackets without end"),
    # Keys.
    ("duratoin = 3\n" + GOOD, "duratoin = 3: unknown key; did you mean 'duration'?"),
    ("zzz = 3\n" + GOOD, f"zzz = 3: unknown key; allowed: {ALL_KEYS}"),
    ('"a b\\n" = 3\n' + GOOD, f"'a b\\n' = 3: unknown key; allowed: {ALL_KEYS}"),
    (world(gravty="[0, 0, 1]"), "world.gravty = [0, 0, 1]: unknown key; did you mean 'gravity'?"),
    (group(colr='"red"'), "particles[0].colr = \"red\": unknown key; did you mean 'colour'?"),
    (
        group(placement='{ kind = "lattice", spacng = 0.3 }'),
        "particles[0].placement.spacng = 0.3: unknown key; did you mean 'spacing'?",
    ),
    (
        group(placement='{ kind = "random", region = { lower = [0, 0, 0], uper = [1, 1, 1] } }'),
        "particles[0].placement.region.uper = [1, 1, 1]: unknown key; did you mean 'upper'?",
    ),
    (
        poses("{ postion = [0, 0, 0] }"),
        "particles[0].placement.poses[0].postion = [0, 0, 0]: unknown key; did you mean 'position'?",
    ),
    (
        group(orientation="{ axis = [0, 0, 1], angel = 3 }"),
        "particles[0].orientation.angel = 3: unknown key; did you mean 'angle'?",
    ),
    (
        GOOD + "[movie]\nframerate = 3\n",
        "movie.framerate = 3: unknown key; allowed: fps, speed, quality, resolution, background, crf, fade, shutter, sub_frames",
    ),
    (GROUP, "the key 'world' is missing"),
    (group(shape=None), "particles[0]: the key 'shape' is missing"),
    (group(count=None), "particles[0]: the key 'count' is missing"),
    (group(shape='"box"'), "particles[0].shape = \"box\": the key 'edges' is missing"),
    (group(shape='"capsule"'), "particles[0].shape = \"capsule\": the key 'length' is missing"),
    (
        group(shape='{ kind = "capsule", length = 0 }'),
        "particles[0].shape.length = 0: must be a number above 0",
    ),
    (
        group(shape='{ kind = "cube", rounding = -0.1 }'),
        "particles[0].shape.rounding = -0.1: must be a number of 0 or more",
    ),
    (
        group(shape='{ kind = "pyramid", rounding = true }'),
        "particles[0].shape.rounding = true: must be a number of 0 or more",
    ),
    (
        group(shape='{ kind = "sphere", rounding = 0.1 }'),
        "particles[0].shape.rounding = 0.1: unknown key; allowed: kind",
    ),
    (
        group(shape='{ kind = "capsule", rounding = 0.1, length = 1 }'),
        "particles[0].shape.rounding = 0.1: unknown key; allowed: kind, length",
    ),
    (WORLD + GROUP.replace("particles", "particle"), "particle: unknown key; did you mean 'particles'?"),
    (
        WORLD + GROUP.replace("[[particles]]", "[particles]"),
        "particles: must be a list of tables: write [[particles]], in two pairs of brackets",
    ),
    ("particles = [1]\n" + WORLD, "particles[0] = 1: must be a table"),
    ("particles = []\n" + WORLD, "there must be [[particles]] or [[emitters]]"),
    ("[[world]]\nsize = [4, 4, 4]\n" + GROUP, "world: must be a table: write [world], in one pair of brackets"),
    ("solver = 3\n" + GOOD, "solver = 3: must be a table"),
    # Kinds.
    (group(shape='"sphare"'), "particles[0].shape = \"sphare\": unknown kind; did you mean 'sphere'?"),
    (group(shape='{ kind = "cubee" }'), "particles[0].shape.kind = \"cubee\": unknown kind; did you mean 'cube'?"),
    (
        group(shape="{ edges = [1, 2, 3] }"),
        "particles[0].shape: the key 'kind' is missing; "
        "allowed: 'sphere', 'capsule', 'cylinder', 'cone', 'cube', 'tetrahedron', 'box', 'pyramid', 'mesh' or 'compound'",
    ),
    (
        group(shape="3"),
        'particles[0].shape = 3: must be a shape such as "sphere", or a table such as { kind = "box", edges = [1, 2, 3] }',
    ),
    (GOOD + '[camera]\nkind = "orbital"\n', "camera.kind = \"orbital\": unknown kind; did you mean 'orbit'?"),
    (
        GOOD + '[solver]\nbroad_phase = "octre"\n',
        "solver.broad_phase = \"octre\": unknown kind; did you mean 'octree'?",
    ),
    (
        GOOD + "[solver]\nbroad_phase = 3\n",
        'solver.broad_phase = 3: must be "octree", "grid", "naive", or a table such as { kind = "grid", cells = 32 }',
    ),
    # Numbers.
    (group(count='"100"'), f'particles[0].count = "100": {COUNT}'),
    (group(count="true"), f"particles[0].count = true: {COUNT}"),
    (group(count="2.5"), f"particles[0].count = 2.5: {COUNT}"),
    (group(count="-1"), f"particles[0].count = -1: {COUNT}"),
    (group(count="1e9"), f"particles[0].count = 1000000000.0: {COUNT}"),
    (group(size="nan"), "particles[0].size = nan: must be a number above 0"),
    (group(size="-0.2"), "particles[0].size = -0.2: must be a number above 0"),
    (group(size="1e-300"), "particles[0].size = 1e-300: must be a number above 0, between 1e-30 and 1e30 in size"),
    (group(size="true"), f"particles[0].size = true: {SIZE}"),
    (group(size='"0.2"'), f'particles[0].size = "0.2": {SIZE}'),
    (group(density="0"), "particles[0].density = 0: must be a number above 0"),
    (group(density="1", mass="2"), "particles[0]: give density or mass, not both"),
    (
        group(size='{ kind = "uniform", low = 2, high = 1 }'),
        "particles[0].size: low must not be above high, but 2 is above 1",
    ),
    (group(restitution="1.5"), "particles[0].restitution = 1.5: must be a number from 0 to 1"),
    # Surfaces.
    (group(friction="-0.1"), "particles[0].friction = -0.1: must be a number of 0 or more"),
    (world(friction="inf"), "world.friction = inf: must be a number of 0 or more"),
    (world(rolling_friction='"0.1"'), 'world.rolling_friction = "0.1": must be a number of 0 or more'),
    (
        group(tangential_restitution="-1.1"),
        "particles[0].tangential_restitution = -1.1: must be a number from -1 to 1",
    ),
    (
        group(friction="0.5", static_friction="0.3"),
        "particles[0]: static_friction is 0.3, but must not be below friction, 0.5",
    ),
    (
        world(friction="0.5", static_friction="0.3"),
        "world: static_friction is 0.3, but must not be below friction, 0.5",
    ),
    (group(name='"walls"'), 'particles[0].name = "walls": the walls have this name already'),
    (
        group(name='"a"') + GROUP + GROUP + 'name = "a"\n',
        'particles[2].name = "a": particles[0] has this name already',
    ),
    (contact(friction="0.5"), "contact[0]: the key 'between' is missing"),
    (contact(between='["a"]'), f'contact[0].between = ["a"]: {TWO}'),
    (contact(between='"a"'), f'contact[0].between = "a": {TWO}'),
    (
        contact(between='["a", "wall"]'),
        'contact[0].between = ["a", "wall"]: no group or obstacle has the name "wall"; did you mean \'walls\'?',
    ),
    (
        contact(between='["walls", "walls"]'),
        'contact[0].between = ["walls", "walls"]: walls and obstacles do not touch each other',
    ),
    (
        contact(between='["a", "b"]') + contact_table(between='["b", "a"]'),
        'contact[1].between = ["b", "a"]: contact[0] is between these two already',
    ),
    (contact(between='["a", "b"]', frction="0.5"), "contact[0].frction = 0.5: unknown key; did you mean 'friction'?"),
    (
        contact(between='["a", "b"]', friction="0.5", static_friction="0.3"),
        "contact[0]: static_friction is 0.3, but must not be below friction, 0.5",
    ),
    (GOOD + "[contact]\n", "contact: must be a list of tables: write [[contact]], in two pairs of brackets"),
    (world(boundary='"wal"'), f"world.boundary = \"wal\": {BOUNDARY}; did you mean 'wall'?"),
    (world(boundary='["wall", "open"]'), f'world.boundary = ["wall", "open"]: {BOUNDARY}, for x, y and z'),
    (world(size="[4.0, 4.0]"), "world.size = [4.0, 4.0]: must be a list of 3 numbers above 0, [x, y, z]"),
    (world(gravity="-9.81"), f"world.gravity = -9.81: {VECTOR}"),
    (world(gravity="[0, 0, inf]"), f"world.gravity = [0, 0, inf]: {VECTOR}"),
    (group(orientation="[0, 0, 0, 0]"), "particles[0].orientation = [0, 0, 0, 0]: must not be zero"),
    (group(orientation='"up"'), f"particles[0].orientation = \"up\": must be 'random', 'aligned', {TURN}"),
    (
        poses('{ position = [0, 0, 0], orientation = "random" }'),
        f'particles[0].placement.poses[0].orientation = "random": must be {TURN}',
    ),
    (
        group(orientation="{ axis = [0, 0, 0], angle = 3 }"),
        "particles[0].orientation.axis = [0, 0, 0]: must not be zero",
    ),
    (group(colour='"bleu"'), f"particles[0].colour = \"bleu\": {COLOUR}; did you mean 'blue'?"),
    ("duration = 0\n" + GOOD, "duration = 0: must be a number of seconds above 0, up to 1e9"),
    ("seed = -1\n" + GOOD, "seed = -1: must be a whole number from 0 to 2^63 - 1"),
    ("title = 3\n" + GOOD, "title = 3: must be text in quotes"),
    (GOOD + "[movie]\nfps = 0\n", "movie.fps = 0: must be a number of frames a second from 1 to 240"),
    (
        GOOD + "[movie]\nresolution = [1281, 720]\n",
        f"movie.resolution = [1281, 720]: {PIXELS}; the nearest are 1282 and 720",
    ),
    (
        GOOD + '[movie]\nquality = "hihg"\n',
        "movie.quality = \"hihg\": must be 'draft', 'normal', 'high' or 'best'; did you mean 'high'?",
    ),
    (GOOD + "[movie]\nquality = 1\n", "movie.quality = 1: must be 'draft', 'normal', 'high' or 'best'"),
    (GOOD + "[movie]\ncrf = 52\n", "movie.crf = 52: must be a whole number from 0 (lossless) to 51 (smallest)"),
    (GOOD + "[movie]\nspeed = 0\n", "movie.speed = 0: must be a number of seconds above 0"),
    (GOOD + "[movie]\nfade = -1\n", "movie.fade = -1: must be a number of seconds of 0 or more"),
    (GOOD + "[solver]\ntime_step = 0\n", "solver.time_step = 0: must be 'auto' or a number of seconds above 0"),
    (
        GOOD + '[solver]\ntime_step = "fast"\n',
        "solver.time_step = \"fast\": must be 'auto' or a number of seconds above 0",
    ),
    (
        GOOD + '[solver]\nbroad_phase = { kind = "grid", cells = 0 }\n',
        "solver.broad_phase.cells = 0: must be a whole number from 1 to 1024",
    ),
    (
        GOOD + '[solver]\nbroad_phase = { kind = "octree", max_depth = 99 }\n',
        "solver.broad_phase.max_depth = 99: must be a whole number from 1 to 20",
    ),
    (GOOD + '[camera]\nkind = "look-at"\nposition = [0, 0, 0]\n', "camera: position and target must differ"),
    (GOOD + '[camera]\nkind = "orbit"\nperiod = 0\n', "camera.period = 0: must be a number of seconds, not 0"),
    (
        GOOD + '[camera]\nkind = "fixed"\nsubject = "wold"\n',
        "camera.subject = \"wold\": must be 'auto', 'world' or 'particles'; did you mean 'world'?",
    ),
    (GOOD + '[camera]\nkind = "orbit"\nzoom = 0\n', "camera.zoom = 0: must be a number above 0"),
    (GOOD + '[camera]\nkind = "fixed"\nzoom = 2\ndistance = 3\n', "camera: give zoom or distance, not both"),
    (GOOD + '[camera]\nkind = "path"\n', "camera: the key 'keys' is missing"),
    (GOOD + '[camera]\nkind = "path"\nkeys = []\n', "camera.keys = []: must not be empty"),
    (path_of("{ time = 0 }"), "camera.keys[0]: the key 'position' is missing"),
    (
        path_of("{ time = 0, positoin = [1, 2, 3] }"),
        "camera.keys[0].positoin = [1, 2, 3]: unknown key; did you mean 'position'?",
    ),
    (path_of("{ time = 0, position = [0, 0, 0] }"), "camera.keys[0]: position and target must differ"),
    (
        path_of("{ time = 1, position = [1, 0, 0] }", "{ time = 1, position = [1, 0, 0] }"),
        "camera.keys: times must grow from key to key, but 1 follows 1",
    ),
    (GOOD + "[trajectory]\nevery = 0\n", "trajectory.every = 0: must be a whole number from 1 to 1,000,000"),
    (GOOD + "[trajectory]\nfields = []\n", f"trajectory.fields = []: {KEPT}"),
    (GOOD + '[trajectory]\nfields = "all"\n', f'trajectory.fields = "all": {KEPT}'),
    (
        GOOD + '[trajectory]\nfields = ["position", "velocty"]\n',
        f'trajectory.fields = ["position", "velocty"]: {KEPT}; did you mean \'velocity\'?',
    ),
    (
        GOOD + '[trajectory]\nprecision = "half"\n',
        "trajectory.precision = \"half\": must be 'single' or 'double'",
    ),
    (GOOD + "[show]\nreadout = 1\n", f"show.readout = 1: {ROWS}"),
    (
        GOOD + '[show]\nreadout = ["time", "time"]\n',
        'show.readout = ["time", "time"]: must have each row once, but has \'time\' 2 times',
    ),
    (
        GOOD + '[camera]\nkind = "path"\nkeys = [{ time = -5, position = [1, 2, 3] }]\n',
        "camera.keys[0].time = -5: must be a number of seconds of 0 or more",
    ),
    (
        "duration = 1e9\n" + GOOD + "[movie]\nfps = 240\n",
        "duration = 1e+09 s at 240 frames a second of the scene makes 240,000,000,001 frames; "
        "there may be up to 100,000,000",
    ),
    (GOOD + '[show]\nreadout = ["tme"]\n', f"show.readout = [\"tme\"]: {ROWS}; did you mean 'time'?"),
    (GOOD + '[show]\nlegend = "on"\n', 'show.legend = "on": must be true or false'),
    (group(colour='{ field = "speed", range = [1, 1] }'), f"particles[0].colour.range = [1, 1]: {RANGE}"),
    (group(colour='{ field = "speed", range = 3 }'), f"particles[0].colour.range = 3: {RANGE}"),
    (group(colour="{ range = [0, 1] }"), "particles[0].colour: the key 'field' is missing"),
    (group(colour='{ field = "sped" }'), f"particles[0].colour.field = \"sped\": {FIELD}; did you mean 'speed'?"),
    (
        group(colour='{ field = "speed", scale = 3 }'),
        "particles[0].colour.scale = 3: unknown key; allowed: field, map, range",
    ),
    (
        group(colour='"by_size"') + GROUP + 'colour = { field = "size", range = [0, 2] }\n',
        "particles[1].colour has another scale of size than a group before it",
    ),
    (GOOD + "[show]\nbox = 1\n", "show.box = 1: must be true or false"),
    # What fits.
    (
        group(count="3", placement='{ kind = "list", poses = [{ position = [0, 0, 0] }] }'),
        "particles[0]: count is 3, but there are 1 in poses",
    ),
    (
        group(placement='{ kind = "cluster", spread = 1, clusters = 2, centres = [[0, 0, 0]] }'),
        "particles[0].placement: clusters is 2, but there are 1 in centres",
    ),
    (
        poses("{ position = [0, 0, 0] }", "{ position = [0.1, 0, 0] }"),
        "particles[0].placement.poses[0].position = [0.0, 0.0, 0.0]: starts 0.1 m inside particle 1 of particles[0]",
    ),
    (
        poses("{ position = [0, 0, 0] }", "{ position = [1.95, 0, 0] }"),
        "particles[0].placement.poses[1].position = [1.95, 0.0, 0.0]: sticks 0.05 m through the +x wall",
    ),
    (
        group(placement='"lattice"') + GROUP + 'placement = "lattice"\n',
        "particles[0].placement: particle 0 starts 0.2 m inside particle 0 of particles[1]",
    ),
    (
        group(count="1000", size="0.9"),
        "particles: do not fit: their volumes add up to 5.96 times the world's",
    ),
    (group(count="90_000_000_000", size="1e-9"), f"particles[0].count = 90000000000: {COUNT}"),
    (
        group(count="1000", placement='{ kind = "cluster", spread = 0.05, centres = [[0, 0, 0]] }'),
        "particles[0].count = 1000: no room for 990 of them in clusters, which are filled to about 0.3: fewer or smaller particles, a wider spread",
    ),
    (
        group(placement='{ kind = "cluster", spread = 1, centres = [[9, 0, 0]] }'),
        "particles[0].placement.centres[0] = [9.0, 0.0, 0.0]: lies outside of where its particles may be",
    ),
    (group(size="5"), "particles[0].size = 5.0: too large: particles are 5 m thick, between walls 4 m apart"),
    (
        group(placement='{ kind = "random", region = { lower = [0, 0, 0], upper = [0.1, 1, 1] } }'),
        "particles[0].size: too large: there are particles wider than the region they are placed in",
    ),
    (
        group(placement='{ kind = "lattice", spacing = 0.1 }'),
        "particles[0].placement.spacing = 0.1: too tight: the particles span 0.2 m",
    ),
    (
        group(placement='{ kind = "lattice", spacing = 3 }'),
        "particles[0].placement.spacing = 3.0: makes a lattice of 1 points here, for 10 particles",
    ),
    (
        group(count="10000", placement='"lattice"'),
        "particles[0].count = 10000: a lattice of so many points has a spacing of 0.1818 m, but the particles span 0.2 m",
    ),
    (
        group(placement='{ kind = "row", through = [[0, 0, 0]] }'),
        "particles[0].placement.through = [[0, 0, 0]]: must be 2 points or more",
    ),
    (
        group(placement='{ kind = "row", through = [[0, 0, 0], [1, 0, 0], [1, 0, 0]] }'),
        "particles[0].placement.through = [[0, 0, 0], [1, 0, 0], [1, 0, 0]]: point 2 is the same as the one before",
    ),
    (
        group(placement='{ kind = "row", through = [[0, 0, 0], [1, 0, 0]] }'),
        "particles[0].placement: particle 0 starts 0.0889 m inside particle 1 of particles[0]",
    ),
    # Ellipsoids.
    (
        group(placement=f'{{ kind = "random", region = {{ {NARROW}, form = "round" }} }}'),
        "particles[0].placement.region.form = \"round\": must be 'box' or 'ellipsoid'",
    ),
    (
        group(placement=f'{{ kind = "random", region = {{ {NARROW}, form = "ellipsoid" }} }}'),
        "particles[0].size: too large: there are particles wider than the region they are placed in",
    ),
    (
        group(count="1000", placement=f'{{ kind = "lattice", region = {{ {NARROW}, form = "ellipsoid" }} }}'),
        "particles[0].count = 1000: a lattice of so many points has a spacing of 0.03741 m, "
        "but the particles span 0.2 m",
    ),
    (
        group(placement=f'{{ kind = "lattice", spacing = 0.9, region = {{ {ROUND} }} }}'),
        "particles[0].placement.spacing = 0.9: makes a lattice of 1 points here, for 10 particles",
    ),
    (
        group(count="90", placement=f'{{ kind = "random", region = {{ {ROUND} }} }}'),
        "particles[0].count = 90: no room for all of them at random: they would fill 0.72 of their room, "
        "where 0.5 is reached: fewer or smaller particles, or more room",
    ),
    (
        group(placement=f'{{ kind = "cluster", spread = 1, centres = [[0.4, 0.4, 0.4]], region = {{ {ROUND} }} }}'),
        "particles[0].placement.centres[0] = [0.4, 0.4, 0.4]: lies outside of where its particles may be",
    ),
    (
        world(size="[0.3, 4, 4]", boundary='"periodic"'),
        "particles[0].size = 0.2: too large: particles span 0.2 m; "
        "in a periodic world they must span less than half of it, 0.15 m",
    ),
    (
        group(shape='{ kind = "box", edges = [1, 1, 1e-9] }'),
        "particles[0].shape: the vertices of 'box' enclose no volume",
    ),
]
