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

# In an automatic time step the surfaces of particles move by this fraction of their bounding radii, as a root mean
# square. It decides how often neighbours are looked up and how much hangs together, not what happens: impacts have own
# times. Gases take about as long with anything from half of it to three times as much; a fast ball that strikes a
# million at rest takes the least time if its particles move by two fifths of their radius, which this comes to.
STEP_FRACTION = 0.125

# A time step in which they would move farther than this is taken in several stretches.
MAX_SUBSTEP_DISPLACEMENT = 0.4

# Two faces, or an edge and a face, closer to parallel than this touch along a patch, not at a point [sine of the
# angle].  Rounding turns a face by about 1e-15; a fall of one radius at this angle shifts the contact by 1e-6 of it.
PARALLEL_TOLERANCE = 1e-6

# The most points a contact patch keeps, as two squares across each other have. The impulse acts in their middle first.
MAX_MANIFOLD = 8

# Under gravity, what meets more slowly than by a fall from this fraction of its inscribed radius comes to rest: its
# bounces, if not ended, would be infinitely many in finite time, and are lower than can be seen.  It rebounds in full
# to the end of the stretch of time, and rests from then on (see impacts/resting.py).
RESTITUTION_THRESHOLD_HEIGHT = 1e-3

# Faces and edges inclined by less than this [sine of the angle] rest on each other along a patch: about what a face
# is inclined by when one of its edges lies and the other is a few RESTITUTION_THRESHOLD_HEIGHT away.
RESTING_PARALLEL_TOLERANCE = 1e-2

# Whether a particle is in no cluster of what comes to rest, settles with one, or does and may still meet others of it
# as if it did not (see impacts/cluster.py).
FREE = 0
SETTLES = 1
LOOSE = 2

# What rebounds in full rests only if it is this much slower and nearer than what does not: energy is kept to 1e-14.
STILL = 1e-6

# Impacts that hang together within one stretch of time, for each of their particles, before it is cut shorter.
MAX_IMPACTS = 1000

# The same for impacts of what comes to rest: the next stretch begins with all their contacts at once.
MAX_SLOW_IMPACTS = 100

# Times that islands are joined within one stretch of time before it is tried in two halves, and how often it is
# halved before it is taken as it is: islands with more impacts than that then stand still until its end.
MAX_ISLAND_ROUNDS = 40
MAX_SUBSTEP_BISECTIONS = 5

# Impacts of the same particles that are apart by less than this fraction of a stretch of time happen at once: some
# digits above the rounding of times, and the way made meanwhile is less than 1e-10 of a size.
SIMULTANEOUS = 1e-12

# Impulses given to one patch in one impact: its middle, then whichever corner still approaches.
MAX_PATCH_IMPULSES = 64

# Slower than this fraction of the surface speeds involved, a contact does not approach: it is rounding.
APPROACH_TOLERANCE = 1e-12

# An impact is placed where the separation is between 0 and this fraction of the particles' sizes: an order above the
# rounding of positions in a world a thousand sizes wide, so that the particles are apart when they go on.
IMPACT_TOLERANCE = 1e-12

# Bodies that touch and part, or hardly move, may sink into each other by this fraction of their sizes before they
# count as meeting again: it bounds the number of impacts between two that roll over each other or lie still.
PENETRATION_SLOP = 4e-7

# The same where gravity brings things to rest: few impacts pass between a jolt and the next rest.
RESTING_PENETRATION_SLOP = 1e-5

# A particle may get this fraction of its radius away from where it was when its neighbours were looked up, and half
# as far again as it flies in one stretch of time, before they are looked up anew. Longer leashes make longer lists,
# which take time in every stretch and memory; shorter ones must be made more often.
VERLET_SKIN = 0.6
