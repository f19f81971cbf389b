"""Flags and names of JAX that nobody promises: still felt, and no harm where they are gone."""

from __future__ import annotations

import importlib.util
import os
import random
import re
import subprocess
import sys
import warnings
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import once, runtime, xla_flags

#: Back-end options of a process that unrolls loops, and takes loops over 8 x 512 numbers as large.
OTHERS = "xla_cpu_small_while_loop_byte_threshold=30000"


def loop(unique: float):
    """Some arithmetic in a loop over time."""
    return lambda x: jax.lax.scan(
        lambda c, _: (jnp.sin(c) * x + unique * c, None), x, None, length=99
    )[0]


def products(unique: float):
    """A product of small matrices in it."""
    m = jnp.full((8, 8), 0.1 * unique)
    return lambda x: jax.lax.scan(lambda c, _: (jnp.sin(m @ c) * x, None), x, None, length=99)[0]


def compiled(folder, columns: int, make=loop, **changed) -> tuple[str, str]:
    """A compiled program, and its code for LLVM after optimisation.

    The program is a new one at every call: one that comes from a cache leaves no files.

    Args:
        folder: for the compiler's own files.
        columns: its argument is (8, columns).
        make: of the program, from a number that no other has.
        changed: options in place of the package's; None leaves one out.
    """
    options = runtime.compiler_options() | {"xla_backend_optimization_level": 3} | changed
    # JAX 0.12 writes the code for LLVM only of emitters that are named.
    options |= {"xla_dump_to": str(folder), "xla_dump_emitter_re": ".*"}
    options = {k: v for k, v in options.items() if v is not None}
    x = jnp.ones((8, columns))
    function = make(0.5 + 1e-6 * random.SystemRandom().random())
    text = jax.jit(function, compiler_options=options).lower(x).compile().as_text()
    # Metadata quote the program's own names.
    text = re.sub(r", metadata=\{.*?\}", "", text)
    code = "".join(p.read_text() for p in sorted(Path(folder).glob("*ir-with-opt.ll")))
    assert code, "the compiler wrote no code for LLVM"
    return text, code


@pytest.fixture(scope="module")
def ours(tmp_path_factory):
    return compiled(tmp_path_factory.mktemp("ours"), 64)


@pytest.fixture(scope="module")
def others(tmp_path_factory):
    """What a process without the package's back-end options makes of a small and a large loop."""
    folder = tmp_path_factory.mktemp("others")
    code = (
        "from tests.engine.test_flags import compiled\n"
        "for columns in (64, 512):\n"
        f"    text, ir = compiled({str(folder)!r} + str(columns), columns)\n"
        "    print('xla_cpu_small_call' in text, len(ir))"
    )
    environment = os.environ | {"XLA_FLAGS": f"--xla_backend_extra_options={OTHERS}"}
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True,
                          text=True, cwd=root)  # fmt: skip
    assert done.returncode == 0, done.stderr
    (small, size), (large, _) = (line.split() for line in done.stdout.splitlines())
    return {"small": small == "True", "large": large == "True", "size": int(size)}


def test_a_large_loop_is_one_kernel(others, tmp_path):
    text, _ = compiled(tmp_path, 512)
    assert 'xla_cpu_small_call="true"' in text
    assert others["small"] and not others["large"]


def test_loops_over_the_trials_are_not_written_out(ours, others):
    assert len(ours[1]) < 0.8 * others["size"]


def test_vectors_have_their_full_width(ours, tmp_path):
    widths = lambda ir: set(re.findall(r'"prefer-vector-width"="(\d+)"', ir))  # noqa: E731
    assert widths(ours[1]) == {"512"}
    _, ir = compiled(tmp_path, 64, xla_cpu_prefer_vector_width=None)
    assert widths(ir) and widths(ir) != {"512"}


