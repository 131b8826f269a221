"""The agent that a language model drives, in one conversation per episode."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from typing import Any

from agents.vlm.chat import Client, ConversationRefused, Message, Picture, Reply, model_reply
from agents.vlm.history import Limits, pictures_in
from agents.vlm.matching import Matcher
from agents.vlm.parsing import ParsedReply, parse
from agents.vlm.pictures import encode, noise_like
from agents.vlm.prompt_set import LastAction, PromptSet, TurnContext, interleave_pictures
from agents.vlm.record import (
    ConversationRecord,
    MessageRecord,
    PictureRecord,
    RoundRecord,
    ThoughtRecord,
    TrimmedRecord,
    reply_fields,
    settings_to_record,
)
from agents.vlm.reply_causes import causes_of
from agents.vlm.requests import (
    actions_of,
    as_settings_have_it,
    in_form,
    said_by,
    within_limits,
)
from agents.vlm.settings import AgentSettings
from er_gym.data.dialects import shows_anew
from er_gym.data.scene_text import Perceived
from er_gym.envs.actions import NO_ACTION, Action, applies
from er_gym.envs.feedback import told_in
from er_gym.envs.info import detail, names
from er_gym.envs.observations import text_without_task
from er_gym.rollout.agent import Decision, check_observation
from er_gym.rollout.causes import CONTENT, TRIMMED
from er_gym.rollout.records import PERSON, By, EpisodeRecord
from er_gym.rollout.run_directory import CONVERSATIONS, PICTURES
from er_gym.tasks import verbs
from er_gym.tasks.task import Task

_LONGEST_QUOTE = 200
_AHEAD = "ahead"


class VLMAgent:
    """Plays episodes one after another and keeps the conversation of the last one.

    Messages never change once they are sent, so that a server can reuse its prefix cache. There are
    two exceptions. Pictures beyond ``settings.pictures.keep`` are left out. Where the conversation
    is over a limit of the server and ``settings.trims``, so are as many of the oldest pictures and
    words as it takes (:mod:`agents.vlm.history`), which the record states.

    Args:
        client: asks the model.
        settings: the agent's settings.
        prompts: the texts that the model is given.
        matcher: finds the object type for a name that the model writes.
        seed: of the episode; the client gets it with every request.
        name: the agent's name, for the conversation record.
    """

    attachment_folders = (PICTURES, CONVERSATIONS)

    def __init__(
        self,
        client: Client,
        settings: AgentSettings,
        prompts: PromptSet,
        matcher: Matcher,
        seed: int = 0,
        name: str = "",
    ) -> None:
        self.obs_mode = settings.obs_mode
        self._client, self._settings, self._prompts = client, settings, prompts
        self._matcher, self._seed, self._name = matcher, seed, name
        self._task: Task | None = None

    # -- the agent's protocol --------------------------------------------------------------------

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode.

        Raises:
            ValueError: the environment does not give the observations of ``obs_mode``.
        """
        check_observation(self, obs)
        self._task = task
        system = self._prompts.system(
            decide=self._settings.decide, sees=self._settings.sees, task=task.instruction
        )
        self._messages = [Message("system", (system,))] if system else []
        self._rounds: list[RoundRecord] = []
        self._perceived: Perceived | None = None
        self._last_picture = b""
        self._last_action: Action | None = None
        self._limits = Limits()
        self._over_limit = ""  # the words of the first refusal

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """Send the model the result of its last action, and return its decision.

        Raises:
            ModelError: the model gives no reply in this episode.
            ConversationRefused: nor would it if the episode were played again.
            CannotGoOn: no later request can succeed either.
        """
        self._messages.append(self._turn(obs, info))
        return self._read(self._reply(), info)

    def _reply(self) -> Reply:
        """The model's reply, to less of the history if the whole is refused."""
        while True:
            try:
                return self._client.reply(self._history(), self._seed)
            except ConversationRefused as refusal:
                tighter = self._limits.tighter(self._shown(), refusal.cause)
                if not self._settings.trims or refusal.cause == CONTENT or tighter is None:
                    raise
                self._limits = tighter
                self._over_limit = self._over_limit or str(refusal)

    def overruled(self, action: Action, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Another decides this step. The conversation goes on as if the model had decided it."""
        self._messages.append(self._turn(obs, info))
        self._read(in_form(action, self._settings.decide), info, by=PERSON)

    def _read(self, reply: Reply, info: Mapping[str, Any], by: By = "") -> Decision:
        """Read a reply, and add it to the conversation."""
        trimmed = None if by else self._trimmed()
        parsed = parse(reply.text, reply.call, self._settings.decide)
        action, problem, matched = self._resolve(parsed, info)
        self._last_action = action
        said = said_by(reply)
        self._messages.append(Message("assistant", (said,), reply.reasoning))
        thoughts = [ThoughtRecord(kind=each.kind, text=each.text) for each in parsed.thoughts]
        self._rounds.append(
            RoundRecord(
                message=len(self._messages) - 1,
                thoughts=thoughts,
                action="" if problem else str(action),
                name=parsed.name,
                matched=matched,
                rules=list(parsed.rules),
                problem=problem,
                by=by,
                trimmed=trimmed,
                **reply_fields(reply),
            )
        )
        causes = (*causes_of(reply, parsed), *(TRIMMED,) * bool(trimmed))
        thought = "\n".join(f"{each.kind}: {each.text}" for each in parsed.thoughts)
        decided = action or _unreadable_action(parsed, said)
        return Decision(decided, thought, model_reply(reply), causes=causes)

    def fork(self, client: Client | None = None, seed: int | None = None) -> VLMAgent:
        """An agent with the same conversation so far, which goes on by itself.

        Args:
            client, seed: of the new agent; None for those of this one.
        """
        other = copy(self)
        other._messages, other._rounds = [*self._messages], [*self._rounds]
        other._client = self._client if client is None else client
        other._seed = self._seed if seed is None else seed
        return other

    @property
    def messages(self) -> Sequence[Message]:
        """The conversation so far."""
        return self._messages

    @property
    def rounds(self) -> Sequence[RoundRecord]:
        """The replies of the episode so far, oldest first."""
        return self._rounds

    # -- messages to the model -------------------------------------------------------------------

    def _turn(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Message:
        """The next user message: the task, or the result of the last action."""
        assert self._task is not None
        before, now = self._perceived, None
        if self._prompts.as_recorded and self._settings.sees == "text":
            now = self._perceived = Perceived.of(info, before)
        turn = TurnContext(
            task=self._task.instruction,
            decide=self._settings.decide,
            sees=self._settings.sees,
            scene_text=text_without_task(obs.get("text", ""), self._task.instruction),
            now=now,
            before=before,
            steps=info["steps"],
            max_steps=info["max_steps"],
        )
        if not self._rounds:
            return _with_pictures(self._prompts.first(turn), self._pictures(obs, info))
        answer = {"feedback": info["feedback"], "success": bool(info["action_success"])}
        if answer["success"]:  # the paper's protocol finds something even in an unusable reply
            answer |= {"action": info["action"], "problem": ""}
        last = self._rounds[-1] = self._rounds[-1].model_copy(update=answer)
        if last.problem:
            return Message("user", (self._told_problem(last.problem, info),))
        pictures = self._pictures(obs, info, after=last)
        last_action = LastAction(
            action=last.action,
            success=last.success,
            feedback=self._told(last.feedback),
            pictures=len(pictures),
            directions=tuple(pictures),
        )
        return _with_pictures(self._prompts.next(turn, last_action), pictures)

    def _told(self, feedback: str) -> str:
        """The environment's feedback in the language of the prompts."""
        return told_in(self._settings.prompts.language, feedback)

    def _told_problem(self, problem: str, info: Mapping[str, Any]) -> str:
        """The message after a reply without a usable action."""
        if self._prompts.as_recorded and self._last_action is not None:
            # An action that no object of the type allows.
            problem = self._told(info["feedback"])
        said = info["action_text"]
        return self._prompts.feedback(
            problem=problem,
            decide=self._settings.decide,
            action="" if said.startswith(NO_ACTION) else said,
        )

    def _pictures(
        self, obs: Mapping[str, Any], info: Mapping[str, Any], after: RoundRecord | None = None
    ) -> dict[str, Picture]:
        """The pictures of a turn by direction: the current view, and after ``observe`` also the
        views to the right, behind and left, as many as the prompts expect."""
        if self._settings.sees == "text":
            return {}
        shown = {_AHEAD: obs["rgb"]}
        looked = info["verb"] == verbs.OBSERVE and info["action_success"]
        views = dict(detail(info, "views")) if looked and self._settings.pictures.views else {}
        if views:
            wanted = self._prompts.after_observe
            shown = {1: shown, len(views): views}.get(wanted or 0, {**views, **shown})
        pictures = {name: encode(each, self._settings.pictures) for name, each in shown.items()}
        before, self._last_picture = self._last_picture, [*pictures.values()][-1].data
        if not self._prompts.as_recorded or after is None or len(pictures) > 1:
            return self._as_shown(pictures)
        anew = shows_anew(after.success, self._last_picture, before)
        return self._as_shown(pictures) if anew else {}

    def _as_shown(self, pictures: Mapping[str, Picture]) -> dict[str, Picture]:
        """The pictures, or noise in their place."""
        settings = self._settings.pictures
        if not settings.noise:
            return dict(pictures)
        return {
            direction: noise_like(picture, settings, (self._seed, len(self._rounds), place))
            for place, (direction, picture) in enumerate(pictures.items())
        }

    def _history(self) -> list[Message]:
        """The messages of the next request."""
        return within_limits(
            self._shown(), self._limits, actions_of(self._rounds), self._settings.decide
        )

    def _shown(self) -> list[Message]:
        """The messages as the settings have them, without regard to limits of the server."""
        return as_settings_have_it(
            self._messages,
            in_history=self._settings.reasoning.in_history,
            keep=self._settings.pictures.keep,
        )

    def _trimmed(self) -> TrimmedRecord | None:
        """What the last request left out since the server has a limit; None for nothing."""
        if self._limits == Limits():
            return None
        whole, sent = self._shown(), self._history()
        return TrimmedRecord(
            pictures=pictures_in(whole) - pictures_in(sent),
            messages=self._limits.shortened,
            why=self._over_limit,
        )

    # -- replies of the model --------------------------------------------------------------------

    def _resolve(
        self, parsed: ParsedReply, info: Mapping[str, Any]
    ) -> tuple[Action | None, str, str]:
        """The action (None if the object is unknown), its problem ("" if none), and how the name
        was matched with a type."""
        if parsed.problem or parsed.verb in verbs.BARE_VERBS:
            return (None if parsed.problem else Action(parsed.verb)), parsed.problem, ""
        at_hand = (*names(info["interactable_mask"]), *names(info["navigable_mask"]))
        match = self._matcher.match(parsed.name, prefer=at_hand)
        if not match.object_type:
            return None, match.problem, match.how
        if not applies(parsed.verb, match.object_type):
            article = "an" if match.object_type[0] in "AEIOU" else "a"
            problem = f"One cannot {parsed.verb} {article} {match.object_type}."
            return Action(parsed.verb, match.object_type), problem, match.how
        return Action(parsed.verb, match.object_type), "", match.how

    # -- the record ------------------------------------------------------------------------------

    def attachments(self, episode: EpisodeRecord, stem: str) -> dict[str, bytes]:
        """The conversation and its pictures, by path; empty if the episode never began."""
        if self._task is None:
            return {}
        files: dict[str, bytes] = {}
        rounds = list(self._rounds)
        if rounds and not rounds[-1].feedback:
            last = next((step for step in reversed(episode.steps) if not step.appended), None)
            answer = {
                "feedback": last.feedback if last else "",
                "success": last.success if last else False,
            }
            rounds[-1] = rounds[-1].model_copy(update=answer)
        record = ConversationRecord(
            task_id=self._task.id,
            scene=self._task.scene,
            instruction=self._task.instruction,
            agent=self._name,
            settings=settings_to_record(self._settings),
            prompts=self._prompts.name,
            prompts_digest=self._prompts.digest,
            messages=[
                _message_record(message, f"{PICTURES}/{stem}", files) for message in self._messages
            ],
            rounds=rounds,
            prompt_tokens=sum(each.prompt_tokens for each in rounds),
            completion_tokens=sum(each.completion_tokens for each in rounds),
            cost=sum(each.cost for each in rounds),
            estimated=any(each.estimated for each in rounds),
            error=episode.error or episode.gave_up,
        )
        files[f"{CONVERSATIONS}/{stem}.json"] = (record.model_dump_json(indent=1) + "\n").encode()
        return files


def _unreadable_action(parsed: ParsedReply, said: str) -> str:
    """The text that the environment gets in place of an action: the verb with the unknown name, or
    else the reply.
    Under the default protocol neither names an action; the paper's protocol counts the first as a
    step."""
    if parsed.verb:
        return " ".join(f"{parsed.verb} {parsed.name}".split())[:_LONGEST_QUOTE]
    return NO_ACTION + said[:_LONGEST_QUOTE]


def _with_pictures(text: str, pictures: Mapping[str, Picture]) -> Message:
    """A message of the user, with the pictures at the text's marks."""
    return Message("user", interleave_pictures(text, [*pictures.values()]))


def _message_record(message: Message, folder: str, files: dict[str, bytes]) -> MessageRecord:
    """A message for the record; its pictures are added to ``files``."""
    parts: list[str | PictureRecord] = []
    for part in message.parts:
        if isinstance(part, str):
            parts.append(part)
            continue
        path = f"{folder}/{len(files):03}.{part.media_type.removeprefix('image/')}"
        files[path] = part.data
        parts.append(
            PictureRecord(path=path, digest=part.digest, width=part.width, height=part.height)
        )
    return MessageRecord(role=message.role, parts=parts, reasoning=message.reasoning)
