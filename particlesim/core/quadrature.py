"""Gauss-Legendre quadrature with three stages, order 6, as a Runge-Kutta method.

(E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, 2nd ed., II.1.3, table 1.2.) Such methods keep
quadratic invariants (IV.2, theorem 2.1).
"""

import math

_S = math.sqrt(15.0)

# How much of each stage's rate goes into a stage, and into the step.
STAGES = (
    (5.0 / 36.0, 2.0 / 9.0 - _S / 15.0, 5.0 / 36.0 - _S / 30.0),
    (5.0 / 36.0 + _S / 24.0, 2.0 / 9.0, 5.0 / 36.0 - _S / 24.0),
    (5.0 / 36.0 + _S / 30.0, 2.0 / 9.0 + _S / 15.0, 5.0 / 36.0),
)
WEIGHTS = (5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0)
