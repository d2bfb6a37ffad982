"""Containers other than the usual glass: their frequencies, and the settings that have them."""

import sys
from pathlib import Path

import numpy as np
import pytest
import steadyhand
import yaml

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench"))
from containers import CONTAINERS, cylinder_frequency, figures, frequency  # noqa: E402


def test_frequencies_are_those_that_are_known():
    for radius, fill in ((0.035, 0.09), (0.1, 0.02), (0.05, 0.05)):
        assert frequency(lambda z, r=radius: r + 0 * z, fill) == pytest.approx(cylinder_frequency(radius, fill), rel=1e-4)
    # McIver, Sloshing frequencies for cylindrical and spherical containers filled to an arbitrary depth, 1989: w^2 R / g.
    for share, known in ((0.2, 1.0723), (0.6, 1.2625), (1.0, 1.5602), (1.4, 2.1232)):
        omega = frequency(lambda z: np.sqrt(np.maximum(0.0, z * (0.2 - z))), 0.1 * share)
        assert omega**2 * 0.1 / 9.81 == pytest.approx(known, abs=1e-4)


@pytest.mark.parametrize("container", CONTAINERS[1:], ids=lambda c: c.name)
def test_the_settings_of_each_have_its_frequency_and_plans_know_it(container):
    settings = yaml.safe_load((ROOT / f"examples/{container.name}.yaml").read_text())["glass"]
    radius, omega, factor = figures(container)
    assert settings["radius"] == pytest.approx(radius, abs=1e-4)
    assert settings.get("frequency_factor", 1.0) == pytest.approx(factor, abs=2e-3)
    assert (settings["height"], settings["fill"]) == (container.height, container.fill)
    glass = steadyhand.Glass(**settings)
    assert steadyhand.Liquid(*glass).frequency == pytest.approx(omega, rel=3e-3)
    planner = steadyhand.Pipeline("ur5e", "carry", glass=glass)
    t, hand = np.arange(0.0, 3.0, 0.01), np.eye(4)
    commands = []
    for now in t:  # back and forth by 15 cm, as fast as a person moves
        hand[1, 3] = 0.3 * np.sin(4.0 * now)
        planner.feed(hand, now)
        commands += [planner.update(now + 0.002 * i) for i in range(5)]
    robot = planner.robot
    force = robot.local_acceleration(*(np.array(part) for part in zip(*commands)))
    liquid = steadyhand.Liquid(*glass)
    assert not [state for state in (liquid.update(0.002, f) for f in force) if state.spilled]
    tool = robot.fk(np.array([q for q, _, _ in commands]))[:, :3, 3]
    assert np.ptp(tool[:, :2], axis=0).max() > 0.1  # it follows
