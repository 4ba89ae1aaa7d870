"""Colour, light and shade."""
