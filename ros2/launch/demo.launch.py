"""The program, for the arm behind a controller of ROS 2:

    ros2 launch steadyhand demo.launch.py options:="--yes --speed 0.25"

`options` are further options of `steadyhand demo`. Only --yes lets hardware move: there is no terminal to ask at.
"""

import shlex

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration

ARGUMENTS = {
    "controller": ("/steadyhand_controller", "Joint trajectory controller of the arm; the default is that of steadyhand.launch.py"),
    "robot": ("", "Name, robot file or URDF"),
    "profile": ("", "Name or file of a profile"),
    "port": ("", "Port of the page on this computer"),
    "options": ("", "Further options of `steadyhand demo`"),
}


def start(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    command = ["steadyhand", "demo", "--arm", "ros2", "--no-browser"]
    for name in ("robot", "profile", "port"):
        command += [f"--{name}", given[name]] if given[name] else []
    command += [*shlex.split(given["options"]), "--set", f"ros2.controller={given['controller']}"]
    return [ExecuteProcess(cmd=command, output="screen")]


def generate_launch_description():
    arguments = [DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in ARGUMENTS.items()]
    return LaunchDescription([*arguments, OpaqueFunction(function=start)])
