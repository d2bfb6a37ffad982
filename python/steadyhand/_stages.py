"""The stages before the planner, and a simulated liquid."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

from numpy.typing import ArrayLike

from . import _native
from ._arrays import Array, array, flag, number
from ._documented import document
from ._options import options
from ._robot import Robot, as_robot


class Retargeter:
    """Maps the hand's motion to the tool, relative to both poses when the clutch closed. Engaging therefore never steps the target.

    scale: tool motion divided by hand motion, above 0. yaw: rad, turn of the operator frame about the base's z axis.
    translation_frame, rotation_frame: "base": the operator's axes, turned by yaw, are the base's. "tool": the hand's axes when
    engaging are the tool's. ramp: s in which the share of the motion that is followed grows from 0 to 1.
    tilt: rad, largest lean of the tool's z axis from the vertical with the hand, 0 (upright) to pi (as the hand leans).

    Raises ValueError (SteadyhandError is one) for numbers out of range or not finite, and for matrices of a wrong shape or that
    are not poses; TypeError for other types.
    """

    def __init__(
        self,
        scale: float = 0.5,
        yaw: float | None = None,
        translation_frame: str = "base",
        rotation_frame: str = "base",
        ramp: float = 0.0,
        tilt: float | None = None,
    ) -> None:
        given = options(scale=scale, yaw=yaw, translation_frame=translation_frame, rotation_frame=rotation_frame, ramp=ramp, tilt=tilt)
        self._native = _native.Retargeter(given)

    def update(self, T_operator_hand: ArrayLike, t: float, T_base_tool: ArrayLike, clutch: bool = True) -> tuple[Array, bool]:
        """Adds a pose of the hand, in order of time. Returns the target T_base_tool (4, 4), and whether it follows the hand.

        T_operator_hand: (4, 4), in the operator frame with robot axes (z up), m. t: s. T_base_tool: (4, 4), current pose of the
        tool, m; the target starts there when the clutch closes or opens.
        """
        return self._native.update(
            array("T_operator_hand", T_operator_hand, (4, 4)),
            number("t", t, "seconds"),
            flag("clutch", clutch),
            array("T_base_tool", T_base_tool, (4, 4)),
        )

    def set_tilt(self, tilt: float) -> None:
        """Sets the largest lean, rad. The target turns there at 1 rad/s."""
        self._native.set_tilt(number("tilt", tilt))

    def release(self) -> None:
        """Releases the clutch: the next pose with a closed clutch engages again."""
        self._native.release()


class Predictor:
    """Predicts the motion of a target. prediction="constant_velocity": from the newest target at constant velocity and angular
    velocity, the slopes of weighted least-squares lines through the targets of the last `window` seconds. "decaying": from the
    state of a Kalman filter, with velocity and acceleration that decay.

    horizon: N, 1 to 128, number of poses of predict(). dt: s between them. window: s. max_gap: s without targets after which the
    target counts as lost and at rest. robot: predictions are clipped to its reach; None: not clipped. Raises as Retargeter.
    """

    def __init__(
        self,
        horizon: int = 8,
        dt: float = 0.05,
        *,
        window: float = 0.06,
        max_gap: float = 0.25,
        robot: Robot | str | os.PathLike[str] | None = None,
        prediction: str = "constant_velocity",
    ) -> None:
        times = {key: number(key, value, "seconds") for key, value in (("dt", dt), ("window", window), ("max_gap", max_gap))}
        if not 0.0 < times["dt"] <= 10.0:
            raise ValueError(f"dt is {times['dt']:g}; it must be above 0, to 10 s")
        for key in ("window", "max_gap"):
            if not times[key] > 0.0:
                raise ValueError(f"{key} is {times[key]:g}; it must be above 0")
        given = options(horizon=number("horizon", horizon), **times)
        self._native: Any = _native.Predictor(None if robot is None else as_robot(robot)._native, prediction=prediction, **given)

    def update(self, T_base_tool: ArrayLike, t: float, engaged: bool = True) -> None:
        """Adds a target: (4, 4) in the base frame, m, at time t, s. It is dropped if it is not newer than the last one.
        engaged=False discards the earlier motion.
        """
        self._native.update(array("T_base_tool", T_base_tool, (4, 4)), number("t", t, "seconds"), flag("engaged", engaged))

    def at(self, t: float) -> Array:
        """Predicted target at time t, s: (4, 4), m, not clipped."""
        return self._native.at(number("t", t, "seconds"))

    def spread(self, t: float) -> tuple[float, float]:
        """Standard deviations of the position of at(t), m: along the target's way, and in each direction across it. (0, 0): unknown,
        for constant velocity and before the first target.
        """
        return self._native.spread(number("t", t, "seconds"))

    def predict(self, t: float) -> Array:
        """Predicted targets at t + dt, ..., t + N dt, (N, 4, 4), m, within the reach; (0, 4, 4) before the first target."""
        return self._native.predict(number("t", t, "seconds"))

    @property
    def velocity(self) -> Array:
        """Linear velocity of the target, (3,), m/s, base axes."""
        return self._native.velocity

    @property
    def angular_velocity(self) -> Array:
        """Angular velocity of the target, (3,), rad/s, base axes."""
        return self._native.angular_velocity


class LiquidState(NamedTuple):
    """State of the simulated liquid."""

    tilt_x: float
    """rad, tilt of the surface's normal about the glass's x axis."""
    tilt_y: float
    """rad, the same about its y axis."""
    freeboard: float
    """m, height from the surface's highest point to the rim; negative: over the rim."""
    spilled: bool
    """Liquid went over the rim since the last reset."""
    spilled_share: float
    """Spilled share of the liquid since then, 0 to 1."""


