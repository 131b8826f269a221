"""Start Ray on this machine, or join a cluster, for the length of a ``with`` statement."""

from __future__ import annotations

import contextlib
import logging
import os
import secrets
import shutil
import signal
import socket
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from er_gym.activity import begin, begin_import
from er_gym.rollout.cluster.settings import RaySettings

if TYPE_CHECKING:
    from er_gym.rollout.cluster.machines import RayMachines

_FOLDER = "er-gym-ray-"
_OBJECT_STORE_BYTES = 512 * 2**20
"""Of a Ray that is started here: results are small or freed at once."""
LOCAL_ENVIRONMENT = {
    # Ray's name for it: without clusters, every server listens on loopback alone.
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",
    "RAY_USAGE_STATS_ENABLED": "0",
}
_CONNECT_SECONDS = 5.0
_STARTS = 3
"""Ray waits no more than 30 seconds for itself, which is too little on a busy machine."""
_PACKAGES = ("er_gym", "agents", "benchmarks")


class RayUnavailable(ValueError):
    """Ray is not installed, or there is no such cluster; the message says what to do."""


@contextlib.contextmanager
def ray_machines(
    settings: RaySettings, say: Callable[[str], None], modules: Sequence[Path] = ()
) -> Iterator[RayMachines]:
    """A cluster to work with.

    A Ray that is started here listens on loopback alone, and leaves no file behind. A process that
    is a Ray driver already goes on using its cluster, and stays one.

    Args:
        settings: which cluster, and what a worker is.
        say: called with messages for the user, from any thread.
        modules: files and folders of Python modules that the workers need beside er-gym.

    Raises:
        RayUnavailable: see there.
    """
    environment = {} if settings.address else LOCAL_ENVIRONMENT
    with _environment(environment), contextlib.ExitStack() as stack:
        begin_import("Ray", "ray")
        try:
            import ray
        except ImportError as error:
            raise RayUnavailable(
                f"{error.name} is not installed, and a Ray cluster needs it: "
                "pip install 'er-gym[ray]'"
            ) from None
        from er_gym.rollout.cluster.machines import RayMachines

        if not ray.is_initialized():
            begin(f"joining the cluster {settings.address}" if settings.address else "starting Ray")
            if settings.address:
                with same_signals():
                    _join(settings.address, modules)
            else:
                folder = stack.enter_context(_folder())
                stack.enter_context(_environment({"RAY_AUTH_TOKEN": auth_token()}))
                with on_loopback(), same_signals(), _own_session():
                    _start(folder)
            stack.callback(ray.shutdown)
            stack.enter_context(_quiet())
        yield RayMachines(settings, say)


@lru_cache
def auth_token() -> str:
    """The password of every Ray that this process starts: Ray reads it once in a process."""
    return secrets.token_hex(32)


def _start(folder: Path) -> None:
    """Start Ray on this machine."""
    import ray

    for tries_left in reversed(range(_STARTS)):
        try:
            ray.init(
                address="local",
                include_dashboard=False,
                log_to_driver=False,
                logging_level=logging.ERROR,
                object_store_memory=_OBJECT_STORE_BYTES,
                _temp_dir=str(folder),
            )
            return
        except Exception as error:  # Ray raises bare exceptions, too
            ray.shutdown()
            if not tries_left:
                reason = " ".join(str(error).split())
                raise RayUnavailable(f"Ray cannot be started here: {reason[:300]}") from error


@contextlib.contextmanager
def on_loopback() -> Iterator[None]:
    """Let Ray take 127.0.0.1 for this machine's address also if it was imported before."""
    from ray._private import ray_constants

    before = ray_constants.ENABLE_RAY_CLUSTER
    ray_constants.ENABLE_RAY_CLUSTER = False
    try:
        yield
    finally:
        ray_constants.ENABLE_RAY_CLUSTER = before


@contextlib.contextmanager
def same_signals() -> Iterator[None]:
    """Keep the handler of SIGTERM, which Ray replaces by one that ends the process at once."""
    before = signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGTERM, before)


@contextlib.contextmanager
def _own_session() -> Iterator[None]:
    """Start Ray's processes in sessions of their own.

    What ends a group of processes (``timeout``, a terminal that closes) would otherwise end them
    first, and this process would die of that before it has tidied up. They die with it all the
    same: on Linux, Ray has the kernel see to it. Elsewhere it needs the group for that.
    """
    from ray._private import services

    name = "ConsolePopen"
    before = getattr(services, name, None)
    if before is None or sys.platform != "linux":
        yield
        return
    setattr(services, name, partial(before, start_new_session=True))
    try:
        yield
    finally:
        setattr(services, name, before)


def _join(address: str, modules: Sequence[Path]) -> None:
    """Join a cluster; the code of this process travels with its workers."""
    import ray

    _check_reachable(address)
    carried = [*(Path(__file__).parents[3] / name for name in _PACKAGES), *modules]
    environment: dict[str, Any] = {
        "py_modules": [str(each) for each in carried if each.exists()],
        "excludes": ["**/__pycache__"],
    }
    try:
        ray.init(
            address=address,
            log_to_driver=False,
            logging_level=logging.ERROR,
            runtime_env=environment,
        )
    except (ConnectionError, RuntimeError, ValueError, OSError, ImportError) as error:
        reason = " ".join(str(error).split())
        raise RayUnavailable(
            f"cannot join the Ray cluster at {address}: {reason[:300]}; give the address that "
            "`ray status` accepts, or none to start Ray on this machine"
        ) from None


def _check_reachable(address: str) -> None:
    """Raise RayUnavailable if nobody listens at an address: Ray itself would wait for minutes."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not colon or not port.isdigit():
        return  # auto, or something that Ray refuses at once
    try:
        socket.create_connection((host.strip("[]"), int(port)), _CONNECT_SECONDS).close()
    except (OSError, OverflowError) as error:
        raise RayUnavailable(
            f"no Ray cluster answers at {address} ({error}); give the address that `ray status` "
            "accepts, or none to start Ray on this machine"
        ) from None


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep Ray's notes about dead processes off stdout, where results go; er-gym says what
    matters. Ray has no switch for this."""
    from ray._private import worker

    name = "print_to_stdstream"
    before = getattr(worker, name, None)
    if before is not None:
        setattr(worker, name, lambda *args, **kwargs: None)
    try:
        yield
    finally:
        if before is not None:
            setattr(worker, name, before)


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    """A folder for the files of a Ray that is started here; those of killed runs are removed."""
    # Sockets are in it, whose paths may have no more than 107 characters.
    root = Path(tempfile.gettempdir())
    root = root if len(str(root)) < 20 else Path("/tmp")
    for left in root.glob(f"{_FOLDER}*"):
        owner = left.name.removeprefix(_FOLDER).partition("-")[0]
        if owner.isdigit() and not _is_alive(int(owner)):
            shutil.rmtree(left, ignore_errors=True)  # of another user it stays
    folder = Path(tempfile.mkdtemp(prefix=f"{_FOLDER}{os.getpid()}-", dir=root))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


@contextlib.contextmanager
def _environment(changes: Mapping[str, str]) -> Iterator[None]:
    """Environment variables for the length of a ``with`` statement; those that are set stay."""
    mine = {name: value for name, value in changes.items() if name not in os.environ}
    os.environ.update(mine)
    try:
        yield
    finally:
        for name in mine:
            os.environ.pop(name, None)
