"""What a run's page says of its model server: what it cost over time, and what went wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from agents.vlm.clients.supervisor import ServerEvent
from benchmarks.monitor.charts import as_svg
from benchmarks.monitor.curve_tail import Thinned
from benchmarks.monitor.language import Translator
from benchmarks.monitor.server_tail import ServerTail
from benchmarks.monitor.spending_tail import SpendingTail
from benchmarks.scoring.series import Axis, Chart, Point, Series

_BAD = ("retry", "failed", "refused")
"""The kinds of events that are drawn over time."""


@dataclass(frozen=True)
class ServerView:
    """See the file.

    Attributes:
        requests, rejected: answers that were paid for, and those that were no valid replies.
        counts: the number of events of each kind.
        waited: seconds of all retries.
        last: the last events, newest first.
        charts: each with its title.
    """

    requests: int
    rejected: int
    counts: Mapping[str, int]
    waited: float
    last: Sequence[ServerEvent]
    charts: Sequence[tuple[str, Markup]]


def server_view(spending: SpendingTail, server: ServerTail, t: Translator) -> ServerView | None:
    """What to say; None for a run without a server."""
    if spending.spent is None and not server.counts:
        return None
    series = [*spending.over.values(), *server.over.values()]
    begun = min((each.points()[0].x for each in series), default=0.0)
    minutes = Axis(t("minutes"), low=0.0)

    def over(told: Mapping[str, Thinned], name: str) -> list[Point]:
        points = told[name].points() if name in told else []
        return [Point((x - begun) / 60, y, y, y) for x, y, _, _ in points]

    events = [Series(t(f"server_{name}"), over(server.over, name)) for name in _BAD]
    wanted = (
        ("spent-cost", t("cost"), "$", [Series(t("cost"), over(spending.over, "cost"))]),
        ("spent-tokens", t("tokens"), "", [Series(t("tokens"), over(spending.over, "tokens"))]),
        ("server-events", t("server_troubles"), "", events),
    )
    drawn = [
        (title, as_svg(name, Chart(title, minutes, Axis(unit, low=0.0), lines)))
        for name, title, unit, lines in wanted
        if any(point.y for each in lines for point in each.points)
    ]
    return ServerView(
        requests=spending.spent.requests if spending.spent else 0,
        rejected=spending.rejected,
        counts=dict(server.counts.most_common()),
        waited=server.waited,
        last=[*server.last][::-1],
        charts=[(title, picture) for title, picture in drawn if picture],
    )
