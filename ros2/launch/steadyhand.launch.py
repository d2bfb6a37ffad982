"""ur_robot_driver, and a joint trajectory controller for steadyhand beside its own. From Humble on.

    ros2 launch steadyhand steadyhand.launch.py ur_type:=ur5e robot_ip:=192.168.56.101

then, on this or any other computer of the network:

    steadyhand demo --arm ros2 --set ros2.controller=/steadyhand_controller

The driver's own controllers are loaded and stay inactive: two of them cannot control the same joints. docs/how-to/ros2.md has
all steps up to the first motion.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PARAMETERS = str(Path(__file__).resolve().parents[1] / "config/steadyhand_controllers.yaml")


def generate_launch_description():
    arguments = [
        DeclareLaunchArgument("ur_type", default_value="ur5e", description="Of the arm"),
        DeclareLaunchArgument("robot_ip", description="Address of the arm's controller"),
        DeclareLaunchArgument("tf_prefix", default_value="", description="Before the names of joints and frames"),
        DeclareLaunchArgument("launch_rviz", default_value="false", description="Show the arm"),
        DeclareLaunchArgument("parameters", default_value=PARAMETERS, description="Of the controller"),
    ]
    driver = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(
            PathJoinSubstitution([FindPackageShare("ur_robot_driver"), "launch", "ur_control.launch.py"])
        ),
        launch_arguments={
            "ur_type": LaunchConfiguration("ur_type"),
            "robot_ip": LaunchConfiguration("robot_ip"),
            "tf_prefix": LaunchConfiguration("tf_prefix"),
            "launch_rviz": LaunchConfiguration("launch_rviz"),
            "activate_joint_controller": "false",
        }.items(),
    )
    # The controller's type stands in its parameters: --controller-type went with Jazzy.
    controller = Node(
        package="controller_manager",
        executable="spawner",
        arguments=[
            "steadyhand_controller",
            "--param-file",
            LaunchConfiguration("parameters"),
            "--controller-manager-timeout",
            "60",
        ],
        output="screen",
    )
    return LaunchDescription([*arguments, driver, controller])
