"""Each solver in a process of its own, so that their libraries (two builds of BLASFEO) cannot meet.

A worker sets its solver up, then solves one block of problems whenever it is asked to and waits in between.
"""

import multiprocessing
import os
import signal
import sys
import tempfile
import traceback

from formulation import Arm, Formulation, has_liquid
from peers import Acados, Casadi, CompiledCasadi, PeerError, Steadyhand

SOLVERS = ("steadyhand-fatrop", "steadyhand-realtime", "casadi", "casadi-c", "acados-sqp", "acados-rti")
PAPER = "casadi"  # the stack of the paper


def make_solver(name, formulation, liquid, tolerance, paths):
    if name == "casadi":
        return Casadi(formulation, liquid, tolerance)
    if name == "casadi-c":
        return CompiledCasadi(formulation, liquid, tolerance, paths["cache"])
    if name.startswith("acados"):
        return Acados(formulation, liquid, tolerance, paths["cache"], paths["acados"], rti=name == "acados-rti")
    return Steadyhand(paths["program"], name.removeprefix("steadyhand-"))


class Worker:
    """Solver `name` for problems of one arm, step, horizon and tolerance, as `problems` have them."""

    def __init__(self, name, description, problems, paths):
        self.name = name
        context = multiprocessing.get_context("spawn")
        self.pipe, other = context.Pipe()
        self.process = context.Process(
            target=_work,
            args=(other, name, description, problems[0], {has_liquid(p["weights"]) for p in problems}, paths),
            daemon=True,
        )
        self.process.start()
        other.close()

    def wait_until_ready(self):
        self._receive()

    def solve(self, problems):
        self.pipe.send(problems)
        return self._receive()

    def close(self):
        self.pipe.close()
        self.process.join(timeout=5)

    def _receive(self):
        try:
            result = self.pipe.recv()
        except EOFError:
            self.process.join()
            raise PeerError(f"{self.name} died with exit code {self.process.exitcode}") from None
        if isinstance(result, PeerError):
            raise PeerError(f"{self.name}: {result}")
        return result


def _work(pipe, name, description, example, liquids, paths):
    # Interrupted, the parent ends us; acados prints from Python and from C, but stdout is for the table.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    try:
        formulation = Formulation(Arm.from_description(description), example["dt"], example["horizon"])
        solvers = {liquid: make_solver(name, formulation, liquid, example["tolerance"], paths) for liquid in liquids}
        pipe.send("ready")
        with tempfile.TemporaryDirectory(prefix="steadyhand-bench-") as folder:
            while True:
                problems = pipe.recv()
                # The first one twice: caches and clocks are cold after the others' turns, for each solver alike.
                pipe.send(solvers[has_liquid(problems[0]["weights"])].solve([problems[0], *problems], folder)[1:])
    except EOFError:
        pass
    except PeerError as error:
        pipe.send(error)
    except Exception:
        pipe.send(PeerError(traceback.format_exc()))
