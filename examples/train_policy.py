"""Trains a policy with PPO, all in this file: in half a minute, its return rises to nearly 2.

``python examples/train_policy.py [UPDATES]`` needs PyTorch: ``pip install 'er-gym[rl]'``. It learns
the 12 tasks by heart; what ``er-gym train-rl`` trains also does others, in rooms it has never seen.
"""

import sys

import gymnasium
import torch
from torch import distributions, nn

import er_gym  # noqa: F401  (registers the environments)

UPDATES = int(sys.argv[1]) if len(sys.argv) > 1 else 30
STEPS, EPOCHS, GAMMA, LAMBDA, CLIP, ENTROPY = 512, 4, 0.97, 0.95, 0.2, 0.01

torch.manual_seed(0)
env = gymnasium.make("ER-SingleSearch-v0", obs_mode="state")
inputs, actions = env.observation_space["state"].shape[0], int(env.action_space.n)
network = nn.Sequential(nn.Linear(inputs, 128), nn.Tanh(), nn.Linear(128, actions + 1))
optimizer = torch.optim.Adam(network.parameters(), lr=1e-3)


def policy(states, masks):
    """The distribution over the legal actions of each state, and the value of the state."""
    logits, values = network(states).split([actions, 1], dim=-1)
    logits = logits.masked_fill(masks == 0, -1e9)
    return distributions.Categorical(logits=logits), values.squeeze(-1)


obs, info = env.reset(seed=0)
for update in range(1, UPDATES + 1):
    batch = []  # 1. Play.
    for _ in range(STEPS + 1):  # the last step is there for the value of its state
        state, mask = torch.tensor(obs["state"]), torch.tensor(info["action_mask"])
        with torch.no_grad():
            chances, value = policy(state, mask)
        action = chances.sample()
        obs, reward, terminated, truncated, info = env.step(action.item())
        reward, alive = torch.tensor([reward, 1.0 - (terminated or truncated)])
        batch.append((state, mask, action, chances.log_prob(action), value, reward, alive))
        if not alive:
            obs, info = env.reset()
    states, masks, acts, before, values, rewards, alive = map(torch.stack, zip(*batch, strict=True))
    advantages = torch.zeros(STEPS + 1)  # 2. Estimate advantages (GAE), the last one first.
    for t in reversed(range(STEPS)):
        error = rewards[t] + GAMMA * alive[t] * values[t + 1] - values[t]
        advantages[t] = error + GAMMA * LAMBDA * alive[t] * advantages[t + 1]
    for part in torch.randperm(STEPS).repeat(EPOCHS).split(128):  # 3. Learn.
        chances, value = policy(states[part], masks[part])
        ratio = (chances.log_prob(acts[part]) - before[part]).exp()
        clipped, gain = ratio.clamp(1 - CLIP, 1 + CLIP), advantages[part]
        loss = -torch.min(ratio * gain, clipped * gain) - ENTROPY * chances.entropy()
        loss += (values[part] + gain - value) ** 2 / 2
        optimizer.zero_grad()
        loss.mean().backward()
        optimizer.step()
    print(f"update {update}: mean return {rewards.sum() / (1 - alive).sum():.2f}", flush=True)
