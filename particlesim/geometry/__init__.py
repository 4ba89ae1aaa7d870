"""Shapes and the exact answers about them: mass properties, boxes, separation, contact manifolds."""
