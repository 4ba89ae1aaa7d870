"""Impacts at their true time: which bodies collide, when, and what becomes of it; and what rests."""
