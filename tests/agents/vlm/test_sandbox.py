"""The sandbox limits the work of a template."""

from __future__ import annotations

import time

import pytest
from jinja2 import StrictUndefined

from agents.vlm.sandbox import BoundedEnvironment


def rendered(template: str, **given: object) -> str:
    environment = BoundedEnvironment(undefined=StrictUndefined)
    environment.begin()
    return environment.from_string(template).render(**given)


@pytest.mark.parametrize(
    "template",
    [
        "{% for a in range(99999) %}{% for b in range(99999) %}{% endfor %}{% endfor %}",
        "{{ 'x' * 10 ** 10 }}",
        "{{ 9 ** (9 ** 9) }}",
        "{{ 'x' | center(9999999999) }}",
        "{{ 'x'.ljust(9999999999) }}",
        "{{ '%9999999999d' % 1 }}",
        "{{ '{:>9999999999}'.format(1) }}",
        "{{ ['%9999999999d'] | map('format', 1) | list }}",
        "{% set n = namespace(x='abc') %}{% for i in range(99) %}{% set n.x = n.x ~ n.x %}"
        "{% endfor %}",
        "{% set n = namespace(x=[1]) %}{% for i in range(99) %}{% set n.x = [n.x, n.x] %}"
        "{% endfor %}{{ n.x }}",
        "{{ range(99999) | map('string') | join('x' * 99999) }}",
        "{% macro m(n) %}{% if n %}{{ m(n - 1) }}{{ m(n - 1) }}{% endif %}{% endmacro %}"
        "{{ m(60) }}",
        "{{ lipsum(n=99999999) }}",
        "{% for x in [1] recursive %}{{ loop([1]) }}{% endfor %}",
        "{{ ''.__class__ }}",
    ],
)
def test_a_template_that_does_too_much_is_stopped_soon(template):
    begun = time.process_time()
    with pytest.raises(Exception, match=r"too much|may not|not allowed|unsafe"):
        rendered(template)
    assert time.process_time() - begun < 5


def test_what_prompts_do_is_done():
    template = (
        "{% macro m(x) %}[{{ x }}]{% endmacro %}{{ m(1) }}"
        "{% for a, b in pairs %}{{ loop.index }}/{{ loop.length }}{{ a | upper }}{{ b }} "
        "{% endfor %}"
        "{{ 'a' ~ 1 ~ word }}{{ 3 * 4 + 2 }}{{ word.split('-') | join(', ') }}{{ word[:2] }}"
        "{% if word in ['x-y'] and 1 is odd %}!{% endif %}"
    )
    assert rendered(template, pairs=[("a", 1), ("b", 2)], word="x-y") == (
        "[1]1/2A1 2/2B2 a1x-y14x, yx-!"
    )
