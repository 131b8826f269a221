"""An agent of your own: it fetches what the instruction names, and looks everywhere for it.

    python examples/own_agent.py
    er-gym bench --suite mini --types single_pickup --agent examples.own_agent:Fetcher

The second line plays the same tasks on the command line, and keeps what happens in a run directory.
"""

import er_gym
from er_gym.rollout.agent import Decision


class Fetcher:
    """Picks up the thing if it is in reach, else opens what is shut, else goes somewhere new."""

    obs_mode = "text"  # the observations that it wants; "rgb+text" has pictures too

    def reset(self, task, obs, info):
        """Begin an episode. ``info`` is the environment's, joined with ``env.details``."""
        self.wanted = task.instruction.lower().replace(" ", "")
        self.tried = set()

    def act(self, obs, info):
        """Decide on an action: an ``Action`` as in ``info["legal"]``, its text or its index."""
        if info["held"]:
            return Decision("end", thought="I have it.")
        for action in info["legal"]:
            if action.verb == "pickup" and action.object_type.lower() in self.wanted:
                return Decision(action, thought="There it is.")
        for verb in ("open", "navigate to"):
            for action in info["legal"]:
                if action.verb == verb and action not in self.tried:
                    self.tried.add(action)
                    return Decision(action, thought="It may be there.")
        return Decision("observe", thought="What else is here?")


def main():
    """Play the pickups of the suite mini."""
    agent = Fetcher()
    env = er_gym.EmbodiedEnv(obs_mode=agent.obs_mode)
    tasks = [t for t in er_gym.load_suite("mini").tasks if t.type.name == "single_pickup"]
    episodes = [er_gym.play_episode(env, agent, task, seed=0) for task in tasks]
    env.close()
    for episode in episodes:
        actions = ", ".join(step.text for step in episode.predicted)
        print(f"{episode.instruction}\n    {actions}\n    success: {episode.success}")
    print(f"{sum(episode.success for episode in episodes)} of {len(episodes)} tasks done")


if __name__ == "__main__":
    main()
