"""Starts the player: the launcher that ``player_install`` writes runs this file by its path.

Do not import this module. Importing ``er_gym`` would register the environments, which takes as long
as the rest of the start. This file therefore puts an empty package of that name in its place, in
which only the engine is found.
"""

import sys
from pathlib import Path
from types import ModuleType

_PACKAGE = Path(__file__).resolve().parents[1]
sys.path[0] = str(_PACKAGE.parent)  # not this folder, whose modules are nobody's top level
_bare = ModuleType("er_gym")
_bare.__path__ = [str(_PACKAGE)]
sys.modules["er_gym"] = _bare

if __name__ == "__main__":
    from er_gym.sim.player_process import main

    sys.exit(main())
