"""The solvers that are compared: ours through the command line, and the peers, built from `steadyhand describe` alone.

Every peer solves the identical problem from the identical primal guess to the same tolerance, with the options its
makers ship unless the class says otherwise and why. `time_us` is the wall time of the call that solves; packing and
unpacking are outside of it.
"""

import contextlib
import ctypes
import hashlib
import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np

from formulation import StackedProblem, initial_guess, pack_references, pack_weights, weights_size


class PeerError(Exception):
    """A peer that cannot be set up, with the reason."""


@dataclass
class Answer:
    x: np.ndarray  # [N + 1, 2n]
    u: np.ndarray  # [N, n]
    iterations: int
    time_us: float
    status: str  # "solved" or the peer's own word
    solved: bool


class Steadyhand:
    """Ours: `steadyhand solve --solver NAME` for a whole block; the program's own time_us."""

    def __init__(self, program, solver):
        self.name = f"steadyhand-{solver}"
        self.command = [str(program), "solve", "--solver", solver]

    def solve(self, problems, folder):
        path = Path(folder) / "block.json"
        path.write_text(json.dumps(problems))
        run = subprocess.run([*self.command, str(path)], capture_output=True, text=True)
        if run.returncode != 0:
            raise PeerError(f"`{' '.join(self.command)}` ended with {run.returncode}: {run.stderr.strip()}")
        return [
            Answer(
                np.array(a["x"], dtype=float),
                np.array(a["u"], dtype=float),
                a["iterations"],
                a["time_us"],
                a["status"],
                a["status"] == "solved",
            )
            for a in json.loads(run.stdout)
        ]


class Casadi:
    """The paper's stack: CasADi in Python with FATROP, one nlpsol for the whole horizon, exact Hessian.

    SX throughout (expand), which was 1.3 to 1.8 times as fast here as MX with calls of stage functions. The liquid's
    terms are left out of the problem altogether when both of their weights are zero, as one who writes P1 would do.
    """

    name = "casadi"

    def __init__(self, formulation, liquid, tolerance):
        self.stacked = StackedProblem(formulation, liquid)
        self.solver = ca.nlpsol("planner", "fatrop", self.nlp(), {"expand": True, **self.options(tolerance)})

    def nlp(self):
        return self.stacked.nlp()

    def options(self, tolerance):
        return {
            "structure_detection": "auto",
            "equality": [bool(e) for e in self.stacked.equality],
            "print_time": False,
            "fatrop": {"print_level": 0, "tol": tolerance},
        }

    def solve(self, problems, folder=None):
        return [self._solve(problem) for problem in problems]

    def _solve(self, problem):
        s = self.stacked
        arguments = {
            "x0": s.pack(*initial_guess(problem, s.n)),
            "p": s.pack_parameters(problem),
            "lbx": s.z_min,
            "ubx": s.z_max,
            "lbg": s.g_min,
            "ubg": s.g_max,
        }
        start = time.perf_counter()
        solution = self.solver(**arguments)
        elapsed = time.perf_counter() - start
        stats = self.solver.stats()
        x, u = s.unpack(solution["x"])
        return Answer(x, u, stats["iter_count"], elapsed * 1e6, stats["unified_return_status"], bool(stats["success"]))


class CompiledCasadi(Casadi):
    """The same with generated C, compiled once per arm and kept in `cache`.

    MX with calls of stage functions: expanded, the C file has 8 MB, compiles for six minutes and runs no faster.
    """

    name = "casadi-c"

    def __init__(self, formulation, liquid, tolerance, cache):
        self.stacked = StackedProblem(formulation, liquid)
        solver = ca.nlpsol("planner", "fatrop", self.nlp(), self.options(tolerance))
        library = compiled(solver, cache, "liquid" if liquid else "plain")
        self.solver = ca.nlpsol("planner", "fatrop", str(library), self.options(tolerance))


