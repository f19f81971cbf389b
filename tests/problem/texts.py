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
    lines += [f'"{n}" = {{x = {p.x!r}, y = {p.y!r}}}' for n, p in frame.nodes.items()]
    lines.append("[sections]")
    for name, m in frame.members.items():
        s, stuff = frame.sections[m.section], frame.materials[m.material]
        shear = "" if s.A_s == float("inf") else f", G = {stuff.G!r}, A_s = {s.A_s!r}"
        lines.append(
            f'"{name}" = {{E = {stuff.E!r}, A = {s.A!r}, I = {s.I!r}{shear}, '
            f"density = {stuff.density!r}}}"
        )
    lines.append("[members]")
    for name, m in frame.members.items():
        release = ", ".join(f'"{end}"' for end in m.release)
        lines.append(
            f'"{name}" = {{ends = ["{m.start}", "{m.end}"], section = "{name}", '
            f"rigid_start = {m.rigid_start!r}, rigid_end = {m.rigid_end!r}, "
            f"rigid_axially = {str(m.rigid_axially).lower()}, release = [{release}], "
            f'carried = {m.carried!r}, mass = "{m.mass}", rotatory = {str(m.rotatory).lower()}}}'
        )
    lines.append("[supports]")
    for node, held in frame.supports.items():
        lines.append(f'"{node}" = [{", ".join(f"{d!r}" for d in held)}]')
    for dof, mass in frame.masses.items():
        node, _, direction = dof.partition(".")
        key = {"": "m", "x": "m_x", "y": "m_y", "rotation": "I"}[direction]
        lines += ["[[masses]]", f'node = "{node}"', f'name = "at {dof}"', f"{key} = {mass!r}"]
    for relation in frame.constraints:
        terms = ", ".join(f'"{n}" = {c!r}' for n, c in relation.terms.items())
        lines += ["[[constraints]]", f'dof = "{relation.follower}"', f"equals = {{{terms}}}"]
    return "\n".join(lines) + "\n"
