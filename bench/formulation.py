"""The optimal control problem of docs/explanation/formulation.md written a second time: in CasADi, from `steadyhand describe`.

It serves as the peers' model (peers.py) and as the independent oracle of the tests. Nothing here calls the C++ code.
Every expression is written as the formulation states it.
"""

from dataclasses import dataclass, field

import casadi as ca
import numpy as np


@dataclass(frozen=True)
class Arm:
    """What `steadyhand describe ROBOT` prints. SI units, radians; link 0 is the base."""

    name: str
    origins: list  # n of 4x4, frame of joint k in the frame of link k
    axes: list  # n of [3], in the joint frame
    prismatic: list  # n of bool
    tool: np.ndarray  # 4x4, the controlled frame E in the frame of link n
    home: np.ndarray  # [n]
    position_min: np.ndarray
    position_max: np.ndarray
    velocity_max: np.ndarray
    acceleration_max: np.ndarray
    spheres: list  # (link, center [3] in the link frame, radius)
    pairs: list  # (i, j)

    @staticmethod
    def from_description(description):
        joints = description["joints"]
        return Arm(
            name=description["name"],
            origins=[np.array(joint["origin"], dtype=float) for joint in joints],
            axes=[np.array(joint["axis"], dtype=float) for joint in joints],
            prismatic=[joint.get("type", "revolute") == "prismatic" for joint in joints],
            tool=np.array(description["tools"][0]["origin"], dtype=float),
            spheres=[
                (s["link"], np.array(s["center"], dtype=float), float(s["radius"])) for s in description["spheres"]
            ],
            pairs=[tuple(pair) for pair in description["pairs"]],
            **{
                key: np.array(description[key], dtype=float)
                for key in ("home", "position_min", "position_max", "velocity_max", "acceleration_max")
            },
        )

    @property
    def dof(self):
        return len(self.axes)


GRAVITY = np.array([0.0, 0.0, 9.81])  # m/s^2


def exact(matrix):
    """A constant as a sparse SX: entries that are zero but for rounding (cos(pi/2)) would clutter the expressions."""
    return ca.SX(ca.sparsify(ca.DM(np.where(np.abs(matrix) < 1e-14, 0.0, matrix))))


def rotation_about(axis, angle):
    """Rodrigues' formula; a principal axis keeps its zeros."""
    k = exact(ca.DM(ca.skew(ca.DM(axis))).full())
    return ca.SX(ca.DM.eye(3)) + ca.sin(angle) * k + (1 - ca.cos(angle)) * ca.mtimes(k, k)


def link_frames(arm, q):
    """T_k = T_{k-1} * origin_k * Rot(axis_k, q_k) as (R, p) for the links 0..n, then the controlled frame E."""
    frames = [(ca.SX(ca.DM.eye(3)), ca.SX(3, 1))]
    for k, (origin, axis) in enumerate(zip(arm.origins, arm.axes)):
        rotation, position = frames[-1]
        position = position + rotation @ exact(origin[:3, 3])
        rotation = rotation @ exact(origin[:3, :3])
        if arm.prismatic[k]:
            position = position + rotation @ exact(axis) * q[k]
        else:
            rotation = rotation @ rotation_about(axis, q[k])
        frames.append((rotation, position))
    rotation, position = frames[-1]
    frames.append((rotation @ exact(arm.tool[:3, :3]), position + rotation @ exact(arm.tool[:3, 3])))
    return frames


@dataclass
class Stage:
    """Symbols of one instant. A sum of stage costs and rows of stage constraints makes the whole problem."""

    n: int
    q: ca.SX = field(init=False)
    dq: ca.SX = field(init=False)
    u: ca.SX = field(init=False)

    def __post_init__(self):
        self.q, self.dq, self.u = ca.SX.sym("q", self.n), ca.SX.sym("dq", self.n), ca.SX.sym("u", self.n)
        self.x = ca.vertcat(self.q, self.dq)
        self.p_ref, self.R_ref = ca.SX.sym("p_ref", 3), ca.SX.sym("R_ref", 3, 3)
        self.w = ca.SX.sym("w", weights_size(self.n))
        # The order of pack_weights.
        sizes = np.cumsum([0, 3, 3, self.n, self.n, 1, 1])
        self.w_position, self.w_orientation, self.w_velocity, self.w_acceleration, self.w_lateral, self.w_vertical = (
            self.w[a:b] for a, b in zip(sizes[:-1], sizes[1:])
        )
        self.reference = ca.vertcat(self.p_ref, ca.vec(self.R_ref))


