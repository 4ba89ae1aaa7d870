"""The house rules that can be read off the sources: imports go down only, rooms stay small, kernels are kernels."""

import ast
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


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_numba_is_reached_through_the_one_decorator(path):
    assert "njit" not in path.read_text(encoding="utf-8") or path.name == "jit.py"


def test_editors_know_every_public_name():
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    known = {alias.name: node.module for node in block.body for alias in node.names}
    assert sorted(known) == sorted(particlesim.__all__)
    assert known == {name: f"particlesim.{home}" for name, home in particlesim._HOMES.items()}


def test_public_names_are_there_and_documented():
    for name in particlesim.__all__:
        thing = getattr(particlesim, name)
        assert name == "CATALOGUE" or thing.__doc__
