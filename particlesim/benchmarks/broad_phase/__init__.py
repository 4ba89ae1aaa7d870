"""The performance comparison of the broad phases: on a scene, on a sweep over the number of boxes, on a stream.

The paper that this program grew from promises one and does not give it: S. Goodwin, "Analysis of Efficient Collision
Detection using Pre-Processing Data Structures".  ``compare_scene`` also proves what makes the comparison fair: that
all broad phases find the same pairs and lead to the same trajectory, to the last bit.
"""

from particlesim.benchmarks.broad_phase.runs import SceneComparison, compare_frames, compare_scene
from particlesim.benchmarks.broad_phase.sweep import KINDS, Sweep, sweep

__all__ = ["KINDS", "SceneComparison", "Sweep", "compare_frames", "compare_scene", "sweep"]
