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
# taken as it is: islands with more impacts then freeze until its end, and lasting contacts that were not foreseen are
# seen in the next. Fewer: `unresolved` counts sooner.
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

# What is touched of a mesh at the time of an impact is nearer than this fraction of the particle's size [1]: two orders
# above the tolerance of impacts, for what touches at one time touches in one place by rounding earlier than in another.
# Larger: triangles that are met a moment later count as met now. Smaller: a box that lands flat tips over.
MESH_TOUCH = 1e-10

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

# Impacts of an island within one substep, for each of its bodies, before the substep is cut; before its bodies are in
# lasting contact, where impacts lose energy: an infinite sequence of them may have begun (moments in which what touches
# does not approach count as well, which comes again as soon as it turns); and the same for slow impacts
# of what comes to rest: the next substep takes all their contacts together.
MAX_IMPACTS = 1000
FEW_IMPACTS = 16
MAX_SLOW_IMPACTS = 100

# Bodies that touch and part, or hardly move, may sink into each other by this fraction of their sizes before they
# count as touching again [1]: it bounds the number of impacts between two that roll over each other or lie still. The
# second where gravity brings things to rest: few impacts pass between a jolt and the next rest. Larger: more overlap.
PENETRATION_SLOP = 4e-7
RESTING_PENETRATION_SLOP = 1e-5

# ---- lasting contacts: which -----------------------------------------------------------------------------------------

# Under gravity, what meets more slowly than by a fall from this fraction of its inscribed radius comes to rest [1]: its
# bounces, if not ended, would be infinitely many in finite time, and are lower than can be seen. Larger: visible
# bounces are lost; smaller: more impacts before rest.
RESTITUTION_THRESHOLD_HEIGHT = 1e-3

# What rebounds in full rests only if it is this much slower and nearer than what does not [1]: energy is kept to 1e-14.
LOSSLESS_REST = 1e-6

# The longest substep where anything is in lasting contact, or falls and may come to be [s]: that of engines. Longer:
# what is struck within it has moved at its new velocity from the start; shorter: more substeps.
LASTING_STEP = 1.0 / 240.0

# How often a substep is parted where bodies begin to have too many impacts, which are in lasting contact from then on,
# before it is bisected; and the smallest part of it that is taken by itself before [1].
MAX_LASTING_ROUNDS = 4
LEAST_PART = 1e-6

# Faces and edges inclined by less than this rest on each other along a patch [sine]: about what a face is inclined by
# when one of its edges lies and the other is a few threshold heights away. And by more than the second they never do,
# however fast they turn.
RESTING_PARALLEL_TOLERANCE = 1e-2
MAX_PARALLEL_TOLERANCE = 0.2

# Normals of triangles of a mesh that differ by less are one in a lasting contact, and planes of them that are apart by
# less than four times this fraction of the bounding radius [sine, 1]: files hold six digits. Larger: gentle slopes are
# steps of that height; smaller: a flat face of many triangles is as many contacts.
SAME_PATCH_SINE = 1e-5

# Faces and edges reach this fraction of the inscribed radius beyond their borders at most [1]: what may slide there.
MANIFOLD_MARGIN = 0.02

# By how much the velocity of a body may change in a step: by this fraction of that at which particles approach it [1],
# and by so many times what gravity adds [1]. Where bodies may have met that this does not show, contacts are searched
# once more, for changes larger by the third factor [1] than those expected and found. Smaller: more searches; larger:
# more contact points.
CHANGE_HANDED_ON = 0.5
SPEED_GAIN = 2.0
CHANGE_MARGIN = 1.5

# Searches of contacts in a substep, until no bodies may meet unforeseen, before it is bisected: a shock through a heap
# deflects more at each search. More: steps too long for the shock are tried longer; fewer: they are cut sooner.
MAX_CONTACT_SEARCHES = 4

# ---- lasting contacts: sleep -----------------------------------------------------------------------------------------

# What has moved on by less than the first fraction of its inscribed radius in so many times sqrt(bounding radius /
# gravity), in which it would fall by eight radii, sleeps if it is in balance [1]. What starts to fall, slide or tip by
# 1.3e-4 of its weight moves more. Larger or shorter: what moves ever so slowly is stopped; the other way round: heaps
# that tremble take longer to fall asleep.
SLEEP_WAY = 1e-3
SLEEP_TIME = 4.0

# It is in balance if forces and weight come to less than this fraction of what friction at its contacts can hold, or
# the last of its weight [1], and torques about its middle to no more at the bounding radius. It wakes after a step in
# which they come to more than the second, and where they come to more than the third the step is taken again with it
# awake. Larger: what leans on it more than before is not seen; smaller: more wakes about what is awake.
SLEEP_BALANCE = 0.02
WAKE_BALANCE = 0.06
WAKE_AT_ONCE = 0.5
SLEEP_LEAST_BALANCE = 1e-4

