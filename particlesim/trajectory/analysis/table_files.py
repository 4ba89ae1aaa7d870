"""Tables to files: CSV, which everything reads, and Parquet, which is read in a fraction of the time."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from particlesim.core.atomic_write import atomic_write
from particlesim.core.extras import require


def write_csv(path: Path, table: np.ndarray) -> None:
    """Write a structured array of float64 with a line of names; numbers keep every bit. OSError if it cannot be."""
    names = table.dtype.names or ()
    with atomic_write(path) as hidden:
        # 17 digits tell any two doubles apart.
        np.savetxt(hidden, table, fmt="%.17g", delimiter=",", header=",".join(names), comments="")


def write_parquet(path: Path, table: np.ndarray) -> None:
    """The same as Parquet. MissingExtraError without pyarrow; OSError if it cannot be written."""
    arrow, parquet = require("pyarrow", "parquet"), require("pyarrow.parquet", "parquet")
    columns = {name: np.ascontiguousarray(table[name]) for name in table.dtype.names or ()}
    with atomic_write(path) as hidden:
        parquet.write_table(arrow.table(columns), hidden)
