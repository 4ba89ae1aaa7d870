"""Tags and tolerances shared by every floor, each with its unit and its reason."""

# Geometry kinds inside the kernels: every convex polyhedron is a HULL.
SPHERE = 0
HULL = 1

# What happens to a particle at the two faces of the world that bound an axis.
WALL = 0
PERIODIC = 1
OPEN = 2

# The six walls in the order of the ledger's wall impulses.
WALL_NAMES = ("-x", "+x", "-y", "+y", "-z", "+z")

# A particle's surface may move this fraction of its inscribed radius in one automatic time step.  Two particles
# then approach by at most a fifth of the sum of their inscribed radii, so they cannot pass through each other
# unnoticed, and an impact is always bracketed by the start and the end of the step that found it.
STEP_FRACTION = 0.2

# Two faces, or an edge and a face, closer to parallel than this touch along a patch, not at a point [sine of the
# angle].  Rounding turns a face by about 1e-15; a fall of one radius at this angle shifts the contact by 1e-6 of it.
PARALLEL_TOLERANCE = 1e-6

# Vertices this close to the deepest one, as a fraction of the hull's bounding radius, belong to the contact patch.
PATCH_TOLERANCE = 1e-6

# An octagon: the most points a contact patch keeps; more do not change the impulse, whose first point is their mean.
MAX_MANIFOLD = 8
