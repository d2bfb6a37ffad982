"""The package of ROS 2: its manifest, its launch files, and what colcon makes of a checkout."""

import importlib.util
import os
import shutil
import subprocess
import sys
import types
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from places import PROGRAM, ROOT

sys.path.insert(0, str(ROOT / "setup"))
import install  # noqa: E402

# rosdep's names for packages of Debian; a ROS 2 distribution has Cyclone DDS and its compiler.
ROSDEP = {
    **{name: name for name in ("cmake", "libboost-dev", "libqrencode-dev", "libssl-dev", "liburdfdom-dev", "libzstd-dev", "pkg-config")},
    **{"libassimp-dev": "assimp", "libcli11-dev": "cli11", "libeigen3-dev": "eigen", "libfmt-dev": "fmt", "libtinyxml2-dev": "tinyxml2"},
    **{"libyaml-cpp-dev": "yaml-cpp", "nlohmann-json3-dev": "nlohmann-json-dev", "?cyclonedds-dev": "cyclonedds", "?cyclonedds-tools": "cyclonedds"},
}
# Part of every workspace, or for the page only, which is optional.
NOT_NAMED = {"g++", "ninja-build", "git", "nodejs", "npm", "ca-certificates", "python3", "python3-venv"}


def named(*tags):
    return {element.text for element in ElementTree.parse(ROOT / "package.xml").getroot() if element.tag in tags}


def test_the_manifest_names_what_the_build_needs():
    packages = {words[0] for name in ("apt.txt", "apt-ros2.txt") for words in install.lines(name)}
    assert {ROSDEP[name] for name in packages - NOT_NAMED} == named("buildtool_depend", "build_depend", "depend")


