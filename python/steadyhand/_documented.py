"""For help(): what stands as text under the members of a module's classes goes into the classes' own docstrings."""

import ast
import inspect
from pathlib import Path
from typing import Any


def document(module: dict[str, Any]) -> None:
    """Called with globals() at a module's end. Where there are no sources nothing changes."""
    try:
        tree = ast.parse(Path(module["__file__"]).read_text(encoding="utf-8"))
    except (OSError, SyntaxError):
        return
    for node in tree.body:
        if not isinstance(node, ast.ClassDef):
            continue
        inside = [part.body for part in node.body if isinstance(part, ast.FunctionDef) and part.name == "__init__"]
        lines = [line for body in (node.body, *inside) for line in _members(body)]
        described = module[node.name]
        if lines and described.__doc__ is not None:
            described.__doc__ = "\n".join([inspect.cleandoc(described.__doc__), "", *lines])


def _members(body: list[ast.stmt]) -> list[str]:
    lines = []
    for member, text in zip(body, body[1:]):
        if isinstance(member, ast.AnnAssign):
            target: ast.expr = member.target
        elif isinstance(member, ast.Assign):
            target = member.targets[0]
        else:
            continue
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant) and isinstance(text.value.value, str):
            name = target.id if isinstance(target, ast.Name) else target.attr if isinstance(target, ast.Attribute) else ""
            lines.append(f"{name}: {' '.join(text.value.value.split())}")
    return lines
