"""Several processes, on one machine or many, work on one study in a folder they all see.

JAX's own distributed runtime says which process this is and of how many, and ends all of them when
one dies (what is stored stays, and the same command resumes).  Each process runs its share of the
trials; process 0 waits for all of them and writes the results.
"""

from __future__ import annotations

import time

import jax

from martths_jax.errors import InputError, raise_all
from martths_jax.study.progress import Reporter
from martths_jax.study.store import RunFolder

#: Seconds between looks at the folder.
PERIOD = 0.2


def join(
    coordinator: str | None, processes: int | None, process: int | None, timeout: int = 300
) -> tuple[int, int]:
    """Join the other processes; must be called before JAX is used.

    Args:
        coordinator: address host:port of process 0; None goes by the cluster's variables (Slurm,
            Open MPI and others that JAX knows).
        processes: how many there are.
        process: which one this is, from 0.
        timeout: how long to wait for the others [s].

    Returns:
        (share, shares), the share from 1, for ``run_study``.

    Raises:
        InputError: if the options are not complete or the others cannot be found.
    """
    given = {"--coordinator": coordinator, "--num-processes": processes, "--process-id": process}
    if coordinator is not None or processes is not None or process is not None:
        raise_all(
            f"Option {name} is missing; {', '.join(given)} belong together."
            for name, value in given.items()
            if value is None
        )
        if not 0 <= process < processes:
            raise InputError(
                f"Option --process-id must lie in 0 ... {processes - 1}, but got {process}."
            )
    try:
        jax.distributed.initialize(coordinator, processes, process, initialization_timeout=timeout)
    except (RuntimeError, ValueError) as error:
        raise InputError(
            f"The other processes of the study cannot be joined: {str(error).splitlines()[0]}  "
            "Give --coordinator HOST:PORT, --num-processes and --process-id to each of them."
        ) from None
    return jax.process_index() + 1, jax.process_count()


def wait_for_all(run: RunFolder, reporter: Reporter) -> None:
    """Wait until every share of the study is stored, then leave the runtime.

    Every process calls this, so that none of them is missed while process 0 writes the results.
    """
    told = False
    while run.missing():
        if not told:
            reporter.notice("Waiting for the other processes to finish their shares.")
            told = True
        time.sleep(PERIOD)
    jax.distributed.shutdown()
