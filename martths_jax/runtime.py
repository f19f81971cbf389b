"""Switches of the JAX runtime that this package needs, set in one place and before JAX starts."""

from __future__ import annotations

import os
import re
import sys
import warnings
from functools import lru_cache
from pathlib import Path

import jax

from martths_jax.xla_flags import flag_is_known


def _backend_is_up() -> bool:
    bridge = sys.modules.get("jax._src.xla_bridge")
    return bool(bridge is not None and bridge.backends_are_initialized())


#: Back-end options, which act on the whole process; XLA ignores those it does not know, as long as
#: their names begin with "xla_" (it hands others to LLVM, which ends the process).  The first
#: compiles a time loop into one kernel instead of a list of some hundred kernels that are started
#: one by one, each for half a microsecond: three times faster here.  The second leaves loops over
#: the trials as loops of vector operations; LLVM would write many of them out trial by trial
#: before it looks for vectors, which costs a third more time to compile and some to run.
EXTRA = "xla_backend_extra_options"
XLA_EXTRA_OPTIONS = (
    "xla_cpu_small_while_loop_byte_threshold=1000000000000,xla_cpu_disable_loop_unrolling"
)
#: Options of the simulation's programs: vectors of the full AVX-512 width; no library calls for
#: small matrix products, which would keep the loop from becoming one kernel; XLA's older code
#: generator for fused operations, which compiles a third faster to code of the same speed.
COMPILER_OPTIONS = {
    "xla_cpu_prefer_vector_width": 512,
    "xla_cpu_experimental_ynn_fusion_type": "",
    "xla_cpu_use_fusion_emitters": False,
}
#: What it costs to go without an option.
SLOWER = "simulations take longer, up to three times, and their results agree to rounding"


@lru_cache(maxsize=1)
def compiler_options() -> dict[str, object]:
    """Those of ``COMPILER_OPTIONS`` that this JAX knows, for ``jax.jit``; none off the CPU.

    Warns, once a process, of those it does not know.
    """
    if jax.default_backend() != "cpu":
        return {}
    known = {}
    for name, value in COMPILER_OPTIONS.items():
        try:
            jax.jit(lambda x: x + 1, compiler_options={name: value})(0.0)
        except jax.errors.JaxRuntimeError:
            continue
        known[name] = value
    if unknown := ", ".join(name for name in COMPILER_OPTIONS if name not in known):
        warnings.warn(f"JAX {jax.__version__} does not know {unknown}; {SLOWER}.", stacklevel=2)
    return known


def cache_folder() -> Path | None:
    """Folder for what can be made again: ``$MARTHS_CACHE``, else the platform's place for caches.

    None for none: ``MARTHS_CACHE=off``, or there is no home folder.
    """
    if (given := os.environ.get("MARTHS_CACHE")) is not None:
        return None if given.lower() in ("", "0", "off", "no") else Path(os.path.expanduser(given))
    try:
        if sys.platform == "win32":
            base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
        elif sys.platform == "darwin":
            base = Path.home() / "Library" / "Caches"
        else:
            base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    except RuntimeError:  # no home
        return None
    return Path(base) / "martths_jax"


def keep_programs() -> None:
    """Turn on JAX's persistent compilation cache, unless one is set or it cannot be written."""
    folder = cache_folder()
    if jax.config.jax_compilation_cache_dir or folder is None:
        return
    folder /= "xla"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return
    if os.access(folder, os.W_OK):
        jax.config.update("jax_compilation_cache_dir", str(folder))
        # A start compiles some hundred small programs, which together take as long as a large one.
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.01)


def usable_cores() -> int:
    """Number of CPU cores this process may run on."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS or Windows
        return os.cpu_count() or 1


def configure() -> None:
    """Float64, kept programs, one XLA device per core, and the measured compiler options.

    Runs when the package is imported.  The last two need a JAX that has not started yet: if a
    program used JAX before importing this package they are left alone, which costs speed and
    nothing else.  ``MARTHS_DEVICES`` sets the number of CPU devices, and whatever ``XLA_FLAGS``
    or ``JAX_NUM_CPU_DEVICES`` already say wins.
    """
    jax.config.update("jax_enable_x64", True)
    keep_programs()
    if _backend_is_up():
        return
    flags = os.environ.get("XLA_FLAGS", "")
    if EXTRA not in flags:
        if flag_is_known(EXTRA):
            flags = f"{flags} --{EXTRA}={XLA_EXTRA_OPTIONS}".strip()
            os.environ["XLA_FLAGS"] = flags
        else:
            warnings.warn(f"JAX {jax.__version__} does not know {EXTRA}; {SLOWER}.", stacklevel=2)
    chosen = re.search(r"xla_force_host_platform_device_count", flags)
    if not chosen and "JAX_NUM_CPU_DEVICES" not in os.environ:
        devices = int(os.environ.get("MARTHS_DEVICES") or usable_cores())
        jax.config.update("jax_num_cpu_devices", devices)


configure()
