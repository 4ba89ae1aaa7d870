"""``python -m particlesim.jobs.wheel WHEEL``: put compiled kernels into a wheel, for a first movie that starts at once.

The new wheel is for this version of Python, this system, and processors from 2013 on. On older ones, and with another
version of numba, kernels are compiled as ever.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

from particlesim.core.ready_made import READY_MADE, compile_for_level

_COMPILE = """
from particlesim.jobs.compiling import compile_kernels
from particlesim.scene import Scene
scene = Scene(world={"size": [1, 1, 1]}, particles=[{"shape": "sphere", "count": 1}])
compile_kernels(scene, scene, print)
"""


def main(wheel: Path) -> None:
    """Write a wheel with kernels beside one without."""
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder, "cache")
        compile_for_level()
        subprocess.run([sys.executable, "-c", _COMPILE], env=os.environ | {"NUMBA_CACHE_DIR": str(cache)}, check=True)
        _wheel("unpack", wheel, "--dest", folder)
        (unpacked,) = Path(folder).glob("particlesim-*")
        for compiled in (cache / "particlesim" / "kernels").glob("*/*/"):
            # Numba names the inner folder after the path of the source, which will be another.
            shutil.copytree(compiled, unpacked / "particlesim" / READY_MADE.name / compiled.parent.name)
        _wheel("pack", unpacked, "--dest-dir", folder)
        python = f"cp{sys.version_info.major}{sys.version_info.minor}"
        system = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        _wheel("tags", "--python-tag", python, "--abi-tag", python, "--platform-tag", system, Path(folder, wheel.name))
        (tagged,) = Path(folder).glob(f"*-{python}-{python}-*.whl")
        shutil.copy(tagged, wheel.parent)
        print(wheel.parent / tagged.name)


def _wheel(*arguments: str | Path) -> None:
    subprocess.run([sys.executable, "-m", "wheel", *map(str, arguments)], check=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
