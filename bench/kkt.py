"""One yardstick for all solvers: objective, constraint violation and KKT error of a point (x, u), from the point alone.

With linear dynamics and x_0 given, the inputs determine everything: z = z_0 + T u. The multipliers of the dynamics are
thereby eliminated exactly, and what is left is, over all constraints c(z) >= 0 (distances, limits; C = dc/dz),

    stationarity      || T' (grad f - C' m) ||_inf      complementarity   max m_i |c_i|      with m >= 0.

The multipliers are not the solver's own but the ones that suit the point best: nonnegative least squares on both lines
at once. So a point that is optimal is found to be so whatever the solver's convention of sign and scale, and the figure
is an upper bound, as least squares do not minimise the largest entry. Both are divided by max(1, ||grad f||_inf). The
error is the largest of the two and of the violation.

Violation is the largest of the defects of the dynamics and of x_0 (rad, rad/s) and of the shortfalls of c (m^2 for
squared distances; rad, rad/s, rad/s^2 for limits); nothing is scaled.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.optimize import nnls

from formulation import StackedProblem

NEAR = 0.01  # a constraint with more slack than this (m^2, rad, ...) gets no multiplier


@dataclass
class Verdict:
    objective: float
    violation: float
    stationarity: float
    complementarity: float

    @property
    def error(self):
        return max(self.violation, self.stationarity, self.complementarity)


class Judge:
    def __init__(self, formulation):
        self.stacked = s = StackedProblem(formulation)
        self.evaluate = ca.Function(
            "evaluate", [s.z, s.parameters], [s.objective, ca.gradient(s.objective, s.z), s.g, ca.jacobian(s.g, s.z)]
        )
        self.is_equality = np.array(s.equality)
        self.tangent = self._tangent(formulation)
        # x_0 is no variable of the reduced problem, and carries no bounds.
        self.has_upper, self.has_lower = np.isfinite(s.z_max), np.isfinite(s.z_min)

    def _tangent(self, formulation):
        """T: how z moves with the inputs u_0..u_{N-1}, along the dynamics."""
        n, horizon, dt = self.stacked.n, self.stacked.horizon, formulation.dt
        identity, zero = np.eye(n), np.zeros((n, n))
        a = np.block([[identity, dt * identity], [zero, identity]])
        b = np.vstack([dt**2 / 2 * identity, dt * identity])
        rows, x = [], np.zeros((2 * n, n * horizon))
        for k in range(horizon):
            u = np.zeros((n, n * horizon))
            u[:, k * n : (k + 1) * n] = identity
            rows += [x, u]
            x = a @ x + b @ u
        return np.vstack(rows + [x])

    def __call__(self, problem, x, u):
        s = self.stacked
        z = s.pack(x, u)
        if not np.all(np.isfinite(z)):
            return Verdict(np.inf, np.inf, np.inf, np.inf)
        objective, gradient, g, jacobian = self.evaluate(z, s.pack_parameters(problem))
        gradient, g = np.array(gradient).ravel(), np.array(g).ravel()
        scale = max(1.0, np.abs(gradient).max())

        reduced_jacobian = ca.DM(jacobian).sparse() @ self.tangent
        upper, lower = self.has_upper, self.has_lower
        slack = np.concatenate([g[~self.is_equality], (s.z_max - z)[upper], (z - s.z_min)[lower]])
        slope = np.vstack([reduced_jacobian[~self.is_equality], -self.tangent[upper], self.tangent[lower]])
        violation = max(np.abs(g[self.is_equality]).max(), -slack.min(), 0.0)

        near = slack < NEAR
        slack, slope, target = np.abs(slack[near]), slope[near], self.tangent.T @ gradient
        multipliers = nnls(np.vstack([slope.T, np.diag(slack)]), np.concatenate([target, np.zeros(len(slack))]))[0]
        stationarity = np.abs(target - slope.T @ multipliers).max()
        complementarity = (multipliers * slack).max(initial=0.0)
        return Verdict(float(objective), float(violation), stationarity / scale, complementarity / scale)
