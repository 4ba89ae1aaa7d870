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

# The most points a contact patch keeps, as two squares across each other have. The impulse acts in their middle first.
MAX_MANIFOLD = 8

# Under gravity a particle that meets something more slowly than a fall from this fraction of its inscribed radius
# rebounds in full, whatever its restitution: its bounces would become infinitely many in finite time.  What is left
# is a tremble of a thousandth of its size that neither gains nor loses energy; it does not sink.
RESTING_DROP = 1e-3

# Rounds of impacts within one time step before what still approaches is left to the next step and counted.
MAX_ROUNDS = 200

# Impulses given to one patch in one impact: its middle, then whichever corner still approaches.
MAX_PATCH_IMPULSES = 64

# Slower than this fraction of the surface speeds involved, a contact does not approach: it is rounding.
APPROACH_TOLERANCE = 1e-12

# An impact is placed where the separation is between 0 and this fraction of the particles' sizes: an order above the
# rounding of positions in a world a thousand sizes wide, so that the particles are apart when they go on.
IMPACT_TOLERANCE = 1e-12
