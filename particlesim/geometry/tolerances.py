"""Every tolerance of the geometry: its unit, its reason, and what goes wrong if it is changed.

"Size" is the extent of a shape, or the sum of the bounding radii of a pair; a fraction of it has no unit. Double
precision rounds at 1e-16 of the numbers involved, and a sum of products of coordinates is off by a few times that.
"""

# --- Building shapes: vertices that a file or a user gave ------------------------------------------------------------

# Fraction of the extent below which a difference of vertices is rounding: mesh files hold float32 or six digits. A
# vertex that stands out by less is dropped; triangles within it of the plane of a larger neighbour are one face.
# Larger: real edges of meshes vanish. Smaller: a flat side of a mesh file becomes hundreds of faces. The next ones are
# for bodies that are no longer convex then, such as a thin curved plate.
VERTEX_ROUNDINGS = (1e-6, 1e-8, 1e-10, 1e-12)

# Angle [rad] between normals above which triangles are two faces, however thin the shape (a needle is thinner than
# rounding). Larger: the sides of thin plates merge. Smaller: slivers, whose normals are uncertain, stay apart.
SAME_FACE_ANGLE = 0.1

# Fraction of the extent by which corners may lie off the plane of their face when the faces have been made plane.
# Larger: the manifold of faces on faces is off by it. Smaller: rounding is never below it, and the shape is refused.
FLAT_FACE = 1e-14

# Fraction of the largest moment below which products of inertia are rounding: the axes are principal already, and a
# cube keeps the axes it was described in. Smaller: shapes with equal moments turn into arbitrary axes.
PRINCIPAL_AXES = 1e-12

# The most corners of a mesh; one of more is thinned, but keeps the mass properties of the whole. Larger: pictures of
# crowds look at more faces. Smaller: round meshes lose their curvature; a ball of so many is off by 4e-4 of its radius.
MAX_MESH_VERTICES = 4096

# Height of a triangle of a mesh as a fraction of its longest side below which it has no area: its normal is rounding.
# Larger: slits of that width open in surfaces. Smaller: normals of slivers point anywhere.
FLATTEST_TRIANGLE = 1e-8

# The most triangles of a mesh, which take 0.8 kB each. More: memory.
MAX_TRIANGLES = 500_000

# --- Support: how far a core reaches ---------------------------------------------------------------------------------

# Cores of so many vertices or more are climbed along their edges, others gone through one by one: of 96 that takes
# 71 ns, a climb 77 ns, and 100 ns of 4,000. The same vertex is found either way, so only the time changes.
CLIMBED_VERTICES = 112

# Climbs begin at a vertex looked up by the direction, in CELLS x CELLS cells on each face of a cube. Larger: tables
# that take longer to make. Smaller: longer climbs.
CELLS = 8

# --- GJK: distance of cores that are apart ---------------------------------------------------------------------------

# Fraction of the distance by which a vertex of the difference body may be nearer than the simplex when the search
# ends. Larger: distances lose digits, and impacts are placed wrongly. Smaller: rounding never gets there.
GJK_GAP = 1e-15

# The most steps of a search. Every step shortens the distance or turns the direction; hulls of thousands of corners
# take some 30 steps. Fewer: round hulls are cut short and count as touching.
GJK_MAX_STEPS = 256

# The most steps that turn the direction without shortening the distance; more go round in circles.
GJK_MAX_IDLE = 8

# Uncertainty of a distance as a fraction of its own length: some units in the last place. Smaller: proven distances
# are thrown away as unproven.
GJK_ROUNDING = 1e-14

# Fraction of the sizes below which the yes-or-no test says that cores touch. Smaller: it may contradict the
# separation where that is rounding. Larger: near misses count as contacts.
TOUCHING = 1e-10

# Fraction of the sizes below which the distance of cores is rounding: the separating-axis test takes over. Larger:
# the separation jumps there. Smaller: GJK's direction is noise.
JOINED = 1e-13

# --- Separating axes: depth of cores that overlap --------------------------------------------------------------------

