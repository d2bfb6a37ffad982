"""`python3 docs/pictures/architecture.py` draws architecture.svg: rooms and what they use as CMakeLists.txt has it, where they
stand as LIBRARIES has it. tests/python/test_architecture.py holds the figure against both."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WIDTH, HEIGHT = 1000, 1044

# Of each library its box (x, y, width, height), where its title stands, the distance of its columns and the width of its rooms'
# boxes, and where each room stands: column from the left of the box, and row of the figure. Rooms stand below all that they use.
LIBRARIES = {
    "planning": ((20, 196, 410, 522), "below", 99, 84, {
        "core": (1.5, 0), "collision": (0, 1), "track": (1, 1), "retarget": (2, 1), "predict": (3, 1), "robot": (0, 2),
        "ocp": (0, 3), "solve": (0, 4), "plan": (0.5, 5), "task": (3, 5), "config": (1.5, 6), "pipeline": (1.5, 7)}),
    "live": ((446, 258, 386, 590), "below", 97, 84, {
        "supervise": (2, 1), "input": (3, 1), "arm": (0.5, 3), "ur": (0, 4), "mujoco": (1, 6), "ros2": (0.2, 9), "record": (2, 6), "live": (0.8, 8),
        "replay": (2, 8), "archive": (1.4, 9)}),
    "the program": ((848, 258, 138, 772), "below", 66, 60, {
        "camera": (0.5, 5), "report": (0, 7), "fit": (1, 7), "render": (0.5, 8), "desk": (0.5, 9), "serve": (0, 10), "browser": (1, 10), "console": (0, 11), "simulate": (1, 11), "app": (0.5, 12)}),
    "the Python package": ((446, 866, 170, 90), "above", 97, 84, {"python": (0.4, 11)}),
}
FIRST_ROW, ROW = 232, 62
FLOW = [("input, serve", "a hand"), ("retarget", ""), ("predict", ""), ("plan", "ocp, solve"), ("track", ""), ("arm, mujoco, ur, ros2", "an arm")]
STRUCTS = ["OperatorSample", "Target", "Reference", "Plan", "JointCommand"]
STAGES = {"input", "serve", "retarget", "predict", "plan", "ocp", "solve", "track", "arm", "mujoco", "ur", "ros2"}


def read_uses():
    """By room what CMakeLists.txt lets it use; `app` and `python`, which may use all, by their #includes."""
    uses = {}
    for name, rest in re.findall(r"steadyhand_room\((\w+)([^)]*)\)", (ROOT / "CMakeLists.txt").read_text()):
        words, uses[name] = iter(rest.split()), []
        taking = False
        for word in words:
            if word.isupper() and len(word) > 2:
                taking = word == "USES"
            elif taking:
                uses[name].append(word)
    for room in ("app", "python"):
        files = (ROOT / "src/steadyhand" / room).glob("*.[ch]pp")
        uses[room] = sorted({used for file in files for used in re.findall(r'#include "steadyhand/(\w+)/', file.read_text())} - {room})
    return uses


def read_libraries():
    """By room the library that CMakeLists.txt puts it into."""
    calls = re.findall(r"steadyhand_library\((\w+) ([^)]*)\)", (ROOT / "CMakeLists.txt").read_text())
    return {room: name for name, words in calls for room in words.split("ROOMS", 1)[1].split() if room != "OPTIONAL"}


def all_used(uses, room):
    return set(uses[room]).union(*(all_used(uses, used) for used in uses[room]))


def edges(uses):
    """Those that do not follow from others."""
    return [(room, used) for room in uses for used in uses[room]
            if not any(used in all_used(uses, other) for other in uses[room] if other != used)]


def library_of(room):
    return next(name for name, (*_, rooms) in LIBRARIES.items() if room in rooms)


def centre(room):
    (x, *_), _, column, width, rooms = LIBRARIES[library_of(room)]
    return x + 8 + width / 2 + rooms[room][0] * column, FIRST_ROW + rooms[room][1] * ROW


def draw():
    uses = read_uses()
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" font-family="sans-serif">',
           "<title>steadyhand: the way data takes, and which room uses which</title>",
           '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
           '<path d="M0 0L8 4L0 8z" fill="#0b63a8"/></marker></defs>',
           f'<rect width="{WIDTH}" height="{HEIGHT}" rx="10" fill="#ffffff"/>']

    def text(x, y, words, size=13, fill="#1c2733", weight="normal", anchor="middle"):
        out.append(f'<text x="{x:g}" y="{y:g}" font-size="{size}" fill="{fill}" font-weight="{weight}" text-anchor="{anchor}">{words}</text>')

    def box(x, y, width, height, fill, line):
        out.append(f'<rect x="{x - width / 2:g}" y="{y - height / 2:g}" width="{width}" height="{height}" rx="7" fill="{fill}" stroke="{line}"/>')

    # The way data takes.
    text(20, 28, "The way data takes", 15, weight="bold", anchor="start")
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

    # Rooms.
    text(20, 182, "Rooms: each uses those above that a line leads to, and what these use", 15, weight="bold", anchor="start")
    for library, ((x, y, width, height), where, *_) in LIBRARIES.items():
        out.append(f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="10" fill="#f4f6f8" stroke="#c4ccd4"/>')
        title = library if " " in library else f"steadyhand::{library}"
        text(x + 12, y + height - 11 if where == "below" else y + 21, title, 12, "#55606c", "bold", "start")
    for room, used in edges(uses):
        (x1, y1), (x2, y2) = centre(room), centre(used)
        if y1 == y2:
            path = f"M{x1:g} {y1:g}H{x2:g}"
        else:
            y1, y2 = y1 - 15, y2 + 15
            bend = min(60, (y1 - y2) / 2)
            path = f"M{x1:g} {y1:g}C{x1:g} {y1 - bend:g} {x2:g} {y2 + bend:g} {x2:g} {y2:g}"
        out.append(f'<path d="{path}" fill="none" stroke="#8a97a5" stroke-width="1.2"/>')
    for room in uses:
        x, y = centre(room)
        box(x, y, LIBRARIES[library_of(room)][3], 30, *(("#dcebfa", "#0b63a8") if room in STAGES else ("#ffffff", "#8a97a5")))
        text(x, y + 4.5, room)
    out.append("</svg>")
    return "\n".join(out) + "\n"


if __name__ == "__main__":
    (ROOT / "docs/pictures/architecture.svg").write_text(draw())
