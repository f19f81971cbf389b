"""Numba with the processor's full vector width, which has to be set before it starts."""

import os

from llvmlite import binding

# Full AVX-512 vectors where the processor has them; LLVM keeps to half of that by default.
_features = binding.get_host_cpu_features()
if _features.get("avx512f"):
    os.environ.setdefault("NUMBA_CPU_NAME", binding.get_host_cpu_name())
    os.environ.setdefault("NUMBA_CPU_FEATURES", _features.flatten() + ",-prefer-256-bit")

import numba  # noqa: E402

__all__ = ["numba"]
