"""Collects trajectories (pictures, thoughts, actions) and reads them.

    python examples/trajectories.py [FOLDER]
    er-gym data export FOLDER --to trl --out files

The second line makes training files of them.
"""

import subprocess
import sys
from pathlib import Path

from PIL import Image

from er_gym.data.collection import Collection

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "trajectories")

# The same as on the command line: er-gym collect --suite mini --limit 2 --out FOLDER
collect = [sys.executable, "-m", "benchmarks.cli", "collect"]
subprocess.run([*collect, "--suite", "mini", "--limit", "2", "--out", folder], check=True)

for trajectory in Collection.open(folder).trajectories():
    print(f"\n{trajectory.instruction} ({trajectory.scene}, by the {trajectory.actor})")
    for turn in trajectory.turns:
        for picture in turn.pictures:
            pixels = Image.open(folder / picture.path)
            print(f"  [{pixels.width} x {pixels.height} picture, {picture.direction}]")
        for thought in turn.thoughts:
            print(f"  {thought.kind}: {thought.text}")
        print(f"  => {turn.action}" + ("" if turn.train else "  (not to be learnt)"))
    print(f"  success: {trajectory.success}")
