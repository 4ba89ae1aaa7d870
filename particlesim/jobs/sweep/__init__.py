"""Sweeps: a scene case by case, each summed up as one row of a table, and figures of the rows."""