def weights_size(n):
    return 8 + 2 * n


def pack_weights(weights, n):
    """In the order of Stage.w. One number stands for all entries and an absent term has weight 0, as in `solve`."""
    sizes = {"position": 3, "orientation": 3, "velocity": n, "acceleration": n, "lateral": 1, "vertical": 1}
    return np.concatenate(
        [np.broadcast_to(np.array(weights.get(name, 0.0), dtype=float), size) for name, size in sizes.items()]
    )


def pack_references(reference):
    """12 x N; each column p_ref, then R_ref column by column."""
    return np.array([np.concatenate([r["p"], np.array(r["R"]).T.ravel()]) for r in reference]).T


def has_liquid(weights):
    return bool(np.any(weights.get("lateral", 0)) or np.any(weights.get("vertical", 0)))


class Formulation:
    """Terms, constraints and dynamics as CasADi expressions of one stage, and as functions of it."""

    def __init__(self, arm, dt, horizon):
        self.arm, self.dt, self.horizon = arm, dt, horizon
        n = arm.dof
        self.stage = s = Stage(n)
        self.frames = link_frames(arm, s.q)
        rotation, position = self.frames[-1]

        # What the glass feels. p'' = J u + dJ/dt dq, as the derivative of the velocity along (dq, u).
        velocity = ca.jtimes(position, s.q, s.dq)
        acceleration = ca.jtimes(velocity, ca.vertcat(s.q, s.dq), ca.vertcat(s.dq, s.u))
        self.a_local = rotation.T @ (acceleration + GRAVITY)
        excess = self.a_local - GRAVITY

        # Residuals and weights: each term is sum(weight * residual^2). `peers.py` hands them to Gauss-Newton.
        self.residuals = {
            "position": (position - s.p_ref, s.w_position),
            "orientation": (ca.vec(rotation - s.R_ref), ca.vec(ca.repmat(s.w_orientation.T, 3, 1))),
            "velocity": (s.dq, s.w_velocity),
            "acceleration": (s.u, s.w_acceleration),
            "lateral": (excess[:2], ca.repmat(s.w_lateral, 2, 1)),
            "vertical": (excess[2], s.w_vertical),
        }
        # Sums run over k = 1..N for terms of the state with a reference, and k = 0..N-1 for those with the input.
        self.state_terms = ("position", "orientation", "velocity")
        self.input_terms = ("acceleration", "lateral", "vertical")
        self.terms = {name: ca.dot(w, r * r) for name, (r, w) in self.residuals.items()}

        self.next_x = ca.vertcat(s.q + dt * s.dq + dt**2 / 2 * s.u, s.dq + dt * s.u)
        self.distances = self._distances()  # >= 0
        self.x_max = np.concatenate([arm.position_max, arm.velocity_max])
        self.x_min = np.concatenate([arm.position_min, -arm.velocity_max])
        self.u_max = arm.acceleration_max

    def _distances(self):
        centers = [
            position + rotation @ exact(center)
            for (rotation, position), center in ((self.frames[link], center) for link, center, _ in self.arm.spheres)
        ]
        rows = [
            ca.sumsqr(centers[i] - centers[j]) - (self.arm.spheres[i][2] + self.arm.spheres[j][2]) ** 2
            for i, j in self.arm.pairs
        ]
        return ca.vertcat(*rows) if rows else ca.SX(0, 1)

    def state_cost(self):
        return self.dt * sum(self.terms[name] for name in self.state_terms)

    def input_cost(self, liquid=True):
        return self.dt * sum(self.terms[name] for name in self.input_terms if liquid or name == "acceleration")

    def functions(self, liquid=True):
        """CasADi functions of one stage: (x, reference, w) -> cost, (x, u, w) -> cost, x -> distances, (x, u) -> x+."""
        s = self.stage
        return (
            ca.Function("state_cost", [s.x, s.reference, s.w], [self.state_cost()]),
            ca.Function("input_cost", [s.x, s.u, s.w], [self.input_cost(liquid)]),
            ca.Function("distances", [s.x], [self.distances]),
            ca.Function("next_x", [s.x, s.u], [self.next_x]),
        )

    def term_values(self, problem, x, u):
        """Share of each term in the objective, term by term."""
        s = self.stage
        values = dict.fromkeys(self.terms, 0.0)
        function = ca.Function("terms", [s.x, s.u, s.reference, s.w], [ca.vertcat(*self.terms.values())])
        weights, references = pack_weights(problem["weights"], self.arm.dof), pack_references(problem["reference"])
        nothing = np.zeros(12)
        for k in range(self.horizon + 1):
            row = np.array(
                function(
                    x[k],
                    u[k] if k < self.horizon else np.zeros(self.arm.dof),
                    references[:, k - 1] if k > 0 else nothing,
                    weights,
                )
            ).ravel()
            for name, value in zip(self.terms, row):
                if (k > 0 and name in self.state_terms) or (k < self.horizon and name in self.input_terms):
                    values[name] += self.dt * value
        return values


