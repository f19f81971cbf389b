"""The house: who may look at whom, who may name a controller, and how long a room may be."""

import ast
import re
from pathlib import Path

import martths_jax

HOUSE = Path(martths_jax.__file__).parent
#: Floors from the ground up; a room may only look down, and at its own floor's other rooms only
#: where the pair stands in ``BESIDE``.
FLOORS = (
    ("errors", "text", "screen", "once", "published", "_version", "xla_flags", "resources",
     "claims"),
    ("files", "runtime", "guests"),
    ("algebra", "structure"),
    ("motions",),
    ("layout", "sensors", "transfer"),
    ("coupler", "plant", "rig"),
    ("control", "benchmark", "signals"),
    ("observers",),
    ("indices",),
    ("watch",),
    ("loop", "reference"),
    ("checks", "result"),
    ("blocks",),
    ("problem",),
    ("simulation", "stability"),
    ("nominal", "campaign"),
    ("study", "conformity"),
    ("figures",),
    ("sweep", "sensitivity", "tune"),
    ("report",),
    ("leaderboard",),
    ("cli",),
)  # fmt: skip
FLOOR = {room: i for i, rooms in enumerate(FLOORS) for room in rooms}
#: (who looks, at whom) on one floor.
BESIDE = {("algebra", "structure"), ("structure", "algebra"), ("control", "benchmark"),
          ("benchmark", "control"), ("control", "signals"), ("signals", "control"),
          ("sensitivity", "sweep"), ("tune", "sweep")}  # fmt: skip
#: What may name a controller outside of their own folder: what is printed, and the package's face.
NAMING = {"published.py", "__init__.py"}


def rooms():
    for path in sorted(HOUSE.rglob("*.py")):
        where = path.relative_to(HOUSE)
        yield path, where, where.with_suffix("").parts[0]


def imports(path):
    """Modules of this package that a file imports when it is imported; not those of functions."""
    tree = ast.parse(path.read_text("utf-8"))
    todo = list(tree.body)
    while todo:
        node = todo.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("martths_jax"):
            if node.module == "martths_jax":
                yield from (f"martths_jax.{alias.name}" for alias in node.names)
            else:
                yield node.module
        todo += [x for x in ast.iter_child_nodes(node) if not isinstance(x, ast.FunctionDef)]


def test_rooms_look_down_only():
    wrong = []
    for path, where, room in rooms():
        if where.parts == ("__init__.py",):
            continue
        for module in imports(path):
            other = module.split(".")[1]
            if other not in FLOOR:
                continue  # a name of the package's face
            down = FLOOR[other] < FLOOR[room] or other == room
            if not (down or (room, other) in BESIDE):
                wrong.append(f"{where} looks up at {module}")
    assert not wrong, "\n".join(wrong)


def test_problem_files_are_read_without_a_rig():
    """The structural half stands on structures alone, so that others may read such files too."""
    allowed = {"problem", "structure", "errors", "text", "files"}
    structural = ("document", "table", "lines", "frame", "relations", "sources", "matrices",
                  "damping", "building", "data", "structure", "template")  # fmt: skip
    for name in structural:
        found = {module.split(".")[1] for module in imports(HOUSE / "problem/file" / f"{name}.py")}
        assert found <= allowed, f"{name} looks at {found - allowed}"


def test_every_room_has_a_floor():
    found = {room for _, _, room in rooms()} - {"__init__"}
    assert found <= set(FLOOR) and set(FLOOR) <= found


def test_no_one_else_names_a_controller():
    """Code, not prose: string constants and identifiers outside the controllers' own folder."""
    named = re.compile(r"^(adfc|lqg|passthrough)$", re.IGNORECASE)
    wrong = []
    for path, where, _ in rooms():
        if where.parts[:2] == ("control", "controllers") or where.name in NAMING:
            continue
        tree = ast.parse(path.read_text("utf-8"))
        for node in ast.walk(tree):
            text = None
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                text = node.value
            elif isinstance(node, ast.Name):
                text = node.id
            elif isinstance(node, ast.alias):
                text = node.name
            if text and named.match(text):
                wrong.append(f"{where}:{node.lineno} names {text}")
    assert not wrong, "\n".join(wrong)


def test_rooms_and_bodies_are_not_too_long():
    long = []
    for path, where, _ in rooms():
        text = path.read_text("utf-8")
        lines = len(text.splitlines())
        if lines > 350:
            long.append(f"{where}: {lines} lines")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                body = node.body[1:] if ast.get_docstring(node) else node.body
                length = body[-1].end_lineno - body[0].lineno + 1 if body else 0
                if length > 60:
                    long.append(f"{where}: {node.name} has {length} lines")
    assert not long, "\n".join(long)
