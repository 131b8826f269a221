"""verl: an agent loop in which the model plays a household task.

verl imports this file where its configuration of agent loops names it
(``actor_rollout_ref.rollout.agent.agent_loop_config_path``)::

    - name: er_gym
      _target_: er_gym.integrations.verl.HouseholdLoop
      session: {episode_source: mini, scaffold: hints/key_actions}

A row of the data set chooses the loop and the task: ``rows`` makes such rows.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Mapping
from typing import Any
from uuid import uuid4

from verl.experimental.agent_loop.agent_loop import AgentLoopBase, AgentLoopOutput

from er_gym.integrations.session import PROMPT, Session, action_in
from er_gym.tasks.task import Task

NAME = "er_gym"
SOURCE = "er-gym"
"""The ``data_source`` of a row."""


class HouseholdLoop(AgentLoopBase):
    """One episode; verl makes a loop for each trajectory.

    The model reads texts; pictures are not shown.

    Args:
        session: the arguments of :class:`~er_gym.integrations.session.Session` but ``pictures``.
    """

    def __init__(self, *args: Any, session: Mapping[str, Any] | None = None, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._settings = dict(session or {})
        self._longest = self.rollout_config.response_length
        self._most = self.rollout_config.multi_turn.max_assistant_turns

    async def run(self, sampling_params: dict[str, Any], **kwargs: Any) -> AgentLoopOutput:
        """Play the episode of a row; its reward is the sum of the episode's rewards."""
        session = await asyncio.to_thread(lambda: Session(**self._settings))
        try:
            return await self._play(session, sampling_params, kwargs)
        finally:
            await asyncio.to_thread(session.close)

    async def _play(
        self, session: Session, sampling_params: dict[str, Any], row: Mapping[str, Any]
    ) -> AgentLoopOutput:
        task_id = (row.get("extra_info") or {}).get("task_id")
        turn = await asyncio.to_thread(session.reset, task_id)
        messages = [*row["raw_prompt"], {"role": "user", "content": turn.text}]
        ids = await self.ct_build_initial_tokens(messages)
        mask: list[int] = []
        logprobs: list[float] | None = None
        request, replies, reward = uuid4().hex, 0, 0.0
        extra: dict[str, Any] = {}
        while len(mask) < self._longest and not turn.done and replies < (self._most or 2**31):
            said = await self.server_manager.generate(
                request_id=request, prompt_ids=ids, sampling_params=sampling_params
            )
            replies, extra = replies + 1, {**extra, **said.extra_fields}
            logprobs = (logprobs or []) if said.log_probs else logprobs
            merged, mask, logprobs = await self.ct_merge_assistant_token(
                ids, said.token_ids, mask, logprobs, assistant_logprobs=said.log_probs or None
            )
            ids = merged.token_ids
            text = self.tokenizer.decode(said.token_ids, skip_special_tokens=True)
            turn = await asyncio.to_thread(session.step, action_in(text))
            reward += turn.reward
            before = [*messages, {"role": "assistant", "content": text}]
            messages = [*before, {"role": "user", "content": turn.text}]
            if not turn.done and len(mask) < self._longest:
                merged, mask, logprobs = await self.ct_merge_context_msg(
                    before, messages, ids, mask, logprobs
                )
                ids = merged.token_ids
        start = len(ids) - len(mask)
        about = {"success": turn.success, "progress": turn.progress, "task_id": turn.task_id}
        return AgentLoopOutput(
            prompt_ids=ids[:start],
            response_ids=ids[start:][: self._longest],
            response_mask=mask[: self._longest],
            response_logprobs=logprobs[: self._longest] if logprobs else None,
            reward_score=reward,
            num_turns=2 * replies + 1,
            metrics={},
            extra_fields={
                **extra,
                "turn_scores": [],
                "tool_rewards": [],
                "reward_extra_info": about,
            },
        )


def rows(tasks: Iterable[Task], prompt: str = PROMPT) -> list[dict[str, Any]]:
    """The rows of a data set for verl, a task each; the first observation follows the prompt."""
    return [
        {
            "prompt": [{"role": "system", "content": prompt}],
            "agent_name": NAME,
            "data_source": SOURCE,
            "reward_model": {"style": "rule", "ground_truth": ""},
            "extra_info": {"task_id": task.id},
        }
        for task in tasks
    ]