def compiled(solver, cache, label):
    """Shared library with the functions `solver` depends on; found again by the hash of their C source."""
    with working_folder(cache):
        solver.generate_dependencies("planner.c")
        source = Path("planner.c").read_bytes()
        library = cache / f"planner-{label}-{hashlib.sha256(source).hexdigest()[:16]}.so"
        if not library.exists():
            say(f"compiling CasADi's C code ({label}, {len(source) / 1e6:.1f} MB; some minutes, kept)")
            unfinished = library.with_suffix(".part")
            command = ["gcc", "-shared", "-fPIC", "-O3", "-march=native", "planner.c", "-o", str(unfinished)]
            run = subprocess.run(command, capture_output=True, text=True)
            if run.returncode != 0:
                raise PeerError(f"`{' '.join(command)}` failed: {run.stderr.strip()[-500:]}")
            unfinished.rename(library)
    return library


class Acados:
    """acados with HPIPM (partial condensing), discrete dynamics, nonlinear least squares, one-sided distances.

    SQP iterates to the tolerance; RTI takes one step. See README.md for the choice of Hessian.
    """

    def __init__(self, formulation, liquid, tolerance, cache, acados, rti=False, exact=False, **options):
        self.name = "acados-rti" if rti else "acados-sqp"
        self.formulation, self.rti = formulation, rti
        module = import_acados(acados)
        ocp = module.AcadosOcp(acados_path=str(acados / "install"))
        self._describe(ocp, liquid)
        o = ocp.solver_options
        o.qp_solver, o.integrator_type = "PARTIAL_CONDENSING_HPIPM", "DISCRETE"
        o.nlp_solver_type = "SQP_RTI" if rti else "SQP"
        o.hessian_approx = "EXACT" if exact else "GAUSS_NEWTON"
        o.tol = tolerance
        o.qp_tol = tolerance / 10
        o.ext_fun_compile_flags = "-O2 -march=native"
        for key, value in options.items():
            setattr(o, key, value)
        self.solver = self._build(module, ocp, cache)

    def _describe(self, ocp, liquid):
        f, n, horizon = self.formulation, self.formulation.arm.dof, self.formulation.horizon
        s = f.stage
        model = ocp.model
        model.x, model.u, model.disc_dyn_expr = s.x, s.u, f.next_x
        model.p = ca.vertcat(s.reference, s.w)
        ocp.dims.N, ocp.solver_options.tf = horizon, horizon * f.dt
        ocp.parameter_values = np.zeros(12 + weights_size(n))

        # Every term is sum(w r^2) = 1/2 (sqrt(2 w) r)^2: acados multiplies stage costs by dt, but not the last one.
        def stack(names):
            return ca.vertcat(*[ca.sqrt(2 * w) * r for r, w in (f.residuals[name] for name in names)])

        input_terms = [name for name in f.input_terms if liquid or name == "acceleration"]
        cost, constraints = ocp.cost, ocp.constraints
        model.cost_y_expr_0 = stack(input_terms)
        model.cost_y_expr = stack([*f.state_terms, *input_terms])
        model.cost_y_expr_e = np.sqrt(f.dt) * stack(f.state_terms)
        for suffix in ("_0", "", "_e"):
            rows = getattr(model, "cost_y_expr" + suffix).shape[0]
            setattr(cost, "cost_type" + suffix, "NONLINEAR_LS")
            setattr(cost, "W" + suffix, np.eye(rows))
            setattr(cost, "yref" + suffix, np.zeros(rows))

        constraints.x0 = np.zeros(2 * n)
        constraints.idxbx = constraints.idxbx_e = np.arange(2 * n)
        constraints.lbx = constraints.lbx_e = f.x_min
        constraints.ubx = constraints.ubx_e = f.x_max
        constraints.idxbu, constraints.lbu, constraints.ubu = np.arange(n), -f.u_max, f.u_max
        pairs = f.distances.shape[0]
        if pairs:
            # Not for the first stage, whose state is given. This acados has no h without an upper bound: one far away.
            far = np.full(pairs, 1e4)
            for suffix in ("", "_e"):
                setattr(model, "con_h_expr" + suffix, f.distances)
                setattr(constraints, "lh" + suffix, np.zeros(pairs))
                setattr(constraints, "uh" + suffix, far)

    def _build(self, module, ocp, cache):
        # Built again when the model, an option or a bound is another one, or the checkout has moved.
        m, parts = ocp.model, (ocp.solver_options, ocp.constraints)
        settings = [sorted((key, str(value)) for key, value in vars(part).items()) for part in parts]
        model = ca.Function(
            "model",
            [m.x, m.u, m.p],
            [m.disc_dyn_expr, m.cost_y_expr_0, m.cost_y_expr, m.cost_y_expr_e, self.formulation.distances],
        )
        identity = json.dumps([str(cache), settings, model.serialize()])
        ocp.model.name = f"{self.name.replace('-', '_')}_{hashlib.sha256(identity.encode()).hexdigest()[:12]}"
        folder = cache / ocp.model.name
        description = folder.with_suffix(".json")
        ocp.code_export_directory = str(folder)
        finished = folder / "finished"
        fresh = not finished.exists()
        if fresh:
            say(f"compiling the C code of {self.name} (some seconds, kept for the next time)")
        with working_folder(cache):
            try:
                solver = module.AcadosOcpSolver(
                    ocp, json_file=str(description), build=fresh, generate=fresh, verbose=False
                )
            except Exception as error:
                raise PeerError(f"acados could not be built: {error}") from error
            finished.touch()
        return solver

    def solve(self, problems, folder=None):
        return [self._solve(problem) for problem in problems]

    def _solve(self, problem):
        n, horizon, solver = self.formulation.arm.dof, self.formulation.horizon, self.solver
        x, u = initial_guess(problem, n)
        references, w = pack_references(problem["reference"]), pack_weights(problem["weights"], n)
        x0 = np.array(problem["x0"], dtype=float)
        solver.set(0, "lbx", x0)
        solver.set(0, "ubx", x0)
        for k in range(horizon + 1):
            solver.set(k, "p", np.concatenate([references[:, max(k - 1, 0)], w]))
            solver.set(k, "x", x[k])
            if k < horizon:
                solver.set(k, "u", u[k])
        start = time.perf_counter()
        status = solver.solve()
        elapsed = time.perf_counter() - start
        x = np.array([solver.get(k, "x") for k in range(horizon + 1)])
        u = np.array([solver.get(k, "u") for k in range(horizon)])
        words = {0: "solved", 1: "not a number", 2: "iteration limit", 3: "step too small", 4: "QP failed"}
        # Status 2 after the single step of RTI is how it is meant.
        return Answer(
            x,
            u,
            1 if self.rti else int(np.ravel(solver.get_stats("sqp_iter"))[0]),
            elapsed * 1e6,
            words.get(status, str(status)),
            status == 0,
        )


