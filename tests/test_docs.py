"""The pages of docs/: what they tell to write and run is written and run, and what they name is there."""

import ast
import re
import shlex
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli

ROOT = Path(ps.__file__).parents[1]
DOCS = ROOT / "docs"
TUTORIAL = (DOCS / "tutorial.md").read_text()

# What a table on a page stands in, so that it makes a scene.
REST = {"world": {"size": [4, 4, 4]}, "particles": [{"shape": "sphere", "count": 1, "size": 0.1, "name": "balls"}]}


def blocks(text, language):
    """Blocks of code with the names of their files, in their order."""
    return re.findall(rf'^```{language}(?: title="([^"]+)")?\n(.*?)^```$', text, re.MULTILINE | re.DOTALL)


def test_every_command_of_the_tutorial_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in blocks(TUTORIAL, "toml"):
        Path(name).write_text(text)
    made = set()
    commands = [line for _, block in blocks(TUTORIAL, "sh") for line in block.splitlines()]
    assert len(commands) > 10
    for line in commands:
        program, *arguments = shlex.split(line)
        assert program == "particlesim"
        done = CliRunner().invoke(cli.app, arguments)
        assert done.exit_code == 0, (line, done.output)
        made.update(arguments[k + 1] for k, word in enumerate(arguments) if word == "-o")
    assert all(Path(name).stat().st_size for name in made)


def test_every_example_in_python_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for _, code in blocks((DOCS / "python.md").read_text(), "python"):
        exec(compile(code, "python.md", "exec"), {})
    assert {path.name for path in tmp_path.iterdir()} >= {"movie.mp4", "run.gsd", "picture.png", "energy.pdf"}


@pytest.mark.parametrize("page", sorted((DOCS / "scene").glob("*.md")), ids=lambda page: page.stem)
def test_every_table_on_a_page_makes_a_scene(page, monkeypatch):
    monkeypatch.chdir(DOCS.parent / "scenes")  # where files are that they name
    examples = blocks(page.read_text(), "toml")
    assert examples
    for _, text in examples:
        ps.Scene(**{**REST, **tomllib.loads(text)})


def test_every_key_of_a_scene_says_what_it_is_and_has_its_page():
    schema = ps.Scene.model_json_schema()
    for table in (schema, *schema["$defs"].values()):
        for key, node in table["properties"].items():
            assert key == "kind" or node["description"], (table["title"], key)
    pages = {path.stem: path.read_text() for path in (DOCS / "scene").glob("*.md")}
    asked = [key for text in pages.values() for key in re.findall(r"^\{\{ keys of (\w+) \}\}$", text, re.MULTILINE)]
    tables = schema["properties"].keys() - {"title", "seed", "duration"}
    assert sorted(asked) == sorted(tables) == sorted(pages.keys() - {"index"})


def test_every_test_that_validation_names_is_there():
    named = re.findall(r"`(tests/\w+\.py)(?:::(\w+))?`", (DOCS / "validation.md").read_text())
    assert len(named) > 30
    for path, name in named:
        functions = {
            node.name for node in ast.parse((ROOT / path).read_text()).body if isinstance(node, ast.FunctionDef)
        }
        assert not name or name in functions, (path, name)
