"""A sweep: one scene with other values under some of its keys, case by case; what a sweep file may say."""

from __future__ import annotations

import copy
import csv
import itertools
import math
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import BeforeValidator, Field, ValidationError, create_model, model_validator

from particlesim.scene import Scene
from particlesim.scene.base import File, Model, paths_from, whole
from particlesim.scene.errors import SceneError
from particlesim.scene.file import load_table, parse_scene
from particlesim.scene.key_paths import put
from particlesim.scene.messages import must_be, shown
from particlesim.scene.validation_errors import explain

# Cases of a sweep at most: all are checked before the first is run, a millisecond each.
MAX_CASES = 100_000

Whole = Annotated[int, Field(ge=0, le=2**63 - 1), whole, must_be("a whole number of 0 or more")]
Count = Annotated[int, Field(ge=1, le=MAX_CASES), whole, must_be(f"a whole number from 1 to {MAX_CASES:,}")]

# 'from' is a word of Python, which no class can have for a field.
_FROM: dict[str, Any] = {"from": (Whole | None, None)}


class Axis(create_model("Axis", __base__=Model, **_FROM)):  # type: ignore[misc]
    """The values of a key: any ones, or whole numbers in a row, such as seeds."""

    count: Count | None = None
    values: list[Any] | None = None

    @model_validator(mode="after")
    def _has_values(self) -> Axis:
        in_a_row = [key for key in ("from", "count") if getattr(self, key) is not None]
        if len(in_a_row) != (2 if self.values is None else 0):
            raise ValueError("must have either values, or from and count")
        if self.values == []:
            raise ValueError("has no values")
        return self

    @property
    def all(self) -> list[Any]:
        """The values in their order."""
        begin = getattr(self, "from")
        return list(range(begin, begin + self.count)) if self.values is None else self.values


def _as_table(value: Any) -> Any:
    """A list stands for a table of these values."""
    if isinstance(value, list):
        return {"values": value}
    if isinstance(value, dict):
        return value
    raise ValueError("must be a list of values, or { from = 1, count = 10 }")


class SweepTable(Model):
    """The table ``[sweep]``: a scene, and either axes, of which all combinations are cases, or a table of cases."""

    scene: File
    axes: dict[str, Annotated[Axis, BeforeValidator(_as_table)]] = Field(default_factory=dict)
    cases: File | None = None

    @model_validator(mode="after")
    def _has_cases(self) -> SweepTable:
        if bool(self.axes) == (self.cases is not None):
            raise ValueError("must have either [sweep.axes] or cases, the path of a CSV file")
        number = math.prod(len(axis.all) for axis in self.axes.values())
        if number > MAX_CASES:
            raise ValueError(f"{number:,} combinations; there may be up to {MAX_CASES:,} cases")
        return self


class SweepFile(Model):
    """What a sweep file says."""

    sweep: SweepTable


class Case(NamedTuple):
    """A case of a sweep: other values by their key paths, and the scene with them."""

    values: dict[str, Any]
    scene: Scene


def load_sweep(path: str | Path) -> list[Case]:
    """The cases of a sweep file (TOML). SceneError, in one line, if it or a case is wrong."""
    path = Path(path)
    table = load_table(path)
    try:
        with paths_from(path.parent, of_file=True):
            sweep = SweepFile(**table).sweep
    except ValidationError as error:
        raise SceneError(*explain(error, table, SweepFile), path) from None
    whole_scene = load_table(sweep.scene)
    listed = list(_combined(sweep.axes) if sweep.cases is None else _read(sweep.cases))
    return [
        Case(values, _scene(whole_scene, sweep.scene, values, f"case {number} of {len(listed)}", path))
        for number, values in enumerate(listed, start=1)
    ]


def case_text(values: dict[str, Any]) -> str:
    """The values of a case in words."""
    return ", ".join(f"{key} = {shown(value)}" for key, value in values.items())


def _combined(axes: dict[str, Axis]) -> Iterator[dict[str, Any]]:
    """All combinations of values; those of the last axis change fastest."""
    for values in itertools.product(*(axis.all for axis in axes.values())):
        yield dict(zip(axes, values, strict=True))


def _read(path: Path) -> Iterator[dict[str, Any]]:
    """The rows of a CSV file, key paths in its first; what is left empty stays as the scene has it."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = list(csv.reader(file))
    except OSError as error:
        raise SceneError(f"cannot be read: {error.strerror}", file=path) from None
    except (UnicodeDecodeError, csv.Error):
        raise SceneError("is no CSV file (in UTF-8)", file=path) from None
    keys, rows = (rows[0] if rows else []), [row for row in rows[1:] if row]
    if not rows or len(rows) > MAX_CASES:
        raise SceneError(f"has {len(rows):,} cases below its line of keys; there must be 1 to {MAX_CASES:,}", file=path)
    for number, row in enumerate(rows, start=1):
        if len(row) != len(keys):
            raise SceneError(f"case {number} has {len(row)} values for {len(keys)} keys", file=path)
        yield {key: _parsed(text) for key, text in zip(keys, row, strict=True) if text.strip()}


def _parsed(text: str) -> Any:
    """A value as TOML writes it, or else text as it is."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text.strip()


def _scene(table: dict[str, Any], base: Path, values: dict[str, Any], which: str, file: Path) -> Scene:
    changed = copy.deepcopy(table)
    try:
        for key, value in values.items():
            put(changed, key, value)
        return parse_scene(changed, base)
    except SceneError as error:
        found = SceneError(error.message, error.key, error.value)
        raise SceneError(f"{which} ({case_text(values)}): {found}", file=file) from None
