"""Impacts at their true time: who meets whom, when, and what becomes of it."""

from particlesim.impacts.flight import Flight

__all__ = ["Flight"]