class Liquid:
    """Simulated liquid in a glass: a plane surface that moves with the first sloshing mode. The specific force drives it, also along
    the glass's axis. radius to frequency_factor: as Glass. Raises as Retargeter.
    """

    def __init__(self, radius: float = 0.035, height: float = 0.1, fill: float = 0.09, viscosity: float = 1e-6, frequency_factor: float = 1.0) -> None:
        radius, height, fill = number("radius", radius, "metres"), number("height", height, "metres"), number("fill", fill, "metres")
        viscosity, frequency_factor = number("viscosity", viscosity, "m^2/s"), number("frequency_factor", frequency_factor)
        if not 0.2 <= frequency_factor <= 5.0:
            raise ValueError(f"frequency_factor is {frequency_factor:g}; it must be from 0.2 to 5")
        if not (radius > 0.0 and 0.0 < fill < height and 0.0 <= viscosity <= 1.0):
            raise ValueError(
                f"a glass of radius {radius:g} m and height {height:g} m, filled to {fill:g} m, with a viscosity of {viscosity:g} m^2/s: "
                "radius and fill must be above 0, the fill below the height, the viscosity from 0 to 1"
            )
        glass = radius, height, fill, viscosity, frequency_factor
        self._native = _native.Liquid(glass)
        self.frequency: float
        """rad/s, frequency of the first sloshing mode."""
        self.damping: float
        """Damping ratio of that mode: 0.006 for water in a drinking glass."""
        self.frequency, self.damping = _native.Liquid.mode(glass)

    def update(self, dt: float, local_acceleration: ArrayLike) -> LiquidState:
        """Advances by dt, s, with this specific force (3,), m/s^2, in the glass's frame (Robot.local_acceleration()): (0, 0, 9.81) at
        rest and upright.
        """
        dt = number("dt", dt, "seconds")
        if not 0.0 < dt <= 10.0:
            raise ValueError(f"dt is {dt:g} s; it must be above 0, to 10")
        return LiquidState(*self._native.update(dt, array("local_acceleration", local_acceleration, (3,))))

    def reset(self) -> None:
        """Sets the liquid to rest, with nothing spilled."""
        self._native.reset()


document(globals())
