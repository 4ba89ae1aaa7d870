"""What the options of ``render`` ask for: a scene drawn in another way, and some of its frames only."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from particlesim.cli.errors import OptionError

if TYPE_CHECKING:
    from particlesim.scene import Scene


class RenderOptions(NamedTuple):
    """The values of options as they were given, None for those that were not."""

    frames: str | None
    every: str | None
    still: str | None
    shard: str | None
    look: Path | None
    quality: str | None
    size: str | None
    camera: str | None
    colour: str | None
    scale: str | None


def scene_as_asked(scene: Scene, options: RenderOptions, *, of_trajectory: bool) -> Scene:
    """The scene as the options change it. OptionError for a value that is not allowed, SceneError for a wrong look."""
    from particlesim.scene.overrides import replaced, scaled, with_colour, with_movie  # noqa: PLC0415

    if options.scale is not None:
        if of_trajectory:
            raise OptionError("--scale: only of a scene, whose particles are yet to be placed")
        factor = _number("--scale", options.scale, "a number above 0", above=0.0)
        scene = _allowed("--scale", options.scale, lambda: scaled(scene, factor))
    if options.shard is not None and not of_trajectory:
        raise OptionError("--shard: only of a trajectory, such as 'particlesim simulate' makes of a scene")
    if options.look is not None:
        scene = _with_look_of(scene, options.look)
    if options.quality is not None:
        quality = options.quality
        scene = _allowed("--quality", quality, lambda: with_movie(scene, quality=quality, resolution=None))
    if options.size is not None:
        resolution = _resolution(options.size)
        scene = _allowed("--size", options.size, lambda: with_movie(scene, resolution=resolution))
    if options.camera is not None:
        camera = _table_or_word("--camera", options.camera)
        scene = _allowed("--camera", None, lambda: replaced(scene, camera=camera))
    if options.colour is not None:
        colour = _table_or_word("--colour", options.colour)
        scene = _allowed("--colour", options.colour, lambda: with_colour(scene, colour))
    return scene


def frames_asked(total: int, frames: str | None, every: str | None) -> range:
    """Numbers of the frames to draw, of ``total``. OptionError if there are none, or if the values say nothing."""
    start = stop = None
    if frames is not None:
        match = re.fullmatch(r"\s*(-?\d*)\s*:\s*(-?\d*)\s*", frames)
        if not match or "-" in match.groups():
            allowed = "must be A:B, from frame A up to but without frame B; either may be left out"
            raise OptionError(f"--frames {frames}: {allowed}")
        start, stop = (int(text) if text else None for text in match.groups())
    step = 1 if every is None else _whole("--every", every)
    chosen = range(total)[start:stop:step]
    if not chosen:
        raise OptionError(f"--frames {frames}: there are none; the frames are 0 to {total - 1:,}")
    return chosen


def shard_asked(options: RenderOptions) -> tuple[int, int] | None:
    """Which part (k, n) of the movie to draw, None for all of it. OptionError for what says no part."""
    if options.shard is None:
        return None
    match = re.fullmatch(r"\s*(\d{1,9})\s*/\s*(\d{1,9})\s*", options.shard)
    if not match:
        raise OptionError(f"--shard {options.shard}: must be K/N, part K of N, such as 1/8")
    number, of = map(int, match.groups())
    return number, of


def still_time(duration: float, options: RenderOptions) -> float | None:
    """The time of the still picture [s], None if a movie is wanted. OptionError if it is not in the scene."""
    if options.still is None:
        return None
    for option, value in (("--frames", options.frames), ("--every", options.every), ("--shard", options.shard)):
        if value is not None:
            raise OptionError(f"{option}: of a movie, not of the one picture that --still asks for")
    what = f"a time from 0 to {duration:g} s"
    time = _number("--still", options.still, what)
    if not 0.0 <= time <= duration:
        raise OptionError(f"--still {options.still}: must be {what}")
    return time


def _with_look_of(scene: Scene, path: Path) -> Scene:
    from particlesim.cli.run import load  # noqa: PLC0415
    from particlesim.scene.file import SceneError  # noqa: PLC0415
    from particlesim.scene.overrides import with_look  # noqa: PLC0415

    try:
        return with_look(scene, load(path))
    except SceneError as error:
        raise error if error.file else error.within(path) from None


def _allowed(option: str, text: str | None, change: Callable[[], Scene]) -> Scene:
    """What ``change`` gives; a SceneError is said of the option: of its ``text``, or of the keys in it."""
    from particlesim.scene.file import SceneError  # noqa: PLC0415

    try:
        return change()
    except SceneError as error:
        raise OptionError(f"{option}: {error}" if text is None else f"{option} {text}: {error.message}") from None


def _number(option: str, text: str, what: str, above: float = -math.inf) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > above):
        raise OptionError(f"{option} {text}: must be {what}")
    return value


def _whole(option: str, text: str) -> int:
    if not re.fullmatch(r"\d{1,9}", text) or int(text) < 1:
        raise OptionError(f"{option} {text}: must be a whole number of 1 or more")
    return int(text)


def _resolution(text: str) -> list[int]:
    match = re.fullmatch(r"(\d{1,6})[xX](\d{1,6})", text)
    if not match:
        raise OptionError(f"--size {text}: must be WIDTHxHEIGHT in pixels, such as 1280x720")
    return [int(number) for number in match.groups()]


def _table_or_word(option: str, text: str) -> Any:
    """A table in TOML's inline form, or a word as it is."""
    if not text.lstrip().startswith("{"):
        return text
    import tomllib  # noqa: PLC0415

    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError as error:
        raise OptionError(f"{option}: not valid TOML: {error}") from None
