"""Whether a body settles with others in the present substep (see contact/resting.py).

It does not, it does, or it does and may still collide with others that settle as if it did not.
"""

FREE = 0
SETTLES = 1
LOOSE = 2
