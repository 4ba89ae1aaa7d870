"""Impacts in the order of time: prediction, islands, the event queue, the paths between events."""
