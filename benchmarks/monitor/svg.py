"""Charts as SVG, drawn here so that pages, exports and tests have the same ones.

Colours are names of CSS variables of ``static/monitor.css``, which has them for light and dark.
"""

from __future__ import annotations

from markupsafe import Markup


def rate_bar(rate: float | None, low: float | None, high: float | None) -> Markup:
    """A rate as a bar with its 95 % interval as a line over it; fractions. Empty without a rate.

    Without a line if the interval is 0 to 0.
    """
    if rate is None or low is None or high is None:
        return Markup("")
    return Markup(
        '<svg class="rate" viewBox="0 0 100 10" preserveAspectRatio="none" aria-hidden="true">'
        '<rect class="rail" width="100" height="10"/>'
        '<rect class="fill" width="{:.2f}" height="10"/>'
        '<rect class="whisker" x="{:.2f}" y="4" width="{:.2f}" height="2"/></svg>'
    ).format(100 * rate, 100 * low, max(0.4, 100 * (high - low)) if high else 0.0)


def difference_bar(difference: float, low: float, high: float) -> Markup:
    """A difference of fractions, from the middle to the right if more; a line is its interval."""
    return Markup(
        '<svg class="rate" viewBox="-100 0 200 10" preserveAspectRatio="none" aria-hidden="true">'
        '<rect class="rail" x="-100" width="200" height="10"/>'
        '<rect class="{}" x="{:.2f}" width="{:.2f}" height="10"/>'
        '<rect class="whisker" x="{:.2f}" y="4" width="{:.2f}" height="2"/>'
        '<rect class="whisker" x="-.5" width="1" height="10"/></svg>'
    ).format(
        "fill" if difference >= 0 else "fill less",
        min(0.0, 100 * difference),
        abs(100 * difference),
        100 * low,
        max(0.8, 100 * (high - low)),
    )
