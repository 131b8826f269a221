"""A reward of your own: a wrapper that pays for each type of object seen for the first time.

    python examples/own_reward.py
    er-gym train-rl --config single_search --reward examples.own_reward:Curiosity

The second line trains a policy with it.
"""

import gymnasium

import er_gym  # noqa: F401  (registers the environments)


class Curiosity(gymnasium.Wrapper):
    """Adds ``bonus`` for each type of object that was not seen before in the episode."""

    def __init__(self, env, bonus=0.05):
        super().__init__(env)
        self.bonus = bonus

    def reset(self, **options):
        """Begin an episode; what is seen at once earns nothing."""
        obs, info = self.env.reset(**options)
        self.seen = info["visible_mask"].astype(bool)  # (types,): 1 for each type in view
        return obs, info

    def step(self, action):
        """Do an action."""
        obs, reward, terminated, truncated, info = self.env.step(action)
        new = info["visible_mask"].astype(bool) & ~self.seen
        self.seen |= new
        return obs, float(reward + self.bonus * new.sum()), terminated, truncated, info


def main():
    """Play an episode at random, and print the rewards."""
    env = Curiosity(gymnasium.make("ER-SingleSearch-v0", obs_mode="text"))
    env.action_space.seed(0)
    _, info = env.reset(seed=0)
    print(info["instruction"])
    done = False
    while not done:
        action = env.action_space.sample(info["action_mask"])  # one of the legal actions
        _, reward, terminated, truncated, info = env.step(action)
        print(f"{info['action']}: {reward:.2f}")
        done = terminated or truncated
    env.close()


if __name__ == "__main__":
    main()
