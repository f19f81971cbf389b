"""How many trials fit: the chunk of a study from the memory that is free."""

from __future__ import annotations

from collections.abc import Sequence

import jax

from martths_jax.errors import InputError
from martths_jax.indices import Index, observers_of
from martths_jax.resources import available_memory
from martths_jax.simulation import room_for

GB = 1e9
#: Most blocks in a chunk: more would save no time and lose more work when a run is killed.
MOST_BLOCKS = 16
#: Noise as kept for the chunk, and once more for what exists while a block is drawn.
COPIES = 2
#: Memory of a trial's results under a controller and motion as they are put together [bytes]: 24
#: indices, first samples and peaks as numbers, and once more as they are stacked.
RESULT_BYTES = 2 * 8 * 36
#: A chunk's noise is kept below this, however much memory is free [bytes].
ENOUGH = 0.5e9


def lane_bytes(samples: int, channels: int) -> int:
    """Memory that one trial of a chunk takes [bytes]: its noise, the rest is small."""
    return 8 * room_for(samples) * channels * COPIES


def running_bytes(indices: Sequence[Index], fs: float) -> int:
    """Memory that a trial's indices take while its block runs [bytes]."""
    state = jax.eval_shape(lambda: [one.init(1) for one in observers_of(indices, fs)])
    return sum(8 * leaf.size for leaf in jax.tree.leaves(state))


def check_results(trials: int, cells: int) -> None:
    """Refuse a study whose results would not fit, since they are put together in memory.

    Args:
        trials: number of trials.
        cells: controllers times motions.

    Raises:
        InputError: if they are larger than the memory that is free.
    """
    need, free = RESULT_BYTES * trials * cells, available_memory()
    if need > free:
        raise InputError(
            f"Results of {trials} trials take {need / GB:.3g} GB, but {free / GB:.2g} GB are free; "
            "run fewer trials, or shares of them here and the whole on a larger machine."
        )


def choose_chunk(
    samples: int,
    channels: int,
    lanes: int,
    devices: int,
    memory_gb: float | None = None,
    running: int = 0,
) -> tuple[int, int]:
    """Devices to use and trials in a chunk, so that the chunk stays within a quarter of the free
    memory (or within `memory_gb`).

    Args:
        samples: length of the longest motion.
        channels: sequences of noise a trial.
        lanes: trials side by side on a device.
        devices: devices there are.
        memory_gb: bound set by the user [GB].
        running: memory that a trial takes only while its block runs [bytes], one block a device.

    Raises:
        InputError: if not even one device's trials fit.
    """
    free = available_memory()
    bound = memory_gb * GB if memory_gb else min(free / 4, ENOUGH)
    each, running = lane_bytes(samples, channels) * lanes, running * lanes
    # One block a device is the least there is; then it may take half of what is free.
    affordable = int((bound if memory_gb else max(bound, free / 2)) // (each + running))
    if affordable < 1:
        given = (
            f"`memory_gb` (--memory) is {memory_gb:g} GB"
            if memory_gb
            else f"{free / GB:.2g} GB are free"
        )
        need = (each + running) / GB
        raise InputError(
            f"One chunk of {lanes} trials over {samples} samples takes {need:.2g} GB, but "
            f"{given}; free some memory or shorten the motions."
        )
    devices = min(devices, affordable)
    block = lanes * devices
    blocks = max(1, min(MOST_BLOCKS, int((bound / devices - running) // each)))
    return devices, block * blocks
