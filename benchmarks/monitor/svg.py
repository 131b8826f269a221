"""Charts as SVG, drawn here so that pages, exports and tests have the same ones.

Colours are names of CSS variables of ``static/monitor.css``, which has them for light and dark.
"""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup


def rate_bar(rate: float | None, low: float | None, high: float | None) -> Markup:
    """A rate as a bar with its 95 % interval as a line over it; fractions. Empty without a rate."""
    if rate is None or low is None or high is None:
        return Markup("")
    return Markup(
        '<svg class="rate" viewBox="0 0 100 10" preserveAspectRatio="none" aria-hidden="true">'
        '<rect class="rail" width="100" height="10"/>'
        '<rect class="fill" width="{:.2f}" height="10"/>'
        '<rect class="whisker" x="{:.2f}" y="4" width="{:.2f}" height="2"/></svg>'
    ).format(100 * rate, 100 * low, max(0.4, 100 * (high - low)))


def share_bar(parts: Sequence[tuple[str, float]]) -> Markup:
    """Parts of a whole side by side; each has the name of a CSS class and a fraction."""
    left, drawn = 0.0, Markup("")
    for name, share in parts:
        drawn += Markup('<rect class="{}" x="{:.2f}" width="{:.2f}" height="10"/>').format(
            name, 100 * left, 100 * share
        )
        left += share
    return Markup(
        '<svg class="shares" viewBox="0 0 100 10" preserveAspectRatio="none" aria-hidden="true">'
        '<rect class="rail" width="100" height="10"/>{}</svg>'
    ).format(drawn)
