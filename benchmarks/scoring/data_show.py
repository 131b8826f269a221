"""A trajectory in the terminal, turn by turn."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from er_gym.data.trajectory import Trajectory, Turn

_STYLES = {
    "analysis": "blue",
    "reasoning": "magenta",
    "planning": "cyan",
    "reflection": "yellow",
    "verification": "green",
}


def print_trajectory(trajectory: Trajectory, console: Console) -> None:
    """Print a trajectory: the task, then thoughts, action and result of each turn."""
    told = " ".join(filter(None, (trajectory.kind, trajectory.mode)))
    console.print(Text(trajectory.instruction, style="bold"), soft_wrap=True)
    console.print(
        Text(
            f"{trajectory.id}: {trajectory.task_type}, {trajectory.scene}, part "
            f"{trajectory.part or '-'}, kind {told}, {trajectory.actor}, seed {trajectory.seed}",
            style="dim",
        ),
        soft_wrap=True,
    )
    for index, turn in enumerate(trajectory.turns):
        console.print()
        shown = ", ".join(picture.direction for picture in turn.pictures) or "no picture"
        heading = f"Turn {index}, {turn.purpose} ({shown}{'' if turn.train else '; not learnt'})"
        console.print(Text(heading, style="bold"), soft_wrap=True)
        for thought in turn.thoughts:
            line = Text(f"  {thought.kind}: ", style=_STYLES[thought.kind])
            line.append(thought.text, style="default")
            console.print(line)
        console.print(Text(f"  > {turn.action}  {result_of(turn)}"))
    done = "done" if trajectory.success else "not done"
    console.print(Text(f"\nThe task is {done} ({trajectory.end_reason}).", style="bold"))


def result_of(turn: Turn) -> str:
    """What came of a turn's action, in a line."""
    earned = f" +{turn.reward:g}" if turn.reward else ""
    fault = f" [fault: {turn.fault}]" if turn.fault else ""
    return f"{'ok' if turn.success else 'failed'}{earned}{fault}: {turn.feedback}"
