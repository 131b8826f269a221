"""Draw rooms.png, the README's picture: one room of each kind, as an episode begins.

``python docs/images/make_rooms.py`` (needs Pillow).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from er_gym import EmbodiedEnv
from er_gym.tasks.suites import load_suite

SCENES = ("FloorPlan1", "FloorPlan203", "FloorPlan301", "FloorPlan403")


def main() -> None:
    """Write the picture beside this file."""
    any_task = load_suite("mini").tasks[0]
    env = EmbodiedEnv([], obs_mode="rgb")
    frames = []
    for scene in SCENES:
        task = type(any_task)("picture", any_task.type, scene, "", any_task.key_actions)
        frames.append(env.reset(options={"task": task})[0]["rgb"])
    env.close()
    sheet = np.vstack([np.hstack(frames[:2]), np.hstack(frames[2:])])
    picture = Image.fromarray(sheet).resize((1000, 563), Image.Resampling.LANCZOS)
    picture.quantize(64).save(Path(__file__).with_name("rooms.png"), optimize=True)


if __name__ == "__main__":
    main()
