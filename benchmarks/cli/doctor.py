"""``er-gym doctor``: what works on this machine."""

from __future__ import annotations

import click

from benchmarks.cli.terminal import echo


@click.command()
def doctor() -> int:
    """Check what works on this machine, and say how to fix the rest.

    The exit code is 1 if a part that er-gym always needs does not work.
    """
    from benchmarks.cli.doctor_checks import run_checks

    checks = run_checks()
    widest = max(len(check.part) for check in checks)
    for check in checks:
        mark = "ok" if check.works else "--"
        fix = f"; {check.fix}" if check.fix else ""
        echo(f"{mark}  {check.part:{widest}}  {check.detail}{fix}")
    return 0 if all(check.works for check in checks if check.required) else 1
