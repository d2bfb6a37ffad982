"""`python3 docs/pictures/architecture.py` draws architecture.svg: the way data takes, and the modules with their parts as
CMakeLists.txt has them. tests/python/test_architecture.py compares the file with what this draws."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WIDTH, TOP, ROW, MARGIN = 1000, 212, 84, 20
FLOW = [("input, server", "a hand"), ("retarget", ""), ("predict", ""), ("plan", "ocp, solve"), ("plan", "tracker.hpp"), ("arms", "an arm")]
STRUCTS = ["OperatorSample", "Target", "Reference", "Plan", "JointCommand"]


def read_parts():
    """By path ("geometry/robot") the paths that a part names; apps/commands and apps/python, which may use all, by their #includes."""
    uses, paths = {}, {}
    for path, rest in re.findall(r"steadyhand_part\(([\w/]+)([^)]*)\)", (ROOT / "CMakeLists.txt").read_text()):
        paths[path.split("/")[-1]] = path
        words, taking, uses[path] = rest.split(), False, []
        for word in words:
            if word.isupper() and len(word) > 2:
                taking = word == "USES"
            elif taking:
                uses[path].append(paths[word])
    for path in ("apps/commands", "apps/python"):
        files = (ROOT / "src/steadyhand" / path).glob("*.[ch]pp")
        found = {used for file in files for used in re.findall(r'#include "steadyhand/(\w+(?:/\w+)?)/', file.read_text())}
        uses[path] = sorted(found & set(uses))
    return uses


def read_modules(parts):
    """By module the modules that its parts use."""
    modules = {path.split("/")[0]: set() for path in parts}
    for path, used in parts.items():
        modules[path.split("/")[0]] |= {other.split("/")[0] for other in used} - {path.split("/")[0]}
    return modules


def all_used(uses, name):
    return set(uses[name]).union(*(all_used(uses, used) for used in uses[name]))


def edges(uses):
    """Those that do not follow from others."""
    return [(name, used) for name in uses for used in sorted(uses[name])
            if not any(used in all_used(uses, other) for other in uses[name] if other != used)]  # fmt: skip


def level(uses, name):
    return 1 + max((level(uses, used) for used in uses[name]), default=-1)


def draw():
    parts = read_parts()
    uses = read_modules(parts)
    rows = {}
    for module in uses:
        rows.setdefault(level(uses, module), []).append(module)
    height = TOP + ROW * len(rows) + 12
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" font-family="sans-serif">',
           "<title>steadyhand: the way data takes, and which module uses which</title>",
           '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
           '<path d="M0 0L8 4L0 8z" fill="#0b63a8"/></marker></defs>',
           f'<rect width="{WIDTH}" height="{height}" rx="10" fill="#ffffff"/>']  # fmt: skip

    def text(x, y, words, size=13, fill="#1c2733", weight="normal", anchor="middle"):
        out.append(f'<text x="{x:g}" y="{y:g}" font-size="{size}" fill="{fill}" font-weight="{weight}" text-anchor="{anchor}">{words}</text>')

    def box(x, y, width, height, fill, line):
        out.append(f'<rect x="{x - width / 2:g}" y="{y - height / 2:g}" width="{width:g}" height="{height:g}" rx="7" fill="{fill}" stroke="{line}"/>')

    text(MARGIN, 28, "The way data takes", 15, weight="bold", anchor="start")
    at = [75 + 170 * i for i in range(len(FLOW))]
    for x, (name, beneath) in zip(at, FLOW):
        box(x, 88, 96, 34, "#dcebfa", "#0b63a8")
        text(x, 92, name)
        if beneath:
            text(x, 124, beneath, 12, "#55606c")
    for left, right, struct in zip(at, at[1:], STRUCTS):
        out.append(f'<path d="M{left + 49} 88H{right - 50}" stroke="#0b63a8" stroke-width="1.6" marker-end="url(#tip)"/>')
        text((left + right) / 2, 62, struct, 11.5, "#0b63a8")
    out.append(f'<path d="M{at[5]} 134V148H{at[1]}V107" fill="none" stroke="#0b63a8" stroke-dasharray="5 4" marker-end="url(#tip)"/>')
    text(at[4], 143, "JointState: where the arm is", 11.5, "#0b63a8")

    text(MARGIN, 190, "Modules and their parts: each uses those above that a line leads to, and what these use", 15, weight="bold", anchor="start")
    centre, size = {}, {}
    for row, modules in sorted(rows.items()):
        for i, module in enumerate(sorted(modules)):
            inside = [path.split("/")[1] for path in parts if path.startswith(module + "/")]
            size[module] = max(120, 26 + 7.2 * len(" ".join(inside) + " " * len(inside)))
            centre[module] = (WIDTH * (2 * i + 1) / (2 * len(modules)), TOP + 30 + ROW * row, inside)
    for module, used in edges(uses):
        (x1, y1, _), (x2, y2, _) = centre[module], centre[used]
        y1, y2 = y1 - 25, y2 + 25
        bend = min(60, (y1 - y2) / 2)
        out.append(f'<path d="M{x1:g} {y1:g}C{x1:g} {y1 - bend:g} {x2:g} {y2 + bend:g} {x2:g} {y2:g}" fill="none" stroke="#8a97a5" stroke-width="1.2"/>')
    for module, (x, y, inside) in centre.items():
        box(x, y, size[module], 50, "#f4f6f8", "#8a97a5")
        text(x, y - 5 if inside else y + 5, module, 14, weight="bold")
        if inside:
            text(x, y + 15, "&#160;&#160;".join(inside), 12, "#55606c")
    out.append("</svg>")
    return "\n".join(out) + "\n"


if __name__ == "__main__":
    (ROOT / "docs/pictures/architecture.svg").write_text(draw())