# Sine of the angle below which two edges give no direction worth having: a face normal is as good. Larger: depths of
# nearly parallel edges are missed. Smaller: directions made of rounding.
PARALLEL_EDGES = 1e-10

# Fraction of the sizes by which an edge pair must beat the best face: ties go to faces, whose contact is a patch.
# Smaller: stacked boxes touch at a point. Larger: depths are off by it.
FACE_FIRST = 1e-14

# --- Expanding polytope: the same of cores of many edges -------------------------------------------------------------

# From so many pairs of edges on the polytope is grown, which takes 3 to 10 us, where a look at all takes 2 us for two
# cubes (144 pairs), 14 us for 3,000 pairs and 5 ms for hulls of 500 corners. Both are as exact.
MANY_EDGE_PAIRS = 500

# Fraction of the sizes by which the difference body may reach beyond the nearest face of the polytope when that counts
# as a face of the body. Larger: depths are off by it. Smaller: rounding never gets there.
POLYTOPE_GAP = 1e-14

# Fraction of the sizes by which a point must stand out from a face that it takes the place of, and of the sides of a
# triangle below which its height is rounding. Larger: faces stay that are none. Smaller: slivers of rounding alone.
POLYTOPE_ROUNDING = 2e-16

# The most points that the polytope grows by; where that is not enough, all pairs of edges are looked at after all. It
# takes some 20 to 60 where bodies touch, as many as they have corners where their centres meet.
MAX_EXPANSIONS = 1000

# --- Sphere against polyhedron ---------------------------------------------------------------------------------------

# Fraction of the size within which a centre counts as on an edge or vertex: the normal is that of a face there, as
# the direction from the nearest point is mostly rounding. Larger: normals jump at edges.
ON_SURFACE = 1e-10

# --- Contact manifolds -----------------------------------------------------------------------------------------------

# The most corners of a face that are clipped, evenly spread: a manifold keeps few. It is the size of buffers. Smaller:
# the patch of a round face ends before its border, by the square of the angle between the corners.
MAX_FACE_CORNERS = 96

# Sine of the angle below which two faces, edges, or an edge and a face touch along a patch, not at a point. Points of
# the patch are off by at most its product with the size; rounding turns a face by about 1e-15. Smaller: boxes put on
# each other tip. Larger: points lie off the bodies. Resting contacts have a tolerance of their own, far larger.
PARALLEL_TOLERANCE = 1e-8

# Fraction of the length of an edge by which corners outside of it still lie on the face: rounding, and edges that
# coincide. Smaller: a box on a box of the same size loses corners of its patch.
ON_EDGE = 1e-9

# Of more corners near a plane than a manifold has points, those are kept that are farthest out, but as much nearer to
# the plane as this slope [1] where they are less far out. Larger: what rolls on a fine mesh lacks the corners next to
# the lowest; smaller: what lies flat but for rounding lies on corners of one side, and rocks.
SPREAD_SLOPE = 1e-2

# --- Triangle meshes -------------------------------------------------------------------------------------------------

# Triangles of a leaf of the tree over a mesh at most. It only decides how long a search takes.
TRIANGLES_OF_LEAF = 4

# Sine of the angle by which a normal may lean over a triangle that lies beside the one it is of, and from the normal of
# a face that it is the same as [1]. Larger: what slides catches on inner edges, as so much of its speed is towards
# them. Smaller: rounding, in a mesh a million times as large as what touches it, hides real contacts.
NORMAL_SINE = 1e-8

# How far above a smooth place on a part of a compound another part hides it, as a fraction of the radius about it [1].
# Larger: faces beside steps lower than that are lost. Smaller: faces that two parts share are walls inside of them.
HIDDEN_ABOVE = 1e-6

# Fraction of the extent of a patch on several triangles by which a point must stand out from the others to be a corner:
# two orders above ON_EDGE, by which points of neighbouring triangles differ. Smaller: corners are there twice, and a
# box that lands flat starts to spin. Larger: patches lose corners.
PATCH_CORNER = 1e-7
