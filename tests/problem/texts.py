"""Problem files that several tests read, written as text."""

from martths_jax.problem.file.document import Document
from martths_jax.problem.file.structure import StructureData, read_structure

STEEL = "E = 210e9, A = 4e-3, I = 3e-5"
STOUT = f"{STEEL}, G = 81e9, A_s = 2e-3"


def read(text: str, folder=None) -> StructureData:
    """The structure of a text; every fault is raised."""
    document = Document(text, (folder / "problem.toml") if folder else "problem.toml")
    data = read_structure(document)
    document.finish()
    return data


def toml_of(frame, more: str = 'ground = "x"', damping: str = 'kind = "none"') -> str:
    """A ``PlanarFrame`` as a problem file; every member gets a section of its own."""
    lines = ['units = "SI"', more, "[damping]", damping, "[nodes]"]
    lines += [f'"{n}" = {{x = {float(p.x)!r}, y = {float(p.y)!r}}}' for n, p in frame.nodes.items()]
    lines.append("[sections]")
    for name, m in frame.members.items():
        s, stuff = frame.sections[m.section], frame.materials[m.material]
        shear = "" if s.A_s == float("inf") else f", G = {float(stuff.G)!r}, A_s = {float(s.A_s)!r}"
        lines.append(
            f'"{name}" = {{E = {float(stuff.E)!r}, A = {float(s.A)!r}, I = {float(s.I)!r}{shear}, '
            f"density = {float(stuff.density)!r}}}"
        )
    lines.append("[members]")
    for name, m in frame.members.items():
        release = ", ".join(f'"{end}"' for end in m.release)
        lines.append(
            f'"{name}" = {{ends = ["{m.start}", "{m.end}"], section = "{name}", '
            f"rigid_start = {float(m.rigid_start)!r}, rigid_end = {float(m.rigid_end)!r}, "
            f"rigid_axially = {str(m.rigid_axially).lower()}, release = [{release}], "
            f'carried = {float(m.carried)!r}, mass = "{m.mass}", '
            f"rotatory = {str(m.rotatory).lower()}}}"
        )
    lines.append("[supports]")
    for node, held in frame.supports.items():
        lines.append(f'"{node}" = [{", ".join(f"{d!r}" for d in held)}]')
    for dof, mass in frame.masses.items():
        node, _, direction = dof.partition(".")
        key = {"": "m", "x": "m_x", "y": "m_y", "rotation": "I"}[direction]
        lines += [
            "[[masses]]",
            f'node = "{node}"',
            f'name = "at {dof}"',
            f"{key} = {float(mass)!r}",
        ]
    for relation in frame.constraints:
        terms = ", ".join(f'"{n}" = {float(c)!r}' for n, c in relation.terms.items())
        lines += ["[[constraints]]", f'dof = "{relation.follower}"', f"equals = {{{terms}}}"]
    return "\n".join(lines) + "\n"
