"""What all tables of a scene share: the base model, numbers with their bounds, shorthands, colours."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Annotated, Any

from PIL import ImageColor
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    create_model,
    model_validator,
)
from pydantic_core import PydanticCustomError

from particlesim.core.mesh_files import check_mesh_file
from particlesim.scene.errors import SceneError
from particlesim.scene.messages import OUT_OF_REACH, hint, must_be
from particlesim.scene.validation_errors import explain

# The sizes that numbers of a scene may have, other than 0: the fifth powers and the products that inertias, momenta
# and energies are made of stay well inside double precision.
SMALLEST, LARGEST = 1e-30, 1e30

# More particles than this fit in no memory yet: a kilobyte each.
MAX_COUNT = 100_000_000


def _a_number(value: Any) -> Any:
    if isinstance(value, bool | str):
        raise ValueError("not a number")
    return value


def _within_reach(value: float) -> float:
    if value and not SMALLEST <= abs(value) <= LARGEST:
        raise PydanticCustomError(OUT_OF_REACH, "neither 0 nor of a usual size")
    return value


# Text and true are no numbers; 1e5 is a whole one.
PlainFloat = Annotated[float, Field(strict=True, allow_inf_nan=False)]
_reach = AfterValidator(_within_reach)
Number = Annotated[PlainFloat, _reach]
PositiveNumber = Annotated[PlainFloat, Field(gt=0), _reach]
whole = BeforeValidator(_a_number)

Finite = Annotated[Number, must_be("a finite number")]
Positive = Annotated[PositiveNumber, must_be("a number above 0")]
NotNegative = Annotated[PlainFloat, Field(ge=0), _reach, must_be("a number of 0 or more")]
Fraction = Annotated[PlainFloat, Field(ge=0, le=1), must_be("a number from 0 to 1")]
Vector = Annotated[tuple[Number, Number, Number], must_be("a list of 3 finite numbers, [x, y, z]")]
PositiveVector = Annotated[
    tuple[PositiveNumber, PositiveNumber, PositiveNumber], must_be("a list of 3 numbers above 0, [x, y, z]")
]
Text = Annotated[str, must_be("text in quotes")]
Flag = Annotated[bool, Field(strict=True), must_be("true or false")]

# The folder that paths start at; None in a scene that was stored, whose files need not be there any more.
_folder: ContextVar[Path | None] = ContextVar("folder", default=Path())

# Whether it is that of a file that names them, which may have come from anywhere.
_of_file: ContextVar[bool] = ContextVar("of_file", default=False)


@contextmanager
def paths_from(folder: Path | None, of_file: bool = False) -> Iterator[None]:
    """Let paths in tables that are made in the ``with`` block start at a folder; None: as they are, unseen."""
    tokens = _folder.set(folder), _of_file.set(of_file)
    try:
        yield
    finally:
        _folder.reset(tokens[0])
        _of_file.reset(tokens[1])


def _from_folder(path: Path) -> Path:
    """A path that starts at the folder. ValueError if a file names it that is neither in its folder nor below."""
    folder = _folder.get()
    if folder is None:
        return path
    if _of_file.get() and not Path(os.path.realpath(folder / path)).is_relative_to(os.path.realpath(folder)):
        raise ValueError("is outside the folder of the file that names it")
    return folder / path


File = Annotated[Path, must_be("the path of a file, in quotes"), AfterValidator(_from_folder)]


class Model(BaseModel):
    """Base of every table of a scene: unknown keys are refused, assignments are checked.

    SceneError, in one line, for an assignment that is not allowed.
    """

    model_config = ConfigDict(extra="forbid", validate_assignment=True)

    def __setattr__(self, name: str, value: Any) -> None:
        try:
            super().__setattr__(name, value)
        except ValidationError as error:
            raise SceneError(*explain(error, {name: value}, type(self))) from None

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """What a table is shown with: the keys that say something, which ``kind`` does and the usual values do not."""
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            if field.is_required() or value != field.get_default(call_default_factory=True):
                yield name, value


# 'from' is a word of Python, which no class can have for a field.
_SPAN: dict[str, Any] = {
    "from": (NotNegative, Field(default=0.0, description="when it begins [s]")),
    "until": (Positive | None, Field(default=None, description="when it ends; never if not given [s]")),
}


class Timed(create_model("Span", __base__=Model, **_SPAN)):  # type: ignore[misc]
    """Goes on from a time until another one [s]; before and after it nothing goes on."""

    @model_validator(mode="after")
    def _in_order(self) -> Timed:
        if self.until is not None and self.until <= self.begin:
            raise ValueError(f"until must be after from, but {self.until:g} is not after {self.begin:g}")
        return self

    @property
    def begin(self) -> float:
        """When it begins [s]."""
        return float(getattr(self, "from"))


def in_time(keys: list[Any]) -> list[Any]:
    """The keys of a path. ValueError if their times do not grow."""
    for before, after in itertools.pairwise(keys):
        if after.time <= before.time:
            raise ValueError(f"times must grow from key to key, but {after.time:g} follows {before.time:g}")
    return keys


def existing_file(path: Path) -> Path:
    """The path of a file. ValueError if there is none."""
    # Of a name that no file can have Path.is_file raises.
    if _folder.get() is not None and not os.path.isfile(path):
        raise ValueError("is a folder" if os.path.isdir(path) else "no such file")
    return path


def mesh_file(path: Path) -> Path:
    """As ``existing_file``, of a mesh. ValueError if it is not one that is read."""
    found = existing_file(path)
    if _folder.get() is not None:
        check_mesh_file(found)
    return found


def shorthand(
    what: str, written: Any, *, bare: tuple[type, ...] = (), table: tuple[str, str] = ("", ""), text: bool = True
) -> BeforeValidator:
    """Let ``text`` stand for a table of that kind, and a ``bare`` value for ``{kind = table[0], table[1] = value}``.

    ``what`` says which values are allowed; ``written`` is the type that stands in a scene file, for its JSON Schema.
    """

    def expand(value: Any) -> Any:
        if isinstance(value, dict | BaseModel):
            return value
        if text and isinstance(value, str):
            return {"kind": value}
        if isinstance(value, bare) and not isinstance(value, bool):
            return {"kind": table[0], table[1]: value}
        raise ValueError(f"must be {what}")

    return BeforeValidator(expand, json_schema_input_type=written)


def colour_or(*words: str) -> AfterValidator:
    """Allow a colour or one of ``words``."""
    also = "".join(f"'{word}', " for word in words)

    def check(value: str) -> str:
        if value in words:
            return value
        try:
            ImageColor.getrgb(value)
        except ValueError:
            meant = hint(value, [*words, *ImageColor.colormap])
            raise ValueError(f"must be {also}a colour name such as 'steelblue', or '#rrggbb'{meant}") from None
        return value

    return AfterValidator(check)


Colour = Annotated[Text, colour_or()]
