"""Impacts at their true time: who meets whom, when, and what becomes of it."""

from particlesim.dynamics.solver import Flight

__all__ = ["Flight"]
