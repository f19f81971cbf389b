"""What decides the last bits of a result besides code, versions and inputs: how XLA compiles here.

The same program compiled for another instruction set, or under other flags, rounds otherwise; the
numbers are as right, but they are others.  Bits are the same between two machines for which
``machine_identity`` is the same.
"""

from __future__ import annotations

import os
import re
from functools import lru_cache

import jax
import jax.numpy as jnp

from martths_jax.campaign.checksum import json_digest
from martths_jax.runtime import compiler_options

#: Flags that change how a run goes, not what it computes.
_NO_NUMBERS = re.compile(
    r"--xla_(force_host_platform_device_count|dump_\w+|cpu_parallel_codegen_split_count"
    r"|hlo_profile|log\w*|vlog\w*)\b"
)
#: Said where results of two kinds of machines are mixed; docs/study.md has the measurement.
MIXED_NOTE = (
    "Their numbers are equally right, but differ in the last digits: by less than 1e-10 of a "
    "number as a rule, by more where a trial is near the limit of stability."
)


def machine_identity() -> dict[str, str]:
    """Back-end, processor and instruction set as XLA uses them, flags and compiler options."""
    return {
        "backend": jax.default_backend(),
        "processor": _target()[0],
        "instructions": _target()[1],
        "xla_flags": " ".join(flags_that_count(os.environ.get("XLA_FLAGS", ""))),
        "compiler_options": " ".join(f"{k}={v}" for k, v in sorted(compiler_options().items())),
        "matmul_precision": str(jax.config.jax_default_matmul_precision or "default"),
    }


def machine_digest() -> str:
    """``machine_identity`` in short."""
    return json_digest(machine_identity())[:16]


def flags_that_count(flags: str) -> list[str]:
    """Those of the environment's XLA flags that can change a number, in order."""
    return sorted(flag for flag in flags.split() if not _NO_NUMBERS.match(flag))


@lru_cache(maxsize=1)
def _target() -> tuple[str, str]:
    """Processor and instruction set that a compiled program names."""
    device = jax.local_devices()[0]
    if device.platform != "cpu":
        return device.device_kind, ""
    try:
        compiled = jax.jit(lambda x: jnp.sin(x) + x @ x).lower(jnp.ones((4, 4))).compile()
        executable = compiled.runtime_executable()
        text = executable.serialize()
    except Exception:  # not every JAX lets a program be written down
        text = b""
    # The target machine stands in it as text: processor, then +avx2,...,-avx512f,...
    found = re.search(rb"([\w.\-]+)\x1a..?((?:[+-][a-z0-9_.\-]+,){8,}[+-][a-z0-9_.\-]+)", text)
    if found is None:
        return device.device_kind, _processor_flags()
    has = sorted(w[1:] for w in found[2].decode().split(",") if w.startswith("+"))
    return found[1].decode(), " ".join(has)


def _processor_flags() -> str:
    """Instruction set that the operating system reports, where XLA does not say what it uses."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as file:
            line = next((x for x in file if x.startswith(("flags", "Features"))), "")
    except OSError:
        return ""
    return " ".join(sorted(line.partition(":")[2].split()))
