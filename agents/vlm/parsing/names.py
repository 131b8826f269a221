"""Reads the name of a thing from the words behind a verb."""

from __future__ import annotations

from agents.vlm.parsing.vocabulary import ARTICLE, CLAUSE, EDGES, NO_NAME, PART_OF


def clean_name(text: str) -> tuple[str, tuple[str, ...]]:
    """A name without surrounding marks, article and clause, and the rules that this needed."""
    name = text.strip(EDGES)
    rules = ["marks"] if name != text.strip() else []
    if found := PART_OF.search(name):
        name = name[: found.start()]
        rules.append("clause")
    if found := ARTICLE.match(name):
        name = name[found.end() :]
        rules.append("article")
    if found := CLAUSE.search(name):
        name = name[: found.start()].strip(EDGES)
        rules.append("clause")
    return ("" if name.casefold() in NO_NAME else name), tuple(rules)
