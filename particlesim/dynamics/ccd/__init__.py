"""Continuous collision detection: when two bodies first touch along their paths."""
