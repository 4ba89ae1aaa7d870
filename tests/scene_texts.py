"""Texts of scene files, right and wrong, and what is said of the wrong ones."""
# ruff: noqa: E501  (the expected lines stand here whole)

WORLD = "[world]\nsize = [4.0, 4.0, 4.0]\n"
GROUP = '[[particles]]\nshape = "sphere"\ncount = 10\nsize = 0.2\n'
GOOD = WORLD + GROUP
ALL_KEYS = (
    "title, seed, duration, world, particles, emitters, sinks, obstacles, fields, contact, solver, trajectory, movie, "
    "camera, show"
)
VECTOR = "must be a list of 3 finite numbers, [x, y, z]"
COUNT = "must be a whole number from 0 to 100,000,000"
SIZE = 'must be a number above 0, or a table such as { kind = "uniform", low = 0.1, high = 0.2 }'
BOUNDARY = "must be 'wall', 'periodic' or 'open', or a list of 3 of them"
TURN = "[w, x, y, z] (a quaternion), or { axis = [x, y, z], angle = degrees }"
COLOUR = "must be 'by_shape', 'by_group', 'by_speed', 'by_height', 'by_size', 'by_impacts', a colour name such as 'steelblue', or '#rrggbb'"
KEPT = (
    "must be a list of 'position', 'orientation', 'velocity', 'angular_momentum', 'image' or 'impacts', "
    "'position' among them"
)
ROWS = (
    "must be true, false or a list of 'time', 'particles', 'impacts', 'energy change', 'dissipation', 'temperature', 'pressure', "
    "'speed', 'pairs tested' or 'broad phases'"
)
TWO = "must be the names of two groups, or of one and an obstacle or 'walls', such as ['a', 'b']"
FIELD = "must be 'speed', 'height', 'size' or 'impacts'"
RANGE = "must be [low, high], two numbers, low below high"
PIXELS = "must be [width, height] in pixels, two even whole numbers from 64 to 7680"


def world(**keys):
    """A scene whose world has these keys instead of the usual ones."""
    return "[world]\n" + _lines({"size": "[4.0, 4.0, 4.0]", **keys}) + GROUP


def group(**keys):
    """A scene whose group has these keys instead of the usual ones; None takes one away."""
    return WORLD + "[[particles]]\n" + _lines({"shape": '"sphere"', "count": "10", "size": "0.2", **keys})


def contact(**keys):
    """A scene of the groups a and b whose first contact has these keys."""
    return group(name='"a"') + GROUP + 'name = "b"\n' + contact_table(**keys)


def contact_table(**keys):
    return "[[contact]]\n" + _lines(keys)


def poses(*listed):
    return group(count=None, placement=f'{{ kind = "list", poses = [{", ".join(listed)}] }}')


def _lines(keys):
    return "".join(f"{key} = {value}\n" for key, value in keys.items() if value is not None)


def path_of(*keys):
    return GOOD + f'[camera]\nkind = "path"\nkeys = [{", ".join(keys)}]\n'


def obstacle(shape='"cube"', **keys):
    """A scene with an obstacle."""
    return GOOD + "[[obstacles]]\n" + _lines({"shape": shape, **keys})


def moving(**keys):
    """A scene with a cube that moves."""
    return obstacle(motion="{ " + ", ".join(f"{key} = {value}" for key, value in keys.items()) + " }")


def emitter(more="", **keys):
    """A scene with an emitter."""
    usual = {"shape": '"sphere"', "count": "5", "size": "0.2", "rate": "10", "region": f"{{ {UP} }}"}
    return GOOD + "[[emitters]]\n" + _lines({**usual, **keys}) + more


UP = "lower = [-1, -1, 1], upper = [1, 1, 1.5]"
LID = '[[obstacles]]\nshape = { kind = "box", edges = [3, 3, 1] }\nposition = [0, 0, 1.3]\n'
BALL_IN = poses("{ position = [0.3, 0, 0] }") + '[[obstacles]]\nshape = "cube"\nsize = 0.5\n'
NARROW = "lower = [0, 0, 0], upper = [0.1, 1, 1]"
ROUND = 'lower = [-0.5, -0.5, -0.5], upper = [0.5, 0.5, 0.5], form = "ellipsoid"'
