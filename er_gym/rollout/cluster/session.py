"""Start Ray on this machine, or join a cluster, for the length of a ``with`` statement."""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import secrets
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from er_gym.activity import begin, begin_import
from er_gym.extras import MissingPackage
from er_gym.rollout.cluster.greeting import problem_at
from er_gym.rollout.cluster.settings import RaySettings

if TYPE_CHECKING:
    from er_gym.rollout.cluster.worker_backend import RayBackend

_FOLDER = "er-gym-ray-"
_OBJECT_STORE_BYTES = 512 * 2**20
"""Of a Ray that is started here: results are small or freed at once."""
LOCAL_ENVIRONMENT = {
    # Ray's name for it: without clusters, every server listens on loopback alone.
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",
    "RAY_USAGE_STATS_ENABLED": "0",
    # A worker is started when it is asked for; Ray would start one per processor beforehand.
    "RAY_enable_worker_prestart": "0",
    "RAY_prestart_worker_first_driver": "0",
}
_JOIN_ENVIRONMENT = {"RAY_BACKEND_LOG_LEVEL": "error"}
"""Without lines of Ray's own beside er-gym's, which says the same."""
_LEFT_BY_RAY = ("RAY_AUTH_MODE", "PYTHONBREAKPOINT")
"""Variables that Ray sets and leaves: with the first, a process that is started later could not
join a cluster without a password."""
_JOIN_SECONDS = 120.0
"""In which Ray must have joined a cluster whose server has answered. It takes a few seconds, and
more where this machine is busy or the code that travels has far to go."""
_WATCH_SECONDS = 0.05
_VITAL = ("raylet", "gcs_server")
"""The programs without which Ray can do nothing."""
_ENDED_BY_RAY = 3
"""The exit code of a run that was stopped from outside; see ``benchmarks.cli.errors``."""
_STARTS = 3
"""Ray waits no more than 30 seconds for itself, which is too little on a busy machine."""
_PACKAGES = ("er_gym", "agents", "benchmarks")


class RayUnavailable(ValueError):
    """Ray is not installed, or there is no such cluster; the message says what to do."""


@contextlib.contextmanager
def ray_backend(
    settings: RaySettings, say: Callable[[str], None], modules: Sequence[Path] = ()
) -> Iterator[RayBackend]:
    """A cluster to work with.

    A Ray that is started here listens on loopback alone, and leaves no file behind. A process that
    is already connected to a cluster uses that one, and stays connected.

    Args:
        settings: which cluster, and what a worker is.
        say: called with messages for the user, from any thread.
        modules: files and folders of Python modules that the workers need beside er-gym.

    Raises:
        RayUnavailable: see there.
    """
    environment = _JOIN_ENVIRONMENT if settings.address else LOCAL_ENVIRONMENT
    with _environment(environment), contextlib.ExitStack() as stack:
        if find_spec("ray") is None:
            raise RayUnavailable(str(MissingPackage("a Ray cluster", "ray", "er-gym[ray]")))
        if settings.address:  # before Ray is imported, which takes seconds
            _check_reachable(settings.address)
        begin_import("Ray", "ray")
        import ray

        from er_gym.rollout.cluster.worker_backend import RayBackend

        if not ray.is_initialized():
            begin(f"joining the cluster {settings.address}" if settings.address else "starting Ray")
            if settings.address:
                with same_signals():
                    _join(settings.address, modules)
            else:
                folder = stack.enter_context(_folder())
                stack.enter_context(_environment({"RAY_AUTH_TOKEN": auth_token()}))
                with on_loopback(), same_signals(), _own_session() as started:
                    _start(folder, started)
            stack.callback(ray.shutdown)
            if not settings.address:
                stack.callback(_watch(started, folder, say).set)  # called before the shutdown
            stack.enter_context(_quiet())
        yield RayBackend(settings, say)


@lru_cache
def auth_token() -> str:
    """The password of all Ray clusters of this process: Ray reads it only once in a process."""
    return secrets.token_hex(32)


def _start(folder: Path, started: list[subprocess.Popen[bytes]]) -> None:
    """Start Ray on this machine; ``started`` lists its processes as they begin."""
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
        except BaseException as error:  # Ray raises bare exceptions, too
            ray.shutdown()
            _reap(started)  # Ray has forgotten those of a start that failed half-way
            if not isinstance(error, Exception):
                raise
            if not tries_left:
                reason = " ".join(str(error).split())
                raise RayUnavailable(f"Ray cannot be started here: {reason[:300]}") from error


def _reap(started: list[subprocess.Popen[bytes]]) -> None:
    """End processes that this one has started, and what they have started in their sessions."""
    for process in started:
        if process.poll() is None:
            own_session = os.getpgid(process.pid) == process.pid
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL) if own_session else process.kill()
            process.wait()
    started.clear()


