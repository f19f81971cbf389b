"""Write tall_frame.toml: the maRTHS benchmark's frame with storeys of 0.80 m instead of 0.635 m.

    python experiments/problems/make_frame.py

Frame, masses and damping are the package's own, at another geometry; the interior bay of the ground
storey stands in the laboratory and is taken out of the computed part exactly, which the published
partition does not do.  Coupler and plants are the benchmark's.
"""

from pathlib import Path

import numpy as np

from martths_jax import build_benchmark
from martths_jax.benchmark import LAYOUT
from martths_jax.plant import PARAMETERS, SIGMA
from martths_jax.structure.frame import planar_frame
from martths_jax.structure.sections import FrameGeometry
from martths_jax.transfer import FRAME_POLE_HZ, NOMINAL_GAIN, NOMINAL_HZ

STOREY = 0.80
LABORATORY = ("column base 2-4", "column base 3-7", "beam 4-7")
#: Zeros and poles of H_ij, by the names of the uncertain parameters.
COLUMN_1 = ("zero1_col1", "zero2_col1")
ZEROS = [[COLUMN_1, ("zero_h12",)], [COLUMN_1, ("zero_h22",)]]
POLES = [("pole1_col1", "pole2_col1"), ("pole1_col2", "pole2_col2")]


def quoted(names) -> str:
    return "[" + ", ".join(f'"{name}"' for name in names) + "]"


def frame_tables() -> list[str]:
    frame = planar_frame(FrameGeometry(storey=STOREY))
    lines = ["[nodes]"]
    lines += [f'"{n}" = {{x = {p.x:.10g}, y = {p.y:.10g}}}' for n, p in frame.nodes.items()]
    lines.append("\n[sections]")
    for name, s in frame.sections.items():
        steel = next(iter(frame.materials.values()))
        lines.append(f'"{name}" = {{E = {steel.E!r}, G = {steel.G!r}, A = {s.A!r}, I = {s.I!r}, '
                     f"A_s = {s.A_s!r}}}")  # fmt: skip
    lines.append("\n[members]")
    for name, m in frame.members.items():
        more = f", rigid_end = {m.rigid_end!r}" if m.rigid_end else ""
        more += f", release = {quoted(m.release)}" if m.release else ""
        ends = quoted([m.start, m.end])
        lines.append(f'"{name}" = {{ends = {ends}, section = "{m.section}"{more}}}')
    lines.append("\n[supports]")
    lines += [f'"{n}" = {quoted(d.replace("rotation", "r") for d in held)}'
              for n, held in frame.supports.items()]  # fmt: skip
    for relation in frame.constraints:
        terms = ", ".join(f'"{dof}" = {value!r}' for dof, value in relation.terms.items())
        lines += ["", "[[constraints]]", f'dof = "{relation.follower}"', f"equals = {{{terms}}}"]
    masses: dict[str, list[str]] = {}
    for dof, mass in frame.masses.items():
        node, _, direction = dof.rpartition(".")
        masses.setdefault(node, []).append(f"m_{direction} = {mass!r}")
    for node, numbers in masses.items():
        lines += ["", "[[masses]]", f'node = "{node}"', *numbers]
    return lines


def rig_tables() -> list[str]:
    coupler, valves = build_benchmark().coupler, LAYOUT.valves
    arm, alpha = float(coupler.arm), float(coupler.alpha)
    lines = []
    for i, sign in ((0, -1), (1, 1)):
        at = f"[{arm * np.cos(alpha):.12g}, {sign * arm * np.sin(alpha):.12g}]"
        lines += ["", "[[actuators]]", f'name = "{i + 1}"', 'node = "4"', f"attachment = {at}",
                  "direction = [1.0, 0.0]", f"volt_per_mm = {valves.volt_per_mm[i]!r}",
                  f"volt_offset = {valves.volt_offset[i]!r}"]  # fmt: skip
    lines += ["", "[valves]", f"limit = {valves.limit}", "", "[sensors]", "noise_power = 1.5e-7",
              "shared = true"]  # fmt: skip
    pair = f'{{by = "frame_pair", re = {FRAME_POLE_HZ.real}, im = {FRAME_POLE_HZ.imag}}}'
    for i in range(2):
        for j in range(2):
            lines += ["", "[[plant]]", f'output = "{i + 1}"', f'input = "{j + 1}"',
                      f"zeros = {quoted(ZEROS[i][j])}",
                      f"poles = {quoted(POLES[j])[:-1]}, {pair}]",
                      f"gain = {float(NOMINAL_GAIN[i, j])}",
                      'gain_as = "nominal"']  # fmt: skip
    lines += ["", "[uncertain]"]
    for name, value, sigma in zip(PARAMETERS, NOMINAL_HZ, SIGMA, strict=True):
        unit = "1" if value == 1 else "Hz"
        numbers = f"nominal = {float(value)}, sigma = {float(sigma)}"
        lines.append(f'{name} = {{{numbers}, unit = "{unit}"}}')
    return lines


def main() -> None:
    head = [
        "# Written by make_frame.py: the maRTHS benchmark's frame with storeys of 0.80 m.",
        'units = "SI"', "fs = 1024.0", 'integrator = "newmark"', "",
        f"laboratory = {quoted(LABORATORY)}", 'interface = ["4.x", "4.r"]',
        'outputs = ["4.x", "4.r", "2.x", "3.x"]', 'ground = "x"', "condense = false", "",
    ]  # fmt: skip
    damping = ["", "[damping]", 'kind = "rayleigh"', "modes = [1, 3]", "ratio = 0.05"]
    text = "\n".join([*head, *frame_tables(), *damping, *rig_tables()]) + "\n"
    Path(__file__).with_name("tall_frame.toml").write_text(text, "utf-8")


if __name__ == "__main__":
    main()
