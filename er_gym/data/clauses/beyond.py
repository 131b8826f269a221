"""Claims of deeds that the agent's actions cannot do, such as washing by hand or folding."""

from __future__ import annotations

from collections.abc import Iterator

from er_gym.data.clauses.lexicon_beyond import DEEDS, Beyond
from er_gym.data.clauses.reading import Verdict, clauses_of, lexicon_of
from er_gym.data.thought import Refusal, Thought, name_of


def judge_beyond(thought: Thought) -> Iterator[Verdict]:
    """Something was done to a thing that no action does."""
    lexicon, language = lexicon_of(thought), thought.known.language
    for clause, span in clauses_of(thought):
        if clause.guessed or clause.negated or clause.wanted or not span.mentions:
            continue
        if clause.intended and language == "en":
            continue
        for kind in DEEDS:
            if _was_near_enough(thought, kind):
                continue
            for match in span.matches_of(kind.done[language], thought.phrases.of_other):
                mention = span.named(match, "x")
                if mention is None or lexicon.undone.search(match.group()):
                    continue
                said = match.group().replace("§", name_of(mention)).strip(" ,")
                refusal = Refusal("history", f"No action did that: “{said}”. Leave it out.")
                yield Verdict(span.sentence, refusal)


def _was_near_enough(thought: Thought, kind: Beyond) -> bool:
    return any(
        each.success
        and each.action.verb == verb
        and (not types or each.action.object_type in types)
        for each in thought.known.actions
        for verb, types in kind.by
    )
