"""The house rules that can be read off the sources: imports go down only, rooms stay small, kernels are kernels."""

import ast
import functools
from pathlib import Path

import pytest

import particlesim

PACKAGE = Path(particlesim.__file__).parent
FLOORS = [
    ["core"],
    ["scene"],
    ["geometry"],
    ["broad_phase"],
    ["model"],
    ["setup"],
    ["dynamics"],
    ["trajectory"],
    ["simulation"],
    ["rendering"],
    ["benchmarks"],
    ["jobs"],
    ["cli"],
    ["__main__", "__init__"],
]
FLOOR = {name: level for level, names in enumerate(FLOORS) for name in names}
SOURCES = sorted(PACKAGE.rglob("*.py"))
TESTS = sorted(Path(__file__).parent.glob("*.py"))


def room(path):
    """The module or package directly under particlesim that a source belongs to."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return parts[0]


def imported_rooms(path):
    """Rooms of particlesim that a source imports, those for type checkers apart."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for_types = {
        id(node)
        for test in ast.walk(tree)
        if isinstance(test, ast.If) and isinstance(test.test, ast.Name) and test.test.id == "TYPE_CHECKING"
        for node in ast.walk(test)
    }
    for node in ast.walk(tree):
        if id(node) in for_types:
            continue
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "particlesim":
            parts = node.module.split(".")
            yield from [parts[1]] if len(parts) > 1 else [alias.name for alias in node.names]
        elif isinstance(node, ast.Import):
            yield from (a.name.split(".")[1] for a in node.names if a.name.startswith("particlesim."))


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_go_down_only(path):
    here = room(path)
    for other in imported_rooms(path):
        assert other == here or FLOOR[other] <= FLOOR[here], f"{path.name} imports {other} from above"
        if here == "rendering":
            assert other != "simulation", "a movie is drawn without simulating"


def test_rooms_of_one_floor_do_not_import_in_circles():
    graph = {name: set() for name in FLOOR}
    for path in SOURCES:
        graph[room(path)] |= {other for other in imported_rooms(path) if other != room(path)}
    done: set[str] = set()
    while len(done) < len(graph):
        free = {name for name in graph if name not in done and graph[name] <= done}
        assert free, f"a circle among {sorted(set(graph) - done)}"
        done |= free


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_every_module_says_what_it_is_and_is_a_room_one_can_know(path):
    text = path.read_text(encoding="utf-8")
    assert ast.get_docstring(ast.parse(text)), "no docstring"
    assert len(text.splitlines()) <= 400


def decorated(function):
    """The names of a function's decorators."""
    return {ast.unparse(d).split("(")[0] for d in function.decorator_list}


def kernels_of(tree):
    """The kernels that a source defines."""
    return [
        node for node in tree.body if isinstance(node, ast.FunctionDef) and decorated(node) & {"kernel", "entry_kernel"}
    ]


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_kernels_take_at_most_eight_parameters(path):
    for kernel in kernels_of(ast.parse(path.read_text(encoding="utf-8"))):
        assert len(kernel.args.args) <= 8, kernel.name


def module_of(path):
    """The dotted name of a source of the package, or of a test."""
    if not path.is_relative_to(PACKAGE):
        return f"tests.{path.stem}"
    return ".".join(["particlesim", *path.relative_to(PACKAGE).with_suffix("").parts]).removesuffix(".__init__")


@functools.cache
def inner_kernels():
    """(module, name) of all kernels without a Python wrapper: calling one from Python crashes."""
    return {
        (module_of(path), kernel.name)
        for path in [*SOURCES, *TESTS]
        for kernel in kernels_of(ast.parse(path.read_text(encoding="utf-8")))
        if "kernel" in decorated(kernel)
    }


def called_from_python(tree, module):
    """(module, name) of all that code outside kernels calls by name."""
    homes = {
        alias.asname or alias.name: (node.module, alias.name)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }
    waiting, found = [tree], set()
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef) and decorated(node) & {"kernel", "entry_kernel"}:
            continue
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            found.add(homes.get(node.func.id, (module, node.func.id)))
        waiting.extend(ast.iter_child_nodes(node))
    return found


@pytest.mark.parametrize("path", [*SOURCES, *TESTS], ids=lambda p: p.name)
def test_python_calls_entry_kernels_only(path):
    called = called_from_python(ast.parse(path.read_text(encoding="utf-8")), module_of(path))
    assert not called & inner_kernels()


def test_no_loose_modules_at_the_top():
    assert {path.stem for path in PACKAGE.glob("*.py")} == {"__init__", "__main__"}


@pytest.mark.parametrize("floor", ["model", "dynamics", "setup", "simulation"])
def test_the_kind_of_a_shape_is_asked_for_in_geometry(floor):
    for path in (PACKAGE / floor).rglob("*.py"):
        names = {
            node.id for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.Name)
        }
        assert not names & {"SPHERE", "CAPSULE", "POLYHEDRON", "HALF_SPACE"}, path.name


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_numba_is_reached_through_the_one_decorator(path):
    assert "njit" not in path.read_text(encoding="utf-8") or path.name == "jit.py"


def test_public_names_are_there_and_documented():
    for name in particlesim.__all__:
        thing = getattr(particlesim, name)
        assert name == "CATALOGUE" or thing.__doc__
