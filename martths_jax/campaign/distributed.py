"""Several processes, on one machine or many, work on one study in a folder they all see.

They meet at an address of process 0 before anything runs, each takes its share of the trials, and
process 0 waits for all of them and writes the results.  No array goes from one to another, so plain
sockets do: a process that ends closes its connection, and the others can say so in words.  (JAX's
own distributed runtime aborts every process of a job when one is lost, or none is found.)
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import time

from martths_jax.campaign.progress import Reporter
from martths_jax.errors import InputError, raise_all

#: Default time to wait for the other processes at the start [s].
JOIN_TIMEOUT = 300.0
#: Default time after which a machine that answers nothing counts as lost [s].
LOST_TIMEOUT = 100.0
_PERIOD = 0.2
_LONGEST_LINE = 4096


def join(
    coordinator: str | None,
    processes: int | None,
    process: int | None,
    timeout: float = JOIN_TIMEOUT,
    lost: float = LOST_TIMEOUT,
) -> Meeting:
    """Meet the other processes.

    Args:
        coordinator: address host:port of process 0; None goes by the cluster's variables (Slurm,
            Open MPI and others that JAX knows).
        processes: how many there are.
        process: which one this is, from 0.
        timeout: how long to wait for the others [s].
        lost: how long a machine may answer nothing before it counts as lost [s].

    Returns:
        the ``Meeting``, whose ``share`` is what this process has to do.

    Raises:
        InputError: if the options are not complete, or saying who cannot be found, came twice or
            has another number of processes.
    """
    given = {"--coordinator": coordinator, "--num-processes": processes, "--process-id": process}
    if any(value is not None for value in given.values()):
        raise_all(
            f"Option {name} is missing; {', '.join(given)} belong together."
            for name, value in given.items()
            if value is None
        )
    else:
        coordinator, processes, process = _by_cluster(timeout)
    if not (processes >= 1 and 0 <= process < processes):
        raise InputError(
            f"Option --process-id must lie in 0 ... {processes - 1}, but got {process}."
        )
    for name, seconds in (("--join-timeout", timeout), ("--lost-timeout", lost)):
        if not seconds > 0:
            raise InputError(f"Option {name} must be positive [s], but got {seconds:g}.")
    host, port = _address(coordinator)
    meeting = Meeting(process, processes, lost)
    if process == 0:
        meeting.gather(host, port, timeout)
    else:
        meeting.attend(host, port, timeout)
    return meeting


def _address(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 65536:
        raise InputError(
            f"Option --coordinator must be HOST:PORT, the address of process 0, but got {text!r}."
        )
    return host.strip("[]"), int(port)


def _by_cluster(timeout: float) -> tuple[str, int, int]:
    """Address, number of processes and this one's, from the cluster's variables."""
    try:
        from jax._src.clusters import ClusterEnv  # what jax.distributed.initialize() goes by

        found = ClusterEnv.auto_detect_unset_distributed_params(
            None, None, None, None, None, int(max(1, timeout))
        )[:3]
    except Exception:  # each kind of cluster fails in its own way
        found = (None,)
    if any(x is None for x in found):
        raise InputError(
            "The other processes of the study cannot be joined: no cluster's variables say who "
            "they are.  Give --coordinator HOST:PORT, --num-processes and --process-id to each."
        )
    return found


class Meeting:
    """The processes of one study, from the moment they have met.

    Attributes:
        share: (i, n): which of how many shares is this process's, from 1, for ``run_study``.
    """

    def __init__(self, process: int, processes: int, lost: float):
        self.share = process + 1, processes
        self._lost = lost
        #: Connections and who is behind them: to process 0, or at process 0 to all others.
        self._links: dict[int, _Link] = {}

    def gather(self, host: str, port: int, timeout: float) -> None:
        """Process 0: wait until all others have come, then let them begin."""
        processes, deadline = self.share[1], time.monotonic() + timeout
        try:
            family, *_, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
            here = host in ("localhost", "127.0.0.1", "::1")
            server = socket.create_server(place[:2] if here else ("", port), family=family)
        except OSError as error:
            raise InputError(
                f"Process 0 cannot listen at {host}:{port} ({error.strerror or error}); give "
                "--coordinator an address of the machine process 0 runs on, and a free port."
            ) from None
        wrong = ""
        with server:
            while len(self._links) < processes - 1 and not wrong:
                server.settimeout(max(0.05, deadline - time.monotonic()))
                try:
                    link = _Link(server.accept()[0], self._lost)
                    wrong = self._admit(link, processes)
                except TimeoutError:
                    missing = [i for i in range(1, processes) if i not in self._links]
                    wrong = (
                        f"of {processes} processes, number {', '.join(map(str, missing))} did not "
                        f"come to {host}:{port} within {timeout:g} s (--join-timeout)"
                    )
        for link in self._links.values():
            link.say({"error": wrong} if wrong else {"begin": True})
        if wrong:
            self.close()
            raise InputError(_cannot_join(wrong))

    def _admit(self, link: _Link, processes: int) -> str:
        """Take in whoever has connected; what is wrong with them, if anything."""
        about = link.hear(10.0)
        if about is None or about.get("study") != "martths":
            link.close()  # somebody else's connection
            return ""
        number, wrong = about.get("process"), ""
        if about.get("processes") != processes:
            wrong = f"process {number} was told of {about.get('processes')} processes, process 0 "
            wrong += f"of {processes} (--num-processes)"
        elif number in self._links or number == 0:
            other = self._links[number].who if number in self._links else "process 0 itself"
            wrong = f"process {number} came twice: {other} and {about.get('who')} (--process-id)"
        link.who = str(about.get("who"))
        if wrong:
            link.say({"error": wrong})
            link.close()
        else:
            self._links[number] = link
        return wrong

    def attend(self, host: str, port: int, timeout: float) -> None:
        """Another process: connect to process 0 and wait until all have come."""
        deadline, reason = time.monotonic() + timeout, ""
        link = None
        while link is None:
            try:
                left = max(0.1, min(10.0, deadline - time.monotonic()))
                link = _Link(socket.create_connection((host, port), timeout=left), self._lost)
            except OSError as error:
                reason = error.strerror or str(error)
                if time.monotonic() > deadline:
                    raise InputError(
                        _cannot_join(
                            f"nothing answered at {host}:{port} within {timeout:g} s ({reason}); "
                            "is --coordinator the address of process 0, and does it run?"
                        )
                    ) from None
                time.sleep(_PERIOD)
        who = f"process {os.getpid()} on {socket.gethostname()}"
        link.say({"study": "martths", "process": self.share[0] - 1, "processes": self.share[1],
                  "who": who})  # fmt: skip
        # Process 0 may have begun to wait later than this one.
        answer = link.hear(deadline - time.monotonic() + timeout + 10.0)
        if answer is None or "begin" not in answer:
            link.close()
            wrong = (answer or {}).get("error", f"process 0 at {host}:{port} ended or kept silent")
            raise InputError(_cannot_join(wrong))
        link.who = "process 0"
        self._links[0] = link

    def finish(self, reporter: Reporter) -> None:
        """Tell that this share is stored, and wait until all have told so.

        Raises:
            InputError: a process ended before it had.
        """
        if self.share[0] > 1:
            link = self._links[0]
            link.say({"done": True})
            answer = link.hear(None)
            self.close()
            if answer is None:
                raise InputError(
                    "Process 0 ended before it had written the results.  What is finished is "
                    "stored; give all processes the same command again to go on."
                )
            return
        waiting = dict(self._links)
        if waiting:
            reporter.notice("Waiting for the other processes to finish their shares.")
        lost = []
        for number, link in waiting.items():
            answer = link.hear(None)
            if answer is None or "done" not in answer:
                lost.append(f"{number} ({link.who})")
        for link in waiting.values():
            link.say({"end": True})
        self.close()
        if lost:
            raise InputError(
                f"Process {', '.join(lost)} ended before its share was done.  What is finished is "
                "stored; give all processes the same command again to go on."
            )

    def close(self) -> None:
        """Leave the others."""
        for link in self._links.values():
            link.close()


def _cannot_join(why: str) -> str:
    return f"The other processes of the study cannot be joined: {why}."


class _Link:
    """A connection that carries lines of JSON, and ends when the other side does."""

    def __init__(self, connection: socket.socket, lost: float):
        self.connection, self.who, self._rest = connection, "?", b""
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        # A machine that lost its power closes nothing: the system asks it, and gives up in time.
        for name, value in (("TCP_KEEPIDLE", lost / 2), ("TCP_KEEPINTVL", lost / 10),
                            ("TCP_KEEPCNT", 5)):  # fmt: skip
            with contextlib.suppress(OSError, AttributeError):
                option = getattr(socket, name)
                connection.setsockopt(socket.IPPROTO_TCP, option, max(1, round(value)))

    def say(self, message: dict) -> None:
        """Send a message; whoever has ended does not hear it."""
        with contextlib.suppress(OSError):
            self.connection.settimeout(10.0)
            self.connection.sendall(json.dumps(message).encode() + b"\n")

    def hear(self, timeout: float | None) -> dict | None:
        """The next message; None if the other side has ended, is silent or talks otherwise."""
        try:
            self.connection.settimeout(timeout)
            while b"\n" not in self._rest:
                piece = self.connection.recv(_LONGEST_LINE)
                if not piece or len(self._rest) > _LONGEST_LINE:
                    return None
                self._rest += piece
            line, _, self._rest = self._rest.partition(b"\n")
            found = json.loads(line)
        except (OSError, ValueError, RecursionError):
            return None
        return found if isinstance(found, dict) else None

    def close(self) -> None:
        """End the connection."""
        with contextlib.suppress(OSError):
            self.connection.close()
