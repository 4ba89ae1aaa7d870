"""Public names and the modules they are in; ``lazy_loader`` reads them from here, and so do editors."""

from .broad_phase import find_pairs as find_pairs
from .geometry.separation import Pose as Pose
from .geometry.separation import Separation as Separation
from .geometry.separation import separation as separation
from .geometry.shapes import CATALOGUE as CATALOGUE
from .geometry.shapes import Shape as Shape
from .jobs.export import export as export
from .jobs.movie import render as render
from .jobs.movie import simulate as simulate
from .jobs.movie import still as still
from .jobs.shards import join as join
from .jobs.sweep.run import sweep as sweep
from .jobs.view import view as view
from .rendering import RenderError as RenderError
from .scene import Scene as Scene
from .scene.file import SceneError as SceneError
from .scene.file import load_scene as load_scene
from .simulation.checkpoint import CheckpointError as CheckpointError
from .simulation.simulation import Simulation as Simulation
from .simulation.soundness import SimulationError as SimulationError
from .trajectory.frames import Ledger as Ledger
from .trajectory.gsd_file import Trajectory as Trajectory
from .trajectory.gsd_file import TrajectoryError as TrajectoryError
from .trajectory.gsd_file import open as open

__version__: str
