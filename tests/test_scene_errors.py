"""Broken scene files: one line that says the file, the key, the value, and what is allowed."""

import tomllib

import pytest
import trimesh

import particlesim as ps
from particlesim.setup.build import build
from tests.broken_scenes import BROKEN
from tests.broken_surroundings import BROKEN_SURROUNDINGS
from tests.scene_texts import GOOD, group, world

each_broken_scene = pytest.mark.parametrize(
    ("text", "line"), [pytest.param(*case, id=case[1][:60]) for case in BROKEN + BROKEN_SURROUNDINGS]
)


@each_broken_scene
def test_a_broken_scene_gets_this_line(text, line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(text)
    with pytest.raises(ps.SceneError) as caught:
        ps.Simulation(ps.load_scene("scene.toml"))
    error = caught.value if caught.value.file else caught.value.within("scene.toml")
    assert str(error) == f"scene.toml: {line}"


@each_broken_scene
def test_from_python_it_is_the_same_line(text, line):
    if not text or line.startswith("not valid TOML"):
        return
    with pytest.raises(ps.SceneError) as caught:
        ps.Simulation(ps.Scene(**tomllib.loads(text)))
    assert str(caught.value) == line


MESHES = {
    "none.stl": (None, "no such file"),
    ".": (None, "is a folder"),
    "garbage.stl": (
        b"hello world" * 20,
        "truncated, or not a mesh: it ends at byte 220 where 1,998,614,380 triangles take 99,930,719,084",
    ),
    "empty.stl": (b"", "is empty"),
    "flat.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n", "the vertices of 'flat' enclose no volume"),
}


@pytest.mark.parametrize("name", MESHES)
def test_a_broken_mesh_gets_a_line(name, tmp_path):
    content, line = MESHES[name]
    if content is not None:
        (tmp_path / name).write_bytes(content)
    path = tmp_path / "scene.toml"
    path.write_text(group(shape=f'{{ kind = "mesh", file = "{name}" }}'))
    file = tmp_path if name == "." else tmp_path / name
    shape = {"kind": "mesh", "file": file}
    for make in (
        lambda: ps.load_scene(path),
        lambda: ps.Scene(world={"size": [9, 9, 9]}, particles=[{"shape": shape, "count": 1}]),
    ):
        with pytest.raises(ps.SceneError) as caught:
            # What is not there is said at once, what is wrong with it when it is read.
            build(make()) if content is not None else make()
        assert 'particles[0].shape.file = "' in str(caught.value)
        assert str(caught.value).endswith(f": {line}")


def test_a_mesh_in_millimetres_gets_a_hint(tmp_path):
    trimesh.creation.box((250.0, 250.0, 250.0)).export(tmp_path / "part.stl")
    path = tmp_path / "scene.toml"
    hint = '; if the file of the mesh is in millimetres, give its shape unit = "mm"'
    for boundary, wrong in (("wall", "thick, between walls 4 m apart"), ("periodic", "half of it, 2 m")):
        mesh = '{ kind = "mesh", file = "part.stl" }'
        path.write_text(world(boundary=f'"{boundary}"').replace('shape = "sphere"', f"shape = {mesh}"))
        with pytest.raises(ps.SceneError, match="too large") as caught:
            build(ps.load_scene(path))
        assert str(caught.value).endswith(wrong + hint)
    path.write_text(group(shape='{ kind = "mesh", file = "part.stl", unit = "mm" }', size="1"))
    assert build(ps.load_scene(path)).particles["radius"][0] == pytest.approx(0.125 * 3**0.5)
    path.write_text(group(shape='{ kind = "mesh", file = "part.stl", unit = "mile" }'))
    with pytest.raises(ps.SceneError, match=r"shape.unit = \"mile\": must be 'm', 'cm', 'mm', 'um' or 'in'"):
        ps.load_scene(path)


def test_files_that_are_no_scenes(tmp_path):
    for name, content in (("binary.toml", bytes(range(256))), ("latin.toml", 'title = "é"'.encode("latin-1"))):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ps.SceneError, match=r"is not a text file \(in UTF-8\), so not a scene$"):
            ps.load_scene(tmp_path / name)
    with (tmp_path / "large.toml").open("wb") as file:
        file.truncate(100_000_000)
    with pytest.raises(ps.SceneError, match=r"large.toml: has 100 MB: a scene file has 20 MB at most$"):
        ps.load_scene(tmp_path / "large.toml")
    with pytest.raises(ps.SceneError, match=r"is a folder, not a scene file$"):
        ps.load_scene(tmp_path)
    (tmp_path / "gas.toml").write_text(GOOD)
    with pytest.raises(ps.SceneError, match=r"no such file; did you mean '.*gas.toml'\?$"):
        ps.load_scene(tmp_path / "gsa.toml")
    with pytest.raises(ps.SceneError, match=r"no such file$"):
        ps.load_scene(tmp_path / "none" / "x.toml")


def test_errors_are_one_line_without_pydantic_words():
    for _, line in BROKEN:
        assert "\n" not in line
        assert not any(word in line for word in ("Input should", "function-", "union_tag", "validation error"))


def test_more_particles_than_memory_are_refused_at_once(monkeypatch):
    monkeypatch.setattr("os.sysconf", lambda name: {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 1000}[name])
    scene = ps.Scene(world={"size": [4, 4, 4]}, particles=[{"shape": "sphere", "count": 10**6, "size": 0.001}])
    with pytest.raises(ps.SceneError, match="1,000,000 particles need about 1 GB of memory; there are 0 GB"):
        build(scene)
