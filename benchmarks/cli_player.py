"""``er-gym player`` and ``er-gym doctor``: AI2-THOR programs on our engine, and what works here."""

from __future__ import annotations

import click

from benchmarks.cli_errors import bad_input


@click.group()
def player() -> None:
    """Run unmodified AI2-THOR programs on the embedded engine."""


@player.command()
def path() -> None:
    """Print what Controller(local_executable_path=…, x_display=":0") is to launch."""
    from er_gym.thor import thor_executable

    click.echo(thor_executable())


@player.command()
@click.option("--force", is_flag=True, help="Set a real Unity build aside; uninstall restores it.")
def install(force: bool) -> None:
    """Put the player where Controller(platform=CloudRendering) finds it, offline."""
    from er_gym.thor import player as players

    with bad_input(players.PlayerError):
        release = players.install(force=force)
    click.echo(f"installed in {release.folder}")
    if not players.vulkan_is_there():
        click.echo(
            "AI2-THOR's client asks for a Vulkan library before it starts CloudRendering, and "
            "there is none: on Debian or Ubuntu, sudo apt install libvulkan1 (no GPU is needed)"
        )


@player.command()
def uninstall() -> None:
    """Remove what install has put there, and nothing else."""
    from er_gym.thor import player as players

    with bad_input(players.PlayerError):
        release = players.uninstall()
    restored = "; Unity's build is there again" if release.is_unity else ""
    click.echo(f"removed from {release.folder}{restored}")


@click.command()
def doctor() -> int:
    """Say what works on this machine, and what would mend the rest."""
    from benchmarks.doctor import examine

    findings = examine()
    widest = max(len(finding.what) for finding in findings)
    for finding in findings:
        mark = "ok" if finding.works else "--"
        mend = f"; {finding.mend}" if finding.mend else ""
        click.echo(f"{mark}  {finding.what:{widest}}  {finding.says}{mend}")
    return 0 if all(finding.works for finding in findings if finding.needed) else 1
