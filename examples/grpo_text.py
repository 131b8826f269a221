"""Trains a language model with GRPO of TRL; er-gym environments execute its tool calls.

    python examples/grpo_text.py                                          # a tiny model, at random
    python examples/grpo_text.py --model FOLDER --steps 500 --tokens 6000

The model reads observations as text and acts by calling a tool; its reward is the sum of the
episode's rewards for key actions. Without ``--model`` it is 2 layers of random weights and a
tokenizer made on the spot: that shows how the parts fit together, and nothing is learned. Such a
model almost never writes a valid tool call, so its rewards are 0. If all rewards of a group are
equal, GRPO changes no weight. To learn, give a model that can call tools, with a chat template that
TRL knows, such as Qwen3's. The result of such training has not been tested.
"""

import argparse

import torch
from datasets import Dataset
from tokenizers import Tokenizer, decoders, models, pre_tokenizers, trainers
from transformers import PreTrainedTokenizerFast, Qwen3Config, Qwen3ForCausalLM
from trl import GRPOConfig, GRPOTrainer
from trl.chat_template_utils import qwen3_chat_template

from er_gym import EmbodiedEnv
from er_gym.envs.actions import ACTIONS
from er_gym.tasks.suites import load_suite

PROMPT = (
    "You are in a room and have a task to do there. Act by calling the tool, one action at a time, "
    "until the task is done; then do the action 'end'.\n\n"
)
"""What the model is told before the first observation, which TRL appends to it."""


class Room:
    """One rollout's environment, as TRL wants it.

    TRL makes one for each simultaneous rollout and reuses them for the next rollouts. It
    calls ``reset`` with a row of the data set. Every other public method is a tool, and what the
    model reads about it comes from its type hints and docstring.
    """

    def __init__(self):
        self.env = EmbodiedEnv("mini", obs_mode="text", instances="explore")

    def reset(self, task_id, **_):
        """Begin the task; the text is the first observation."""
        observation, _ = self.env.reset(options={"task": task_id})
        self.reward, self.done = 0.0, False
        return observation["text"]

    def act(self, action: str) -> str:
        """Do one action in the room.

        Args:
            action: "observe", "move forward" or "end"; or "navigate to", "pickup", "put in",
                "open", "close", "toggle" or "slice" with the type of an object, such as
                "navigate to Fridge".

        Returns:
            What came of it, and what you see, hold and can reach now.
        """
        if self.done:  # TRL does not stop the model from calling
            return "The episode is over."
        # Models write numbers too, and the environment would take one for an action's index.
        observation, reward, terminated, truncated, _ = self.env.step(str(action))
        self.reward += float(reward)
        self.done = terminated or truncated
        return observation["text"] + ("\nThe episode is over." if self.done else "")


def episode_reward(environments, **_):
    """Each rollout's reward; TRL passes the environments as the rollouts left them."""
    return [room.reward for room in environments]


def tiny_tokenizer(texts):
    """Byte-level BPE trained on some texts, with Qwen3's chat template.

    The template is TRL's copy, because TRL can parse tool calls only with a template that it knows
    exactly.
    """
    bpe = Tokenizer(models.BPE())
    bpe.pre_tokenizer = pre_tokenizers.ByteLevel(add_prefix_space=False)
    bpe.decoder = decoders.ByteLevel()
    bpe.train_from_iterator(
        texts,
        trainers.BpeTrainer(
            vocab_size=1024,
            special_tokens=["<|endoftext|>", "<|im_start|>", "<|im_end|>"],
            initial_alphabet=pre_tokenizers.ByteLevel.alphabet(),
            show_progress=False,
        ),
    )
    return PreTrainedTokenizerFast(
        tokenizer_object=bpe,
        pad_token="<|endoftext|>",
        eos_token="<|im_end|>",
        chat_template=qwen3_chat_template,
    )


def tiny_model(tokenizer):
    """A Qwen3 of about 120,000 random weights."""
    return Qwen3ForCausalLM(
        Qwen3Config(
            vocab_size=len(tokenizer),
            hidden_size=64,
            intermediate_size=128,
            num_hidden_layers=2,
            num_attention_heads=2,
            num_key_value_heads=1,
            head_dim=16,
            tie_word_embeddings=True,
        )
    )


def make_trainer(model, tokenizer, tasks, **settings):
    """Make the trainer: the only place that connects er-gym and TRL.

    Args:
        model: a model, or the name or folder of one; then ``tokenizer`` may be None.
        tasks: the tasks to play; all rollouts of a group play the same one.
        settings: of ``GRPOConfig``.
    """
    rows = [{"prompt": [{"role": "user", "content": PROMPT}], "task_id": task.id} for task in tasks]
    return GRPOTrainer(
        model=model,
        processing_class=tokenizer,
        args=GRPOConfig(
            bf16=torch.cuda.is_available(),  # TRL's default is True, on a CPU as well
            logging_steps=1,
            report_to="none",
            save_strategy="no",
            **settings,
        ),
        train_dataset=Dataset.from_list(rows),
        environment_factory=Room,
        reward_funcs=episode_reward,
    )


def main(arguments=None):
    """Train, and print the rewards."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", help="name or folder of a model that can call tools")
    parser.add_argument("--steps", type=int, default=3, help="optimisation steps (3)")
    parser.add_argument("--group", type=int, default=4, help="rollouts of the same task (4)")
    parser.add_argument(
        "--tokens",
        type=int,
        default=64,
        help="in a rollout, including the environment's answers (64)",
    )
    parser.add_argument("--out", default="runs/grpo_text", help="folder for TRL (runs/grpo_text)")
    args = parser.parse_args(arguments)

    tasks = load_suite("mini").tasks
    model, tokenizer = args.model, None
    if model is None:
        torch.manual_seed(0)
        tokenizer = tiny_tokenizer([*map(str, ACTIONS), *(task.instruction for task in tasks)])
        model = tiny_model(tokenizer)
    trainer = make_trainer(
        model,
        tokenizer,
        tasks,
        output_dir=args.out,
        max_steps=args.steps,
        per_device_train_batch_size=args.group,
        num_generations=args.group,
        max_completion_length=args.tokens,
    )
    trainer.train()
    for log in trainer.state.log_history[: args.steps]:
        print(
            f"step {log['step']}: reward {log['reward']:.2f}, loss {log['loss']:.4f}, "
            f"{log['tools/call_frequency']:.1f} calls a rollout"
        )
    if args.model:
        trainer.save_model()


if __name__ == "__main__":
    main()
