"""Every tolerance and bound of the solver: its unit, its reason, and what goes wrong if it is changed.

Those of the exact tests of shapes stand in geometry/tolerances.py.
"""

# ---- time steps and substeps ---------------------------------------------------------------------------------------

# In an automatic time step surfaces move by this fraction of their bounding radii, as a root mean square [1]. It
# decides how often neighbours are searched and how large islands get, not what happens: impacts have own times. Gases
# take about as long with anything from half of it to three times as much; a fast ball that strikes a million at rest
# takes least if its particles move by two fifths of their radius, which this comes to. Smaller: more passes.
STEP_DISPLACEMENT = 0.125

# A time step in which surfaces would move by more than this fraction of their radii is taken in several substeps [1].
# Larger: islands grow until one thread has nearly all the work.
MAX_SUBSTEP_DISPLACEMENT = 0.4

# On periodic axes a substep is so short that no body comes nearer to the second image of another than this fraction of
# the room between them [1]. Larger: a body could touch an image that nothing looks at.
PERIODIC_ROOM = 0.25

# Times that islands are joined within one substep before it is bisected, and how often it is bisected before it is
# taken as it is: islands with more impacts then freeze until its end. Fewer: `unresolved` counts sooner.
MAX_ISLAND_ROUNDS = 40
MAX_SUBSTEP_BISECTIONS = 5

# Where nothing touches anything for MIN_STRETCH substeps, bodies go there in one stretch, of MAX_STRETCH substeps at
# most, as a body of three different moments turns in steps. Fewer: little is saved, and a look that ends at the first
# pair that meets sooner goes on for longer where bodies are crowded. It is asked again after ASK_AGAIN substeps, and
# only where the square of the number of bodies is no more than MAX_PAIRS_AT_ONCE: so many are looked at in less time
# than a substep takes.
MIN_STRETCH = 32
MAX_STRETCH = 1_000_000
ASK_AGAIN = 500
MAX_PAIRS_AT_ONCE = 40_000

# A time step of more substeps than this is refused: they would take hours.
MAX_SUBSTEPS = 10_000_000

# ---- neighbour lists -----------------------------------------------------------------------------------------------

# A body may get this fraction of its radius away from its reference position before neighbours are searched anew, and
# SKIN_SUBSTEPS times as far as it flies in one substep more [1]. Larger skins make longer lists, which take time in
# every substep and memory; smaller ones must be made more often.
VERLET_SKIN = 0.6
SKIN_SUBSTEPS = 1.5

# A body that strayed gets a skin for its greatest speed all through the substep, larger by this factor [1]. 1 would
# be enough but for rounding.
STRAYED_SKIN = 1.1

# Neighbour searches between two sorts of the bodies along the space-filling curve. Bodies move far slower than that
# across the curve; fewer only cost the sort.
SEARCHES_PER_SORT = 16

# ---- work shared between threads -----------------------------------------------------------------------------------

# What an island, and a closer look at a pair, cost in units of the work on one body. They only decide from which
# number on threads are woken, and never the result.
ISLAND_COST = 32
PAIR_COST = 16

# Bodies whose speeds are summed at a time. Sums depend on their order: this must not depend on the number of threads.
SUM_BLOCK = 4096

# ---- continuous collision detection --------------------------------------------------------------------------------

# An impact is placed where the separation is between 0 and this fraction of the sizes of the two [1]: an order above
# the rounding of positions in a domain a thousand sizes wide. Smaller: bodies overlap by rounding when they go on.
IMPACT_TOLERANCE = 1e-12

# Steps of conservative advancement in one search, which ends where it is then. Few searches take more than ten.
MAX_ADVANCEMENTS = 60

# The motion of the normal that was best in the last step is tried alone as long as each step leaves at most this
# fraction of the gap [1]. Larger: more steps; smaller: all motions are tried at most steps.
KEEP_NORMAL_MOTION = 0.25

# Refinements of a conservative step, which is shorter than it could be where other vertices come to the fore.
STEP_REFINEMENTS = 3

# ---- impacts -------------------------------------------------------------------------------------------------------

# Slower than this fraction of the surface speeds involved, a contact does not approach [1]: it is rounding. Larger:
# slow impacts are missed and bodies sink in; smaller: rounding is taken for impacts without end.
APPROACH_TOLERANCE = 1e-12

# Impacts of the same bodies apart by less than this fraction of a substep happen at once [1]: some digits above the
# rounding of times; the displacement meanwhile is less than 1e-10 of a size.
SIMULTANEOUS = 1e-12

# Impulses given to one contact manifold in one impact: its middle, then whichever corner still approaches.
MAX_MANIFOLD_IMPULSES = 64

# While a point slides in an impact, its sliding velocity changes by this fraction in one step of quadrature, more where
# it is small by now [1]: of an error of order 7 some 1e-12 is left. Larger: the turning of the direction is less exact,
# energy still is not. It has stopped at the second fraction of the velocity of the impact. Hardly one takes 200 steps.
SLIP_STEP = 0.1
STOPPED = 1e-12
MAX_SLIP_STEPS = 10_000

# Sweeps over the points of a patch that lands with friction; they end when the impulses of a sweep change by less than
# this fraction of all. Faces of boxes take some 45; one in fifty, at the edge between sticking and sliding, takes all.
# Fewer: what still approaches gets another impact. Sweeps that did not halve the change so many times go a shorter way,
# by the factor; without that one in a hundred towers with a friction of 3 goes round in circles. The fraction of the
# energy by which sweeps that ended otherwise may be off: more, and the patch is resolved point by point.
MAX_PATCH_SWEEPS = 500
PATCH_CONVERGED = 1e-14
PATCH_ACCEPTED = 1e-6
IDLE_SWEEPS = 60
SHORTER_SWEEPS = 0.7

