"""The loop, and what there is to see of it."""
