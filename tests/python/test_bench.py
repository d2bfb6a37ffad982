"""bench/run.py: what it says about bad input, and a short run."""

import json
import subprocess
import sys
from types import SimpleNamespace

import pytest

from places import ROOT

sys.path.insert(0, str(ROOT / "bench"))

from closed_loops import run_peers
from kkt import Verdict
from run import main


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--solvers", "ipopt"], "there is no 'ipopt'; there are steadyhand-fatrop"),
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


def test_counts_answers_that_are_no_minimum():
    """Of four: a minimum, one beyond a constraint, one that is not optimal, and one that is no number."""
    answers = [SimpleNamespace(x=x, u=None, time_us=10.0 * (k + 1)) for k, x in enumerate([(1e-9, 1e-8), (1e-3, 1e-8), (1e-9, 1e-2), (float("nan"),) * 2])]
    peer = SimpleNamespace(name="peer", solve=lambda problems: answers)
    times, short = run_peers([None] * 4, [peer], lambda problem, x, u: Verdict(1.0, x[0], x[1], 0.0))
    assert times == {"peer": 25.0} and short == {"peer": 3}


@pytest.mark.long
def test_short_run(tmp_path):
    """Ours and the paper's stack on problems of two sequences: both find minima, by one measure."""
    figures = tmp_path / "bench.json"
    options = ["--profiles", "waiter", "--json", str(figures), "--horizons", "8", "16"]
    options += ["--sequences", "recording-500Hz", "jumps", "--solves", "100", "--sample", "2"]
    command = [sys.executable, str(ROOT / "bench" / "run.py"), *options, "--solvers", "steadyhand-fatrop", "casadi"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    loops = json.loads(figures.read_text())["closed_loops"]
    assert [(loop["sequence"], loop["horizon"]) for loop in loops] == [(name, N) for name in ("recording-500Hz", "jumps") for N in (8, 16)]
    for loop in loops:
        assert (loop["unsolved"], loop["compared"]) == (0, 2) and 0.0 < loop["sampled_us"]
        assert set(loop["peers_us"]) == ({"steadyhand-fatrop", "casadi"} if loop["horizon"] == 8 else set())
        assert not any(loop["peers_short"].values())
    assert "verdict: the worst solve" in result.stdout


@pytest.mark.long
def test_names_the_sequences(capfd):
    assert main(["--sequences", "rest", "--solvers", "steadyhand-fatrop"]) == 2
    assert "the sequences are recording-20Hz" in capfd.readouterr().err