# Impacts of an island within one substep, for each of its bodies, before the substep is cut; and the same for slow
# impacts of what comes to rest: the next substep takes all their contacts together.
MAX_IMPACTS = 1000
MAX_SLOW_IMPACTS = 100

# Bodies that touch and part, or hardly move, may sink into each other by this fraction of their sizes before they
# count as touching again [1]: it bounds the number of impacts between two that roll over each other or lie still. The
# second where gravity brings things to rest: few impacts pass between a jolt and the next rest. Larger: more overlap.
PENETRATION_SLOP = 4e-7
RESTING_PENETRATION_SLOP = 1e-5

# ---- resting contacts: which -----------------------------------------------------------------------------------------

# Under gravity, what meets more slowly than by a fall from this fraction of its inscribed radius comes to rest [1]: its
# bounces, if not ended, would be infinitely many in finite time, and are lower than can be seen. Larger: visible
# bounces are lost; smaller: more impacts before rest.
RESTITUTION_THRESHOLD_HEIGHT = 1e-3

# What rebounds in full rests only if it is this much slower and nearer than what does not [1]: energy is kept to 1e-14.
LOSSLESS_REST = 1e-6

# Faces and edges inclined by less than this rest on each other along a patch [sine]: about what a face is inclined by
# when one of its edges lies and the other is a few threshold heights away. And by more than the second they never do,
# however fast they turn.
RESTING_PARALLEL_TOLERANCE = 1e-2
MAX_PARALLEL_TOLERANCE = 0.2

# Faces and edges reach this fraction of the inscribed radius beyond their borders at most [1]: what may slide there.
MANIFOLD_MARGIN = 0.02

# Contact points are looked for as far ahead as bodies come that are this much faster than expected [1]. Smaller: more
# substeps are searched twice; larger: more contact points.
SPEED_MARGIN = 2.0

# The fraction of a neighbour's speed that a body is expected to take on, and by how many times the speed that gravity
# adds in a substep it may become faster [1]. With SPEED_MARGIN nearly all are foreseen; the rest costs a second search.
SPEED_HANDED_ON = 0.3
SPEED_GAIN = 4.0

# Searches of the active set in a substep, until no body becomes faster than expected; and of velocities in each, as
# long as bodies would sink in with those that were found. Fewer: `unresolved` counts sooner.
MAX_ACTIVE_SET_SEARCHES = 5
MAX_CORRECTIONS = 5

# While anything rests, surfaces of what is pressed move by this fraction of the inscribed radius in a substep [1]:
# paths bend by its square. No substep is shorter for it than the second fraction of what it is where all lie still.
RESTING_DISPLACEMENT = 0.01
SHORTEST_RESTING_SUBSTEP = 0.25

# ---- resting contacts: the projected solver --------------------------------------------------------------------------

# Sweeps over all contact points in a substep: as many as make this number of visits to points, which takes a
# millisecond, but MIN_SWEEPS at least. Thus few points, such as those of a tower, are done to rounding; a large heap
# starts from the forces of the substep before and gets better from one to the next. There are more sweeps while some
# point would sink in farther than it may by more than a fraction URGENT_PENETRATION of the inscribed radius. Hardly a
# substep needs MAX_SWEEPS: of a pour of 2,001 bodies one in ten thousand.
SWEEP_VISITS = 30_000
MIN_SWEEPS = 12
MAX_SWEEPS = 500
URGENT_PENETRATION = 2.4e-5

# Sweeps end when no normal velocity changes by more than this fraction of what gravity adds in the substep [1].
SWEEP_CONVERGED = 1e-9

# Energy gained, as a fraction of what lifts all bodies by their radii, that is rounding [1].
ENERGY_ROUNDING = 1e-13

# Bodies come to rest this fraction of the inscribed radius apart [1]. What sweeps leave undone they sink into this
# slack first, and into each other by DEEPEST_REST and a few times URGENT_PENETRATION. Neither can be seen; what touches
# is nearer than the threshold height. In one substep a point may sink by SLACK_SHARE of what is left to it. Where
# nothing is left, all but a tenth of what URGENT_PENETRATION leaves free is taken away: in a heap nearly at rest
# nothing gives the energy to lift what has sunk.
REST_SLACK = 2e-4
DEEPEST_REST = 3e-5
SLACK_SHARE = 0.25
LEAST_SLACK = -0.9 * URGENT_PENETRATION

# Contact points that have sunk in are lifted by this fraction of their depth in a substep [1]. 1 would make heaps jump.
LIFT_SHARE = 0.2

# ---- resting contacts: correction at the end of the substep ----------------------------------------------------------

# Velocities are sought anew for bodies that end up overlapping by this fraction of the inscribed radius, and by the
# second more than they are [1]: what overlaps already is commonly let sink by less than that in a substep.
CORRECTED_PENETRATION = 1e-4
CORRECTED_SINKING = 4e-5

# Gaps differ from what was expected by less than this fraction of the displacement of surfaces against each other [1]:
# more than what features of a manifold are inclined by, and commonly more than bodies turn by in a substep.
GAP_MISJUDGED = 0.3

# Vertices that reach as far as the farthest but for this fraction of the size reach as far [1].
LEVEL_VERTICES = 1e-6
