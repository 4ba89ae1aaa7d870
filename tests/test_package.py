"""What the package says of itself: its version in all places, its types, its names, the command's completion."""

import ast
import importlib.metadata
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import particlesim as ps

PACKAGE = Path(ps.__file__).parent
ROOT = PACKAGE.parent


def test_the_version_is_the_same_everywhere():
    assert importlib.metadata.version("particlesim") == ps.__version__
    assert f"\nversion: {ps.__version__}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"\n## {ps.__version__}\n" in (ROOT / "CHANGELOG.md").read_text()


def test_checkers_of_types_know_every_public_name():
    """A stub gives away only what it imports under the same name again."""
    imported = [
        alias
        for node in ast.parse((PACKAGE / "__init__.pyi").read_text()).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    ]
    assert all(alias.asname == alias.name for alias in imported)
    assert sorted(alias.name for alias in imported) == sorted(ps.__all__)
    assert (PACKAGE / "py.typed").exists()


def test_a_name_that_there_is_not():
    with pytest.raises(AttributeError, match="nothing"):
        _ = ps.nothing


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_complete_commands(shell):
    asked = {
        "_PARTICLESIM_COMPLETE": f"complete_{shell}",
        "COMP_WORDS": "particlesim si",
        "COMP_CWORD": "1",
        "_TYPER_COMPLETE_ARGS": "particlesim si",
        "_TYPER_COMPLETE_FISH_ACTION": "get-args",
    }
    code = "import sys; sys.argv = ['particlesim']; from particlesim.cli.main import main; main()"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=os.environ | asked, capture_output=True, text=True, check=False)
    assert re.search(r"\bsimulate\b", done.stdout) and "render" not in done.stdout