def import_acados(folder):
    """acados' Python template, without the old CasADi of its wheel. `folder` holds acados_template/ and install/."""
    if not (folder / "acados_template" / "__init__.py").exists():
        raise PeerError(
            f"acados is not at {folder}: `./steadyhand bench` installs it from setup/requirements-acados.txt"
        )
    os.environ["ACADOS_SOURCE_DIR"] = str(folder / "install")
    os.environ["ACADOS_PYTHON_INTERFACE_PATH"] = str(folder / "acados_template")
    os.environ["TERA_PATH"] = str(folder / "install" / "bin" / "t_renderer")
    if str(folder) not in sys.path:
        sys.path.append(str(folder))
    # Its libraries have no run path: loaded by name here, they are found when the solver asks for them.
    for library in ("blasfeo", "hpipm", "qpOASES_e", "acados"):
        ctypes.CDLL(str(folder / "install" / "lib" / f"lib{library}.so"), mode=ctypes.RTLD_GLOBAL)
    import acados_template

    return acados_template


def say(text):
    print(f"bench: {text}", file=sys.stderr, flush=True)


@contextlib.contextmanager
def working_folder(path):
    before = os.getcwd()
    Path(path).mkdir(parents=True, exist_ok=True)
    os.chdir(path)
    try:
        yield
    finally:
        os.chdir(before)
