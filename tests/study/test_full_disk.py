"""Every writer under a limit on the size of files: one sentence, nothing half, no crash."""

import json
import os
import subprocess
import sys

import pytest

#: Bytes that a file may have; every file of the writers below is larger.
LIMIT = 5_000
CODE = """
import json, resource, sys
from pathlib import Path
import numpy as np, xarray as xr
from martths_jax import InputError, Motion
from martths_jax.figures.style import Drawing, new_figure, save
from martths_jax.study import make_config
from martths_jax.campaign.dataset import save_dataset, write_dataset
from martths_jax.campaign.draws import write_plants
from martths_jax.campaign.formats.mat import write_mat
from martths_jax.campaign.files import write_text, writing
from martths_jax.campaign.plan import build_plan
from martths_jax.campaign.session import header
from martths_jax.study.runner import write_results
from martths_jax.campaign.store import RunFolder
from tests.study.small_outcome import outcome

out, limit = Path(sys.argv[1]), int(sys.argv[2])
motion = Motion("m", np.ones(600), 1024.0)
plan = build_plan(make_config(trials=40, motions=(motion,), controllers=("passthrough",)))
run = RunFolder.start(out / "run", header(plan, ""))
run.write("passthrough", "m", np.arange(41), outcome(41))
done = write_results(run)
dataset = done.dataset
run.close()
figure = new_figure(80, 60)
figure.subplots().plot(np.random.rand(2000), "o")
drawing = Drawing(figure, {"x": np.random.rand(2000)}, "")

def grow(path):
    small = xr.Dataset({"x": ("n", np.arange(9.0))}, attrs={"format": 1})
    with writing(path) as part:
        for i in range(40):
            write_dataset(small, part, f"/g{i}" if i else None)

writers = {
    "study.nc": lambda p: save_dataset(dataset, p),
    "signals.nc": grow,
    "study.csv": lambda p: done.write_csv(p),
    "study.mat": lambda p: write_mat(dataset, p),
    "plants.csv": lambda p: write_plants(plan.draws.plants(np.arange(1, 41)), p),
    "summary.md": lambda p: write_text(p, "x" * 2 * limit),
    "figure.png": lambda p: save(drawing, p.parent, "figure", ("png",)),
    "figure.pdf": lambda p: save(drawing, p.parent, "figure", ("pdf",)),
    "part.npz": lambda p: run.write("passthrough", "other", np.arange(41), outcome(41)),
}
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
for name, write in writers.items():
    (out / name).write_text("old")
    try:
        write(out / name)
        told = "written"
    except InputError as error:
        told = f"InputError: {error}"
    kept = (out / name).read_text() == "old"
    left = [str(p) for p in out.rglob(".*")] + [str(p) for p in out.rglob("*other/*.npz")]
    print(json.dumps([name, told, kept, left]), flush=True)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no limit on the size of files")
def test_every_writer_says_what_the_system_refused(tmp_path):
    root = os.path.dirname(os.path.dirname(os.path.dirname(__file__)))
    done = subprocess.run(
        [sys.executable, "-c", CODE, str(tmp_path), str(LIMIT)],
        capture_output=True, text=True, cwd=root, check=False,
    )  # fmt: skip
    # HDF5 used to end the process here, once a file could not be closed.
    assert (done.returncode, done.stderr) == (0, "")
    found = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(found) == 9
    for name, told, kept, left in found:
        assert told.startswith("InputError: Cannot write"), (name, told)
        assert "File too large" in told and kept and not left, (name, told, left)
