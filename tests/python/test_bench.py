"""bench/run.py: what it says about bad input, how it classes answers, and a short run."""

import json
import subprocess
import sys
from types import SimpleNamespace

import pytest

from places import PROGRAM, ROOT

sys.path.insert(0, str(ROOT / "bench"))

from comparison import compare
from kkt import Verdict
from run import main


def write_problems(folder, text):
    (folder / "tracking").mkdir()
    (folder / "tracking" / "problems.json").write_text(text)


GOOD = {
    "robot": "ur5e",
    "dt": 0.05,
    "horizon": 2,
    "x0": [0] * 12,
    "weights": {"position": 500},
    "reference": [{"p": [0.5, 0, 0.4], "R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}] * 2,
    "tolerance": 1e-6,
}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no JSON at line 1"),
        ('[{"robot": "ur5e"', "no JSON at line 1"),
        ("[]", "at least one problem"),
        ('{"robot": "ur5e"}', "must be an array"),
        ("[7]", "problem 0 is no object"),
        (json.dumps([GOOD, {**GOOD, "dt": None}]), "problem 1: 'dt'"),
        (json.dumps([{k: v for k, v in GOOD.items() if k != "weights"}]), "problem 0 has no 'weights'"),
        (json.dumps([GOOD, {**GOOD, "horizon": 3}]), "same 'horizon'"),
    ],
)
def test_refuses_problems(text, message, tmp_path, capsys):
    write_problems(tmp_path, text)
    assert main(["--problems", str(tmp_path), "--profiles", "tracking"]) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and message in printed.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--solvers", "ipopt"], "there is no 'ipopt'; there are steadyhand-fatrop"),
        (["--problems", "/nowhere"], "No such file or directory"),
        (["--json", "/nowhere/bench.json"], "does not exist"),
        (["--solves", "0"], "--solves is 0"),
        (["--solves", "5", "--sample", "6"], "--sample is 6; it must be from 1 to --solves, 5"),
        (["--budget-us", "nan"], "--budget-us is nan"),
        (["--horizons", "8", "129"], "--horizons has 129; each must be from 1 to 128"),
    ],
)
def test_refuses_arguments(arguments, message, capsys):
    assert main(arguments) == 2
    assert message in capsys.readouterr().err


def test_names_a_program_that_is_not_there(monkeypatch, capsys):
    monkeypatch.setenv("STEADYHAND_PROGRAM", "/nowhere/steadyhand")
    assert main(["--quick"]) == 2
    assert "/nowhere/steadyhand cannot be started" in capsys.readouterr().err


def test_classes_answers():
    """Four problems: equal, another minimum, not converged, and a low objective bought with a violation."""

    def verdict(objective, violation=1e-9, error=1e-8):
        return Verdict(objective, violation, error, 0.0)

    verdicts = {
        "casadi": [verdict(1.0)] * 4,
        "other": [verdict(1 + 5e-7), verdict(1.5), verdict(1.5, error=1e-2), verdict(0.5, violation=1e-3)],
        "lower": [verdict(1.0), verdict(1.0), verdict(1.0), verdict(0.9)],
    }
    answer = SimpleNamespace(solved=True, iterations=5, time_us=2000.0)
    answers = {name: [answer] * 4 for name in verdicts}
    answers["lower"] = [SimpleNamespace(solved=True, iterations=5, time_us=500.0)] * 4
    rows = {row.solver: row for row in compare(answers, verdicts, "casadi")}
    assert (rows["other"].same, rows["other"].other_minimum, rows["other"].short) == (1, 1, 2)
    assert (rows["other"].below_paper, rows["other"].above_paper) == (0, 3)
    assert (rows["casadi"].same, rows["casadi"].other_minimum) == (3, 1)
    assert (rows["lower"].same, rows["lower"].below_paper) == (4, 1)
    assert rows["lower"].ratio == pytest.approx(4.0)


@pytest.mark.long
def test_short_run(tmp_path):
    """Ours beside the paper's stack on the hand's first steps: no objective above, no constraint violated."""
    replay = [PROGRAM, "replay", "--dump-problems", "--out", str(tmp_path), "--profile", "waiter"]
    subprocess.run(replay, check=True, capture_output=True, timeout=300)
    figures = tmp_path / "bench.json"
    options = ["--quick", "--profiles", "waiter", "--problems", str(tmp_path), "--json", str(figures)]
    options += ["--sequences", "recording-500Hz", "jumps", "--solves", "100", "--sample", "2"]
    command = [sys.executable, str(ROOT / "bench" / "run.py"), *options, "--solvers", "steadyhand-fatrop", "casadi"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    assert "waiter: 20 problems" in result.stdout
    ours, paper = json.loads(figures.read_text())["waiter"]["solvers"]
    assert (ours["solver"], paper["solver"]) == ("steadyhand-fatrop", "casadi")
    assert ours["same"] + ours["other_minimum"] == 20
    assert ours["violation"] < 1e-6
    loops = json.loads(figures.read_text())["closed_loops"]
    assert [loop["sequence"] for loop in loops] == ["recording-500Hz", "jumps"]
    for loop in loops:
        assert (loop["unsolved"], loop["compared"]) == (0, 2)
        assert set(loop["peers_us"]) == {"steadyhand-fatrop", "casadi"}
        assert 0.0 < loop["sampled_us"]
    assert "verdict: the worst solve" in result.stdout


@pytest.mark.long
def test_names_the_sequences(tmp_path, capfd):
    write_problems(tmp_path, json.dumps([GOOD]))
    options = ["--problems", str(tmp_path), "--profiles", "tracking", "--only", "closed-loops", "--sequences", "rest"]
    assert main([*options, "--solvers", "steadyhand-fatrop"]) == 2
    assert "the sequences are recording-20Hz" in capfd.readouterr().err