class StackedProblem:
    """Direct multiple shooting: z = [x_0, u_0, x_1, u_1, ..., x_N] and stage-wise rows, the order that FATROP wants.

    Rows of g, stage by stage: x_{k+1} - f(x_k, u_k) = 0 first, then x_0 - x0 = 0 (k = 0) or distances >= 0 (k > 0).
    Parameters: x0, references, weights.
    """

    def __init__(self, formulation, liquid=True, symbol=ca.MX):
        self.formulation = formulation
        n, horizon = formulation.arm.dof, formulation.horizon
        self.n, self.horizon = n, horizon
        state_cost, input_cost, distances, next_x = formulation.functions(liquid)
        x = [symbol.sym(f"x{k}", 2 * n) for k in range(horizon + 1)]
        u = [symbol.sym(f"u{k}", n) for k in range(horizon)]
        x0, references, w = symbol.sym("x0", 2 * n), symbol.sym("ref", 12, horizon), symbol.sym("w", weights_size(n))

        objective, rows, lower, upper, equality = 0, [], [], [], []

        def constrain(expression, is_equality):
            size = expression.shape[0]
            rows.append(expression)
            equality.extend([is_equality] * size)
            lower.extend([0.0] * size)
            upper.extend([0.0 if is_equality else np.inf] * size)

        for k in range(horizon + 1):
            if k > 0:
                objective += state_cost(x[k], references[:, k - 1], w)
            if k < horizon:
                objective += input_cost(x[k], u[k], w)
                constrain(x[k + 1] - next_x(x[k], u[k]), True)
            if k == 0:
                constrain(x[0] - x0, True)
            else:
                constrain(distances(x[k]), False)

        self.z = ca.vertcat(*[symbol_k for k in range(horizon) for symbol_k in (x[k], u[k])], x[horizon])
        self.parameters = ca.vertcat(x0, ca.vec(references), w)
        self.objective, self.g = objective, ca.vertcat(*rows)
        self.g_min, self.g_max, self.equality = np.array(lower), np.array(upper), equality
        # x_0 is given and has no bounds.
        free = np.full(2 * n, np.inf)
        f = formulation
        self.z_max = np.concatenate([free, f.u_max] + [np.concatenate([f.x_max, f.u_max])] * (horizon - 1) + [f.x_max])
        self.z_min = np.concatenate(
            [-free, -f.u_max] + [np.concatenate([f.x_min, -f.u_max])] * (horizon - 1) + [f.x_min]
        )

    def nlp(self):
        return {"x": self.z, "p": self.parameters, "f": self.objective, "g": self.g}

    def pack(self, x, u):
        return np.concatenate([part for k in range(self.horizon) for part in (x[k], u[k])] + [x[self.horizon]])

    def unpack(self, z):
        n = self.n
        z = np.asarray(z, dtype=float).ravel()
        stages = z[: 3 * n * self.horizon].reshape(self.horizon, 3 * n)
        return np.vstack([stages[:, : 2 * n], z[3 * n * self.horizon :]]), stages[:, 2 * n :].copy()

    def pack_parameters(self, problem):
        return np.concatenate(
            [problem["x0"], pack_references(problem["reference"]).T.ravel(), pack_weights(problem["weights"], self.n)]
        )


def initial_guess(problem, n):
    """The problem's own guess; without one, on from x0 with constant velocity, as `solve` does."""
    guess = problem.get("guess")
    if guess:
        return np.array(guess["x"], dtype=float), np.array(guess["u"], dtype=float)
    x0, times = np.array(problem["x0"], dtype=float), problem["dt"] * np.arange(problem["horizon"] + 1)
    x = np.hstack([x0[:n] + np.outer(times, x0[n:]), np.tile(x0[n:], (len(times), 1))])
    return x, np.zeros((problem["horizon"], n))