JOINTS = [f"{name}_joint" for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")]
# Parameters known in all of Humble, Jazzy, Kilted, Lyrical and Rolling, by the sources of joint_trajectory_controller, of the
# spawner and of ur_robot_driver.
PARAMETERS = {
    *("type", "joints", "command_interfaces", "state_interfaces", "allow_partial_joints_goal", "action_monitor_rate"),
    *("allow_nonzero_velocity_at_trajectory_end", "cmd_timeout", "constraints", "interpolation_method"),
}
SPAWNER_OPTIONS = {"--param-file", "--controller-manager-timeout", "--inactive", "--controller-manager"}
DRIVER_ARGUMENTS = {"ur_type", "robot_ip", "tf_prefix", "launch_rviz", "activate_joint_controller"}


def load_launch_file(name, monkeypatch):
    """What it starts, without ROS: the modules of launch are stand-ins that keep what they are given."""

    def keep(name):
        return lambda *values, **named: {"what": name, "values": values, **named}

    modules = {
        "launch": ["LaunchDescription"],
        "launch.actions": ["DeclareLaunchArgument", "ExecuteProcess", "IncludeLaunchDescription", "OpaqueFunction"],
        "launch.launch_description_sources": ["PythonLaunchDescriptionSource"],
        "launch.substitutions": ["LaunchConfiguration", "PathJoinSubstitution"],
        "launch_ros": [],
        "launch_ros.actions": ["Node"],
        "launch_ros.substitutions": ["FindPackageShare"],
    }
    for module_name, members in modules.items():
        module = types.ModuleType(module_name)
        for member in members:
            setattr(module, member, keep(member))
        monkeypatch.setitem(sys.modules, module_name, module)
    spec = importlib.util.spec_from_file_location("steadyhand_launch", ROOT / f"ros2/launch/{name}.launch.py")
    launch = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(launch)
    return launch, launch.generate_launch_description()["values"][0]


def test_the_launch_file_asks_for_what_every_distribution_has(monkeypatch):
    _, entities = load_launch_file("steadyhand", monkeypatch)
    (driver,) = [e for e in entities if e["what"] == "IncludeLaunchDescription"]
    assert set(dict(driver["launch_arguments"])) <= DRIVER_ARGUMENTS
    (spawner,) = [e for e in entities if e["what"] == "Node"]
    assert (spawner["package"], spawner["executable"]) == ("controller_manager", "spawner")
    assert {"ur_robot_driver", spawner["package"], "joint_trajectory_controller"} < named("exec_depend")
    options = {a for a in spawner["arguments"] if isinstance(a, str) and a.startswith("-")}
    assert options <= SPAWNER_OPTIONS
    (defaults,) = [e for e in entities if e["values"] and e["values"][0] == "parameters"]
    parameters = yaml.safe_load(Path(defaults["default_value"]).read_text())
    assert set(parameters) == {spawner["arguments"][0]}
    controller = parameters[spawner["arguments"][0]]["ros__parameters"]
    assert set(controller) <= PARAMETERS
    assert controller["type"] == "joint_trajectory_controller/JointTrajectoryController"
    assert controller["joints"] == JOINTS and set(JOINTS) <= set(controller["constraints"])
    assert not controller["allow_nonzero_velocity_at_trajectory_end"]


def test_the_launch_file_of_the_program_gives_options_that_it_knows(monkeypatch):
    launch, _ = load_launch_file("demo", monkeypatch)
    given = {**{name: value for name, (value, _) in launch.ARGUMENTS.items()}, "robot": "ur5e", "port": "0", "options": "--settings none.yaml"}
    monkeypatch.setattr(launch, "LaunchConfiguration", lambda name: types.SimpleNamespace(perform=lambda context: given[name]))
    (action,) = launch.start(None)
    command = action["cmd"]
    assert command[:2] == ["steadyhand", "demo"] and command[-1] == "ros2.controller=/steadyhand_controller"
    assert "--profile" not in command and "--yes" not in command  # the user's settings and consent
    done = subprocess.run([PROGRAM, *command[1:]], capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and "none.yaml" in done.stderr, done.stderr


@pytest.mark.long
def test_colcon_builds_a_checkout(tmp_path):
    """With nothing but the system's packages: without page and URDFs of Python packages, which the log says."""
    colcon = shutil.which("colcon", path=f"{ROOT}/.deps/venv/bin:{os.environ['PATH']}")
    if colcon is None:
        pytest.skip("colcon is not installed: ./steadyhand test --long does that")
    ignored = shutil.ignore_patterns(".*", "build", "dist", "out", "node_modules", "__pycache__")
    package = shutil.copytree(ROOT, tmp_path / "src/steadyhand", ignore=ignored)
    # In the package, where ccache has the paths of every checkout.
    command = [colcon, "build", "--build-base", package / "build", "--event-handlers", "console_direct+"]
    environment = {key: value for key, value in os.environ.items() if not key.startswith("STEADYHAND")}
    environment |= {"CMAKE_GENERATOR": "Ninja", "PATH": "/usr/sbin:/usr/bin:/sbin:/bin"}
    built = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=3600)
    log = " ".join((built.stdout + built.stderr).split())
    assert built.returncode == 0 and "Without the page" in log and "No airo-models" in log, log[-4000:]

    def in_workspace(*words):
        command = ["sh", "-c", '. install/setup.sh && exec "$@"', "sh", *words]
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60)

    variables = dict(line.split("=", 1) for line in in_workspace("env").stdout.splitlines() if "=" in line)
    prefix = tmp_path / "install/steadyhand"
    assert variables["AMENT_PREFIX_PATH"] == variables["CMAKE_PREFIX_PATH"] == str(prefix)
    # What ament's index and `ros2 launch` look for.
    for name in ("ament_index/resource_index/packages/steadyhand", "steadyhand/package.xml", "steadyhand/launch/steadyhand.launch.py",
                 "steadyhand/launch/demo.launch.py", "steadyhand/config/steadyhand_controllers.yaml"):  # fmt: skip
        assert (prefix / "share" / name).is_file(), name
    data = PROGRAM.parent / "share/steadyhand"
    (prefix / "share/steadyhand/packages").symlink_to(data / "packages")
    hand = str(data / "recordings/physics/demo-recording.json")
    done = in_workspace("steadyhand", "demo", "--arm", "ros2", "--yes", "--port", "0", "--no-browser", "--input", hand, "--set", "ros2.start_within=0.2")
    assert done.returncode == 2 and "no joint states" in done.stderr, done.stderr