def _watch(
    started: Sequence[subprocess.Popen[bytes]], folder: Path, say: Callable[[str], None]
) -> threading.Event:
    """End this process with a word once a process of the Ray that it has started has died.

    Nothing can be done by that Ray any more, and Ray ends its drivers then without one. What has
    been done is on the disk.

    Returns:
        Set it to stop watching.
    """
    over = threading.Event()
    vital = {_program(each): each for each in started if _program(each) in _VITAL}

    def watch() -> None:
        while not over.wait(_WATCH_SECONDS):
            dead = next((name for name, each in vital.items() if each.poll() is not None), None)
            if dead is None or over.is_set():
                continue
            say(
                f"the Ray that was started here has died: its {dead} ended with "
                f"{vital[dead].returncode}; what is finished is kept; the same command continues"
            )
            _reap([*started])
            shutil.rmtree(folder, ignore_errors=True)
            os._exit(_ENDED_BY_RAY)

    threading.Thread(target=watch, daemon=True).start()
    return over


def _program(process: subprocess.Popen[bytes]) -> str:
    """The name of the program that a process runs."""
    command: Any = process.args
    first = command[0] if isinstance(command, (list, tuple)) else command
    return os.path.basename(os.fsdecode(first))


@contextlib.contextmanager
def on_loopback() -> Iterator[None]:
    """Let Ray use 127.0.0.1 as this machine's address, even if ``ray`` was imported before."""
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
def _own_session() -> Iterator[list[subprocess.Popen[bytes]]]:
    """Start Ray's processes in sessions of their own, and list them.

    What ends a group of processes (``timeout``, a terminal that closes) would otherwise end them
    first, and this process would die of that before it has tidied up. They die with it all the
    same: on Linux, Ray has the kernel see to it. Elsewhere it needs the group for that.
    """
    from ray._private import services

    name = "ConsolePopen"
    before = getattr(services, name, None)
    started: list[subprocess.Popen[bytes]] = []
    if before is None:
        yield started
        return

    def start(*args: Any, **options: Any) -> subprocess.Popen[bytes]:
        process: subprocess.Popen[bytes] = before(*args, **options)
        started.append(process)
        return process

    own = {"start_new_session": True} if sys.platform == "linux" else {}
    setattr(services, name, partial(start, **own))
    try:
        yield started
    finally:
        setattr(services, name, before)


def _join(address: str, modules: Sequence[Path]) -> None:
    """Join a cluster; the code of this process travels with its workers."""
    import ray

    carried = [*(Path(__file__).parents[3] / name for name in _PACKAGES), *modules]
    environment: dict[str, Any] = {
        "py_modules": [str(each) for each in carried if each.exists()],
        "excludes": ["**/__pycache__"],
    }
    join = partial(
        ray.init,
        address=address,
        log_to_driver=False,
        logging_level=logging.ERROR,
        runtime_env=environment,
    )
    failures = (ConnectionError, RuntimeError, ValueError, OSError, ImportError)
    try:
        _within(_JOIN_SECONDS, join)
    except (*failures, ray.exceptions.RayError) as error:
        reason = " ".join(str(error).split())
        raise RayUnavailable(
            f"cannot join the Ray cluster at {address}: {reason[:300]}; {_WHICH_ADDRESS}"
        ) from None


_WHICH_ADDRESS = "give the address that `ray status` accepts, or none to start Ray on this machine"


def _within(seconds: float, act: Callable[[], object]) -> None:
    """Do it in a thread, which is abandoned at the end of the time and at Ctrl-C.

    Ray waits in C++, where neither a signal nor an exception reaches it.

    Raises:
        TimeoutError: the time is over.
    """
    ended: queue.SimpleQueue[BaseException | None] = queue.SimpleQueue()

    def run() -> None:
        try:
            act()
        except BaseException as error:
            ended.put(error)
        else:
            ended.put(None)

    threading.Thread(target=run, daemon=True).start()
    try:
        error = ended.get(timeout=seconds)
    except queue.Empty:
        raise TimeoutError(f"it has not let this machine join within {seconds:.0f} s") from None
    if error is not None:
        raise error


def _check_reachable(address: str) -> None:
    """Raise RayUnavailable if Ray is not at an address."""
    if address == "auto":
        address = os.environ.get("RAY_ADDRESS", address)
        if address == "auto":
            return  # Ray looks for a cluster of this machine
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not host or not port.isdecimal():
        raise RayUnavailable(
            f"{address} is no address of a Ray cluster: auto, HOST:PORT and ray://HOST:PORT are; "
            f"{_WHICH_ADDRESS}"
        )
    if problem := problem_at(host.removeprefix("[").removesuffix("]"), int(port)):
        raise RayUnavailable(f"no Ray cluster answers at {address} ({problem}); {_WHICH_ADDRESS}")


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
    """Environment variables for the length of a ``with`` statement; those that are set stay.

    What Ray sets meanwhile is taken away with them.
    """
    mine = {name for name in (*changes, *_LEFT_BY_RAY) if name not in os.environ}
    os.environ.update({name: value for name, value in changes.items() if name in mine})
    try:
        yield
    finally:
        for name in mine:
            os.environ.pop(name, None)
