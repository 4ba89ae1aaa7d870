"""Rows of a sweep as a file: CSV, which everything reads, or Parquet."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from particlesim.core.atomic_write import atomic_write
from particlesim.core.extras import require

SUFFIXES = ".csv", ".parquet"


def write_rows(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Write rows with the same keys. MissingExtraError for Parquet without pyarrow; OSError if it cannot be written."""
    with atomic_write(path) as hidden:
        if path.suffix == ".parquet":
            arrow, parquet = require("pyarrow", "parquet"), require("pyarrow.parquet", "parquet")
            parquet.write_table(arrow.table({key: _column([row[key] for row in rows]) for key in rows[0]}), hidden)
            return
        with hidden.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)


def _column(values: list[Any]) -> list[Any]:
    """The values of a column, which Parquet wants to be of one type: numbers and what is not known, or text."""
    known = [value for value in values if value is not None]
    if all(isinstance(value, bool) for value in known) or all(isinstance(value, int) for value in known):
        return values
    if all(isinstance(value, int | float) for value in known):
        return [None if value is None else float(value) for value in values]
    return [None if value is None else str(value) for value in values]
