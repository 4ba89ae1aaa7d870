"""Segments of a movie into the whole, without encoding again; of a GIF with one palette for all."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

from particlesim.rendering.gl.platform import ffmpeg
from particlesim.rendering.video.encoder import failure

_LIST = "segments.txt"

# Without the bit rate, which would tell of the files that it was joined from, and how often.
_MP4 = ["-movflags", "+faststart", "-write_btrt", "0", "-f", "mp4"]
_WEBM = ["-f", "webm"]

# Each picture is shown as long as the first: in a file that was joined, that before a segment too short to have
# pictures in another order (H.264's B frames) seems to last until their delay is made up for, and the movie longer.
_EVEN = ["-bsf:v", "setts=pts=PTS:dts=DTS:duration=if(eq(N\\,0)\\,st(0\\,DURATION)\\,ld(0))"]

# Hundredths of a second are the least that a GIF tells pictures apart by, and viewers slow down what goes faster than
# two of them.
_GIF_RATE = "fps=min(source_fps\\,50)"

# The name of the comment, and a length that the parts of one cannot go beyond (GIF89a specification, 24).
_COMMENT, _BLOCK = "comment", 255


def join_files(folder: Path, names: Sequence[str], path: Path, tags: Mapping[str, str]) -> None:
    """Write movies in a folder, one after the other, to ``path`` with these tags: in the format of its ending.

    RenderError if ffmpeg fails.
    """
    (folder / _LIST).write_text("".join(f"file {name}\n" for name in names))
    if path.suffix.lower() == ".gif":
        _join_gif(folder, path, tags.get(_COMMENT, ""))
        return
    muxer = _WEBM if path.suffix.lower() == ".webm" else _MP4
    written = [word for name, text in tags.items() for word in ("-metadata", f"{name}={text}")]
    _joined(folder, ["-c", "copy", *_EVEN, *written, *muxer], path)


def pictures_in(path: Path) -> int:
    """How many pictures of a movie can be read, without decoding them."""
    done = _ffmpeg(["-i", f"file:{path.absolute()}", "-c", "copy", "-f", "framecrc", "-"], path.parent)
    # A line each; lines about all of them begin with a number sign.
    return sum(not line.startswith(b"#") for line in done.stdout.splitlines())


def _join_gif(folder: Path, path: Path, comment: str) -> None:
    """The colours are chosen in one pass over all pictures, so that none changes from one to the next."""
    palette = folder / "palette.png"
    _joined(folder, ["-vf", f"{_GIF_RATE},palettegen"], palette)
    mapped = f"{_GIF_RATE}[x];[x][1:v]paletteuse=dither=bayer:bayer_scale=4:diff_mode=rectangle"
    _joined(folder, ["-i", palette.name, "-lavfi", mapped, "-f", "gif"], path)
    _comment_gif(path, comment.encode())


def _comment_gif(path: Path, comment: bytes) -> None:
    """Put a comment into a GIF, before its pictures: ffmpeg writes none."""
    with path.open("r+b") as file:
        data = file.read()
        flags = data[10]
        start = 13 + (3 << (flags % 8 + 1) if flags & 0x80 else 0)  # after the header and the colours of all pictures
        file.seek(start)
        parts = (comment[first : first + _BLOCK] for first in range(0, len(comment), _BLOCK))
        file.write(b"\x21\xfe" + b"".join(bytes([len(part)]) + part for part in parts) + b"\x00")
        file.write(data[start:])


def _joined(folder: Path, arguments: Sequence[str], path: Path) -> None:
    """Let ffmpeg make a file of all segments. RenderError if it fails."""
    source = ["-y", "-f", "concat", "-i", _LIST]
    done = _ffmpeg([*source, *arguments, "-fflags", "+bitexact", f"file:{path.absolute()}"], folder)
    if done.returncode:
        raise failure(done.returncode, done.stderr)


def _ffmpeg(arguments: Sequence[str], folder: Path) -> subprocess.CompletedProcess[bytes]:
    # A session of its own: Ctrl-C is for us to handle.
    command = [ffmpeg(), "-v", "error", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, start_new_session=True, check=False)
