"""bench/versions.py: two builds of bench_problems beside each other, here stand-ins that answer what they are told."""

import json
import shlex
import sys

import pytest

from places import ROOT

sys.path.insert(0, str(ROOT / "bench"))

from versions import main

STAND_IN = """import json, pathlib, sys
turns = pathlib.Path(__file__).with_suffix('.turns')
turn = len(turns.read_text()) if turns.exists() else 0
turns.write_text('x' * (turn + 1))
answers = json.loads(pathlib.Path(__file__).with_suffix('.json').read_text())
for answer in answers[min(turn, len(answers) - 1)]:
    print(json.dumps(answer))
"""


def program(folder, name, *turns):
    """A stand-in that answers turn by turn."""
    path = folder / f"{name}.py"
    path.write_text(STAND_IN)
    path.with_suffix(".json").write_text(json.dumps(turns))
    return shlex.join([sys.executable, str(path)])


def answer(name, us, objective=1.0, status="solved", iterations=4):
    return {"problem": name, "us": us, "iterations": iterations, "status": status, "objective": objective}


def test_the_least_of_all_turns_counts(tmp_path, capsys):
    old = program(tmp_path, "old", [answer("a", 30.0), answer("b", 10.0), answer("c", 20.0, status="infeasible")],
                  [answer("a", 20.0), answer("b", 90.0), answer("c", 90.0, status="infeasible")])
    new = program(tmp_path, "new", [answer("a", 5.0, objective=1.0 + 2e-6), answer("b", 9.0, objective=1.0 - 3e-5), answer("c", 10.0)],
                  [answer("a", 8.0, objective=1.0 + 2e-6), answer("b", 4.0, objective=1.0 - 3e-5), answer("c", 6.0)])
    assert main([old, new, str(tmp_path / "smooth-tracking-8.txt"), "--rounds", "2"]) == 0
    row = capsys.readouterr().out.splitlines()[1].split()
    assert row[:5] == ["smooth-tracking-8", "3", "16.7", "5.0", "0.30"]
    assert row[-5:] == ["1", "0", "1", "1", "3e-05"], "unsolved, higher, lower, apart"


@pytest.mark.parametrize(
    ("old", "new", "options", "message"),
    [
        ([answer("a", 1.0)], [answer("b", 1.0)], [], "do not read the same problems"),
        ([], [], [], "set.txt: holds no problem"),
        (None, [answer("a", 1.0)], [], "nowhere cannot be started: No such file"),
    ],
)
def test_says_what_cannot_be_compared(tmp_path, capsys, old, new, options, message):
    programs = ["/nowhere" if side is None else program(tmp_path, name, side) for name, side in (("old", old), ("new", new))]
    assert main([*programs, str(tmp_path / "set.txt"), *options]) == 2
    assert message in capsys.readouterr().err


def test_a_program_that_fails_is_named(tmp_path, capsys):
    (tmp_path / "fails.py").write_text("raise SystemExit(3)")
    failing = shlex.join([sys.executable, str(tmp_path / "fails.py")])
    assert main([failing, failing, "set.txt"]) == 2
    assert "fails.py --json --repetitions 3 set.txt` ended with exit code 3" in capsys.readouterr().err


@pytest.mark.parametrize("value", ["0", "-1", "2.5"])
def test_refuses_counts(value, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["old", "new", "set.txt", "--rounds", value])
    assert ended.value.code == 2 and "at least 1" in capsys.readouterr().err
