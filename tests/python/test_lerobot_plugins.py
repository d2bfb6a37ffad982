"""The plug-ins of LeRobot (docs/how-to/policies.md) before its own base classes and loader, in a Python that has lerobot 0.4.4 and the plug-ins:
STEADYHAND_LEROBOT names it. Without it, what can be said without LeRobot."""

import os
import subprocess
import tomllib
from pathlib import Path

import pytest
import steadyhand
from live_client import Demo
from places import ROOT

LEROBOT = os.environ.get("STEADYHAND_LEROBOT", "")
LOOP = '''
import sys, time
import numpy as np
from lerobot.utils.import_utils import make_device_from_device_class, register_third_party_plugins
from lerobot.robots.config import RobotConfig
from lerobot.robots.robot import Robot
from lerobot.teleoperators.config import TeleoperatorConfig
from lerobot.teleoperators.teleoperator import Teleoperator
from lerobot.teleoperators.utils import TeleopEvents

port = int(sys.argv[1])
register_third_party_plugins()
robot = make_device_from_device_class(RobotConfig.get_choice_class("steadyhand")(id="arm", port=port, turn=True, fps=20))
teleop = make_device_from_device_class(TeleoperatorConfig.get_choice_class("steadyhand")(id="hand", port=port))
assert isinstance(robot, Robot) and isinstance(teleop, Teleoperator)
features = robot.observation_features, robot.action_features
assert not robot.is_connected and len(features[0]) == 6 + 6 + 7 and set(features[1]) == set(teleop.action_features)
robot.connect()
teleop.connect()
assert robot.is_connected and robot.is_calibrated and teleop.is_connected
first = robot.get_observation()
assert set(first) == set(features[0])
action = {name: first[name] for name in features[1]}
end = time.monotonic() + 6.0
while time.monotonic() < end:
    action["tool.z"] = min(action["tool.z"] + 0.004, first["tool.z"] + 0.05)
    assert robot.send_action(action) == action
    assert set(teleop.get_action()) == set(teleop.action_features)
    assert teleop.get_teleop_events()[TeleopEvents.IS_INTERVENTION] is False
    time.sleep(0.05)
last = robot.get_observation()
assert abs(last["tool.z"] - action["tool.z"]) < 0.01, (first["tool.z"], last["tool.z"], action["tool.z"])
try:
    robot.send_action({"tool.x": 1.0})
    raise SystemExit("an action without its members was sent")
except ValueError as error:
    assert "tool.y" in str(error)
robot.disconnect()
teleop.disconnect()
assert not robot.is_connected
print("done")
'''


@pytest.mark.parametrize("kind", ["robot", "teleoperator"])
def test_names_are_those_that_lerobot_looks_for_and_this_version(kind):
    project = tomllib.loads((ROOT / f"python/lerobot/{kind}/pyproject.toml").read_text())["project"]
    assert project["name"] == f"lerobot_{kind}_steadyhand" and (ROOT / f"python/lerobot/{kind}/{project['name']}/__init__.py").exists()
    assert project["version"] == steadyhand.__version__


@pytest.mark.skipif(not LEROBOT, reason="STEADYHAND_LEROBOT names no Python that has lerobot 0.4.4 and the plug-ins")
def test_lerobots_own_loader_and_base_classes_take_them(tmp_path):
    demo = Demo(tmp_path / "sessions", "--profile", "tracking")
    environment = {**os.environ, "PYTHONPATH": str(Path(steadyhand.__file__).parents[1]), "HF_HOME": str(tmp_path)}
    done = subprocess.run([LEROBOT, "-c", LOOP, str(demo.port)], capture_output=True, text=True, timeout=300, env=environment)
    demo.end()
    assert done.returncode == 0 and done.stdout.strip().endswith("done"), done.stdout + done.stderr