# Nor does it sleep while anything touches it that moves faster than by a fall from a millionth of an inscribed radius:
# this fraction of the speed of a fall from all of it [1]. Larger: what rolls over sleepers is felt late; smaller: heaps
# that tremble take longer to fall asleep.
SLEEP_SPEED = 1e-3

# ---- lasting contacts: the step --------------------------------------------------------------------------------------

# Parts of a substep in which gravity acts and gaps are followed. More: stacks and heaps are held better by as many
# sweeps in all, and first-order errors are smaller.
RESTING_SUBSTEPS = 4

# Pairs of sweeps over the contact points of an island in each part, along conjugate ways: as many as make this number
# of visits to points in the substep, which takes two milliseconds, but no more than MAX_SWEEPS. Few points, such as
# those of a tower, are done to rounding: all that push are solved together after every PAIRS_BETWEEN pairs of sweeps,
# by so many steps of conjugate gradients at most. That takes as long as thirty pairs: where it gets less than
# FAR_ENOUGH of its way [1], it is tried again after twice as many. Points whose friction is within this fraction of its
# limit slide [1]; a way is cut short by halves down to the last fraction where it leads out of a cone.
SWEEP_VISITS = 40_000
MAX_SWEEPS = 400
PAIRS_BETWEEN = 2
GRADIENT_STEPS = 60
FAR_ENOUGH = 0.5
STICKING = 1e-9
LEAST_SHARE = 1e-3

# Where that leaves FEW_SWEEPS pairs or less, there are twice as many single sweeps as the second in each of so many
# parts as the third, and nothing is solved together: a large heap starts from the forces of the part before and gets
# better from one to the next, and with half as many sweeps in twice as many parts it is held better. So few has a
# second answer, too, where impulses could grow for as long as they are looked for.
FEW_SWEEPS = 4
CONJUGATE_SWEEPS = 5
LARGE_SUBSTEPS = 8

# One in so many sweeps of a large heap visits all points; the others those that have pushed, and are moved. More: what
# begins to push is found later; fewer: points that have nothing to do take time.
SWEEPS_OF_ALL = 4

# Impulses that do less together than this fraction of what each does alone cancel each other [1].
SAME_IMPULSES = 1e-11

# Sweeps end when no velocity changes by more than this fraction of what gravity adds, or points approach by [1].
SWEEP_CONVERGED = 1e-10

# In large islands they end, too, when that velocity comes to less than this fraction of the smallest inscribed radius
# in a part of the substep [1]: a fifth of the depth that is corrected.
NEAR_SWEEP_CONVERGED = 2e-5

# A last sweep that changes a velocity by more than this fraction of what gravity adds in a substep, or of what sinks in
# by the depth that is corrected in a part of it, has left something undone that counts [1].
UNRESOLVED_VELOCITY = 1.0

# Bodies come to rest this fraction of the inscribed radius apart [1]. What sweeps leave undone they sink into this
# slack first. It cannot be seen; what touches is nearer than the threshold height.
REST_SLACK = 2e-4

# Turning bends paths, and so closes gaps sooner than velocities say: what it may close is kept free, up to this
# fraction of the inscribed radius [1].
MAX_TURNING_SLACK = 0.05

# Bodies may be in each other by this fraction of the inscribed radius at the end of a substep [1]. Those that would be
# deeper are pushed apart in so many rounds, each by the third fraction of the inscribed radius at most; contacts are
# searched anew if that may bring them to what none is known of. What was deeper before comes out by the last.
CORRECTED_DEPTH = 1e-4
CORRECTION_ROUNDS = 20
MAX_CORRECTION = 0.1
LIFT_SHARE = 0.3

# What would still be deeper than this fraction of the inscribed radius is held back [1]: a few times in proportion,
# then it stays where it was. Smaller: heaps in motion falter.
HELD_BACK_DEPTH = 1e-3
TIMES_HELD_BACK = 4

# Bodies that have turned by less in a substep [rad] have moved as if they turned with their velocities of the start.
SMALL_TURN = 1e-3

# A normal is that of a face if the cosine between them is nearer to 1 than this [1].
SAME_NORMAL = 1e-9

# Vertices that reach as far as the farthest but for this fraction of the size reach as far [1].
LEVEL_VERTICES = 1e-6

# Edges that cross at less than this angle [sine] turn their normal too fast to be followed.
MIN_EDGE_SINE = 0.05

# Gaps that differ by this fraction of the inscribed radius are the same [1].
GAP_ROUNDING = 1e-9

# How often bodies are looked for that were struck, and so have moved at their new velocity: those next to them follow.
MEAN_VELOCITY_ROUNDS = 8

# Energy gained, as a fraction of the kinetic energy and what lifts all bodies by their radii, that is rounding [1]; and
# steps in which the impulses are found that gain none.
ENERGY_ROUNDING = 1e-13
ENERGY_STEPS = 12
