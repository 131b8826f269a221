"""Agents for tests of the executors; a module, for spawned processes to import."""

from __future__ import annotations

from er_gym.rollout.agent import CannotGoOn, Decision, ModelReply


class Ending:
    """Ends the episode at once."""

    obs_mode = "text"

    def reset(self, task, obs, info):
        pass

    def act(self, obs, info):
        return Decision("end", thought="done", reply=ModelReply("m", 0.5, 7, 2, 0.01))


class Broke(Ending):
    """Cannot go on."""

    def act(self, obs, info):
        raise CannotGoOn("the budget is spent")


class Surrogate(Ending):
    """Says what no UTF-8 file can hold, as models do; and crashes with such a message."""

    def act(self, obs, info):
        if info["steps"] > 1:
            raise ValueError("\ud800")
        return Decision("observe", thought="\ud800")


class Leaving(Ending):
    """Leaves files."""

    def __init__(self, files, folders=("notes",)):
        self.files, self.attachment_folders = files, folders

    def attachments(self, episode, stem):
        return self.files() if callable(self.files) else self.files


def ending(task, seed):
    return Ending()


def broke_at_last(task, seed):
    return Broke() if task.id == "paper-2" else Ending()
