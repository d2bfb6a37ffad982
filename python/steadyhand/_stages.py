"""The stages before the planner, each by itself, and a liquid to try plans on."""

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
    """Hand to tool, relative to where both were when the clutch closed, so that engaging never steps the target.

    scale: metres of the tool per metre of the hand, above 0. yaw: rad, turn of the operator's axes about the base's z.
    translation_frame, rotation_frame: "base": the operator's axes, turned by yaw, are the base's; "tool": the hand's axes at
    engagement are the tool's at engagement. ramp: s in which the share of the motion that is followed grows from 0 to all.
    tilt: rad, how far the tool's z may lean from the vertical with the hand, 0 (upright) to pi (as the hand leans).

    Raises ValueError (SteadyhandError is one) for numbers out of range or not finite and for matrices that are no pose or of
    another shape; TypeError for what are no numbers.
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
        """Each pose of the hand, in order of time. Returns T_base_tool (4, 4) of the target, and whether it follows the hand.

        T_operator_hand: (4, 4), robot axes (z up), m. t: s. T_base_tool: (4, 4), where the tool is now: what the target
        becomes when the clutch closes or opens.
        """
        return self._native.update(
            array("T_operator_hand", T_operator_hand, (4, 4)),
            number("t", t, "seconds"),
            flag("clutch", clutch),
            array("T_base_tool", T_base_tool, (4, 4)),
        )

    def set_tilt(self, tilt: float) -> None:
        """rad. From one to the other the target goes at a radian a second: it does not jump."""
        self._native.set_tilt(number("tilt", tilt))

    def release(self) -> None:
        """Lets go: the next pose with a closed clutch engages anew."""
        self._native.release()


class Predictor:
    """What a target will do. prediction="constant_velocity": on from the newest, at constant velocity and angular velocity, which
    are slopes of weighted least-squares lines through the targets of the last `window` seconds. "decaying": on from where a Kalman
    filter has it, with its velocity and acceleration, which decay.

    horizon: N, 1 to 128, poses of predict(). dt: s between them. window: s. max_gap: s without targets after which the hand
    counts as lost and rests. robot: whose reach predictions are clipped to; None: no reach. Raises as Retargeter.
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
        """The next target: (4, 4) in the base, m, at t s. One that is not newer than the last is dropped; engaged=False forgets
        the motion.
        """
        self._native.update(array("T_base_tool", T_base_tool, (4, 4)), number("t", t, "seconds"), flag("engaged", engaged))

    def at(self, t: float) -> Array:
        """Where the target is at time t, if it goes on as it does: (4, 4), not clipped."""
        return self._native.at(number("t", t, "seconds"))

    def spread(self, t: float) -> tuple[float, float]:
        """How far off at(t) may be: standard deviations of its position, m, along the way that the target goes and in each
        direction across it. (0, 0): not known, as of constant velocity, or before any target.
        """
        return self._native.spread(number("t", t, "seconds"))

    def predict(self, t: float) -> Array:
        """(N, 4, 4): where the target is at t + dt, ..., t + N dt, inside the reach; (0, 4, 4) before any target."""
        return self._native.predict(number("t", t, "seconds"))

    @property
    def velocity(self) -> Array:
        """(3,), m/s, base axes."""
        return self._native.velocity

    @property
    def angular_velocity(self) -> Array:
        """(3,), rad/s, base axes."""
        return self._native.angular_velocity


class LiquidState(NamedTuple):
    tilt_x: float
    """rad, of the surface's normal about the glass's x axis."""
    tilt_y: float
    """rad, about its y axis."""
    freeboard: float
    """m, from the surface's highest point to the rim; negative: over the rim."""
    spilled: bool
    """It has gone over the rim since the last reset."""
    spilled_share: float
    """Of the liquid, since then."""


class Liquid:
    """The liquid in a glass: its surface as a plane that swings with the first sloshing mode, driven by the glass's
    acceleration also along its axis. radius to frequency_factor: as Glass's. Raises as Retargeter.
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
        """rad/s, of the first sloshing mode."""
        self.damping: float
        """Of that mode, as a share of critical damping: 0.006 for water in a drinking glass."""
        self.frequency, self.damping = _native.Liquid.mode(glass)

    def update(self, dt: float, local_acceleration: ArrayLike) -> LiquidState:
        """Moves on by dt s, in which the glass has this acceleration (3,), m/s^2, in its own frame, as
        Robot.local_acceleration() tells it: (0, 0, 9.81) at rest and upright.
        """
        dt = number("dt", dt, "seconds")
        if not 0.0 < dt <= 10.0:
            raise ValueError(f"dt is {dt:g} s; it must be above 0, to 10")
        return LiquidState(*self._native.update(dt, array("local_acceleration", local_acceleration, (3,))))

    def reset(self) -> None:
        """At rest, nothing spilled."""
        self._native.reset()


document(globals())
