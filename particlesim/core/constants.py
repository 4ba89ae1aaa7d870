"""Tags shared by every floor, and sizes that arrays are laid out by."""

# Kinds of shapes: the core of a sphere is a point, of a capsule a segment, of a polyhedron a convex hull; each may have
# a rounding radius. A half-space is what lies behind a plane: a wall of the box. A mesh is triangles, and a compound is
# convex shapes, each of which is a shape by itself; a ball is a sphere that need not be about the position of its body.
SPHERE = 0
CAPSULE = 1
POLYHEDRON = 2
HALF_SPACE = 3
MESH = 4
TRIANGLE = 5
COMPOUND = 6
BALL = 7

# Parts of a compound at most: each may have to be looked at with each of another's.
MAX_PARTS = 256

# Metres in the units of length that a mesh file may be in.
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}

# What happens to a particle at the two faces of the domain that bound an axis.
WALL = 0
PERIODIC = 1
OPEN = 2

# The six walls in the order of the ledger's wall impulses.
WALL_NAMES = ("-x", "+x", "-y", "+y", "-z", "+z")

# What takes energy, in the order of the ledger: impacts by their restitution, friction and rolling friction, and what
# comes to rest.
DISSIPATION = ("restitution", "friction", "rolling", "rest")

# The most points a contact manifold keeps, as two squares across each other have.
MAX_MANIFOLD = 8

# Pictures of a segment of a movie. Where segments begin must not depend on the clock, or a movie that was gone on with
# would have other bytes. Each begins with a whole picture, which makes a movie of particles 3 % larger; 30 make it 14 %
# larger.
SEGMENT = 60

# Endings of files of meshes, and how large one may be [bytes]: two million triangles of a binary STL. Their hull
# takes seconds, or minutes where they are round.
MESH_ENDINGS = (".stl", ".obj", ".ply")
LARGEST_MESH = 100_000_000

# Threads at the most that one may ask for: more than any machine has processors.
MOST_THREADS = 4096

# Endings of movies, .png of one as numbered pictures; the first is what is written if none is named.
MOVIE_ENDINGS = (".mp4", ".webm", ".gif", ".png")

# Those of them whose pictures may have no background.
TRANSPARENT_ENDINGS = (".webm", ".png")

# Endings of what runs are exported to; the first is what is written if none is named.
EXPORT_ENDINGS = (".pvd", ".glb", ".usda", ".xyz")

# What is told, with how many kernels of how many, while they are compiled.
COMPILING = "compiling, this once"
