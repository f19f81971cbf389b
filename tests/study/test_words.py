"""Messages that Python users see too name the argument beside the option."""

import ast
import re
from pathlib import Path

import martths_jax

#: Only the command line comes here, or an option is looked up by its name.
ONLY_OPTIONS = {"distributed.py", "machine.py", "provenance.py", "runtime.py", "template.py"}


#: Options whose argument is called otherwise somewhere.
ALIASES = {"--out": "(out|folder)", "--force": "overwrite"}


def sentences(path: Path):
    """(line, text) of every text in a file that is no documentation."""
    tree = ast.parse(path.read_text("utf-8"))
    documentation = {
        id(node.value) for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }  # fmt: skip
    inside = {id(part) for n in ast.walk(tree) if isinstance(n, ast.JoinedStr) for part in n.values}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            parts = [p.value for p in node.values if isinstance(p, ast.Constant)]
            yield node.lineno, "{}".join(parts)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            if id(node) not in documentation | inside:
                yield node.lineno, node.value


def test_options_stand_beside_arguments():
    package = Path(martths_jax.__file__).parent
    seen, bare = 0, []
    for path in sorted(package.rglob("*.py")):
        if path.is_relative_to(package / "cli") or path.name in ONLY_OPTIONS:
            continue
        for line, text in sentences(path):
            for option in re.findall(r"--[a-z][a-z-]+", text):
                seen += 1
                name = ALIASES.get(option, option[2:].replace("-", "_"))
                # `units` (--units), --out (`out`), `memory_gb` (--memory); a command in backquotes.
                named = re.search(rf"`[^`]*\b{name}|`martths[^`]*{option}", text)
                # What `argument_error` gets, which names the argument itself: "be a step (--dt)".
                if named or text.startswith("be "):
                    continue
                bare.append(f"{path.relative_to(package)}:{line}: {text[:100]}")
    assert seen > 10 and not bare, bare
