"""A prompt of your own for a model on a server, which plays some tasks with it.

    python examples/own_prompt.py http://127.0.0.1:8000/v1 MODEL

Any server of OpenAI's chat completions will do; OPENAI_API_KEY holds its key, if it needs one. The
packages are those of er-gym[vlm]. er-gym prompts copy FOLDER copies all prompts, to change more.
"""

import shutil
import sys
import tempfile
from pathlib import Path

import er_gym
from agents.factory import AgentFactory
from agents.vlm.settings import AgentSettings
from er_gym.tasks.config_folder import config_directory

SYSTEM = """You are a robot in a room. Think in one short sentence, then choose one action:
<Thinking>The mug may be in the fridge.</Thinking><DecisionMaking>open Fridge</DecisionMaking>
Your actions are:
{% for action in actions %}
- {{ action.form }}: {{ action.meaning }}
{% endfor %}
"""
"""The system message, a Jinja template; configs/prompts/README.md lists what it may say."""

if len(sys.argv) != 3:
    sys.exit(__doc__)
url, model = sys.argv[1:]
with tempfile.TemporaryDirectory() as folder:
    # A set of prompts is a folder of templates: er-gym's own, with another system message.
    shutil.copytree(config_directory("prompts") / "default", folder, dirs_exist_ok=True)
    Path(folder, "en", "system.jinja").write_text(SYSTEM)
    settings = AgentSettings(
        sees="text",  # for models without vision; "pictures" for the others
        prompts={"profile": folder},
        server={"base_url": url},
    )
    models = AgentFactory(f"openai:{model}", settings)

agent = models.agent(seed=0)
env = er_gym.EmbodiedEnv(obs_mode=agent.obs_mode, instances="explore")
for task in er_gym.load_suite("mini").tasks[:3]:
    episode = er_gym.play_episode(env, agent, task, seed=0)
    print(f"\n{task.instruction}")
    for step in episode.steps[1:]:  # the first places the agent
        print(f"    {step.thought}\n    {step.text} -> {step.feedback}")
    print(f"    success: {episode.success} {episode.gave_up or episode.error}")
env.close()
models.close()