def test_small_products_are_no_library_calls(tmp_path):
    text, _ = compiled(tmp_path / "ours", 64, products)
    assert "ynn" not in text and "custom-call" not in text
    text, _ = compiled(tmp_path / "other", 64, products, xla_cpu_experimental_ynn_fusion_type=None)
    if "ynn" not in text:
        pytest.skip(f"JAX {jax.__version__} makes no such calls by itself")
    assert "xla_cpu_small_call" not in text


def test_the_older_generator_makes_the_code(tmp_path):
    if "xla_cpu_use_fusion_emitters" not in runtime.compiler_options():
        pytest.skip(f"JAX {jax.__version__} has the newer one alone")
    ours, _ = compiled(tmp_path / "ours", 64, products)
    text, _ = compiled(tmp_path / "other", 64, products, xla_cpu_use_fusion_emitters=None)
    assert ours.count(" fusion(") < text.count(" fusion(")


def test_an_unknown_compiler_option_is_left_out_with_one_warning(monkeypatch):
    before = runtime.compiler_options()
    options = {"xla_cpu_no_such_option": 3} | runtime.COMPILER_OPTIONS
    monkeypatch.setattr(runtime, "COMPILER_OPTIONS", options)
    runtime.compiler_options.cache_clear()
    try:
        with pytest.warns(UserWarning, match="not know xla_cpu_no_such_option; .*longer") as told:
            known = runtime.compiler_options()
        assert runtime.compiler_options() is known and len(told) == 1
        assert known == before
        monkeypatch.setattr(runtime, "UNMISSED", ("xla_cpu_no_such_option", *runtime.UNMISSED))
        runtime.compiler_options.cache_clear()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert runtime.compiler_options() == before
    finally:
        runtime.compiler_options.cache_clear()


def test_an_unknown_back_end_option_is_ignored():
    """XLA ignores what begins with xla_; anything else goes to LLVM, which ends the process."""
    names = [option.partition("=")[0] for option in runtime.XLA_EXTRA_OPTIONS.split(",")]
    assert all(name.startswith("xla_") for name in names)
    flags = f"--{runtime.EXTRA}=xla_cpu_no_such_option=3,{runtime.XLA_EXTRA_OPTIONS}"
    code = "import martths_jax, jax; print(jax.numpy.ones(3).sum())"
    done = subprocess.run([sys.executable, "-c", code], env=os.environ | {"XLA_FLAGS": flags},
                          capture_output=True, text=True)  # fmt: skip
    assert (done.returncode, done.stdout) == (0, "3.0\n"), done.stderr


def test_a_flag_that_xla_no_longer_knows_is_not_set(monkeypatch):
    monkeypatch.setattr(xla_flags, "TRIED", (0, 0))
    assert xla_flags.flag_is_known(runtime.EXTRA)
    assert not xla_flags.flag_is_known("xla_no_such_flag")
    monkeypatch.setattr(runtime, "EXTRA", "xla_no_such_flag")
    monkeypatch.setattr(runtime, "_backend_is_up", lambda: False)
    monkeypatch.setenv("XLA_FLAGS", "--xla_force_host_platform_device_count=2")
    with pytest.warns(UserWarning, match="not know xla_no_such_flag; simulations take longer"):
        runtime.configure()
    assert os.environ["XLA_FLAGS"] == "--xla_force_host_platform_device_count=2"


def test_a_jax_without_metadata_costs_time_and_not_the_import(monkeypatch):
    monkeypatch.setitem(sys.modules, "jax.experimental.xla_metadata", None)
    spec = importlib.util.spec_from_file_location("once_without", once.__file__)
    without = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(without)
    assert without.set_xla_metadata is not once.set_xla_metadata
    stage = lambda x: x * jnp.sin(x) - x  # noqa: E731
    x = jnp.linspace(0.1, 2.0, 5)
    for change in (lambda f: f, jax.jacfwd, jax.jacrev):
        found, expected = (jax.jit(change(m.once(stage)))(x) for m in (without, once))
        np.testing.assert_allclose(found, expected, rtol=1e-14)
