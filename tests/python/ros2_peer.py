"""A ROS 2 machine of rclpy, as a program of its own: rclpy wants its libraries found before Python starts. Shares nothing
with the tested program but the network. Talks to a test in lines of JSON.

    python ros2_peer.py echo                     every message of the program's, filled, to ros2_echo and back
    python ros2_peer.py world '{"hand": "/h"}'   an arm behind its controller, a hand, and an onlooker as RViz is
"""

import json
import math
import random
import struct
import sys
import threading
import time

import rclpy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

JOINTS = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
HOME = [0.4, -1.3, 1.6, 0.4, 0.4, 0.4]


def tell(**words):
    sys.stdout.write(json.dumps(words) + "\n")  # in one piece: more than one thread tells
    sys.stdout.flush()


def seconds(stamp):
    return stamp.sec + 1e-9 * stamp.nanosec


class World(Node):
    """Joint states name the joints in their own order, and a gripper; what is sent is executed as it is stamped."""

    def __init__(self, controller, joint_states, prefix="", hand="", speed_scaling=""):
        super().__init__("world")
        self.names = [f"{prefix}{name}_joint" for name in JOINTS]
        self.q = dict(zip(self.names, HOME))
        self.trajectory = None
        self.seen = {"trajectories": 0, "largest_speed": 0.0, "moved": 0.0, "faults": []}
        self.hand_since = None
        self.speed = None
        self.states = self.create_publisher(JointState, joint_states, qos_profile_sensor_data)
        self.hands = self.create_publisher(PoseStamped, hand or "/unused", 10)
        self.scaling = self.create_publisher(Float64, speed_scaling or "/unused_scaling", 10)
        self.create_subscription(JointTrajectory, f"{controller}/joint_trajectory", self.take, 10)
        self.create_subscription(PoseStamped, "/steadyhand/target", self.look_at_target, 10)
        self.create_subscription(Path, "/steadyhand/path", self.look_at_path, 10)
        self.create_subscription(MarkerArray, "/steadyhand/liquid", self.look_at_liquid, 10)
        self.controller = controller
        self.ticked = self.get_clock().now()
        self.create_timer(0.01, self.tick)
        self.create_timer(0.1, lambda: tell(**self.seen))

    def take(self, message):
        self.seen["trajectories"] += 1
        times = [seconds(p.time_from_start) for p in message.points]
        self.check("times increase", times == sorted(set(times)) and times)
        self.check("names", list(message.joint_names) == self.names)
        whole = all(len(p.positions) == len(p.velocities) == len(p.accelerations) == 6 for p in message.points)
        self.check("points", whole)
        self.check("ends at rest", not any(message.points[-1].velocities))
        if self.trajectory is None:
            self.seen["first_goal"] = list(message.points[-1].positions)
        self.trajectory = (seconds(message.header.stamp), times, message.points)

    def check(self, what, holds):
        if not holds and what not in self.seen["faults"]:
            self.seen["faults"].append(what)

    def tick(self):
        now = self.get_clock().now()
        since = max(1e-9 * (now - self.ticked).nanoseconds, 0.01)  # Python may be held, and then moves the arm late
        self.ticked = now
        for name, q in zip(self.names, self.set_point(1e-9 * now.nanoseconds)):
            self.seen["largest_speed"] = max(self.seen["largest_speed"], abs(q - self.q[name]) / since)
            self.q[name] = q
        self.seen["moved"] = max(abs(self.q[n] - q) for n, q in zip(self.names, HOME))
        order = self.names[3:] + ["gripper"] + self.names[:3]
        message = JointState(name=order, position=[self.q.get(n, 0.0) for n in order])
        message.header.stamp = now.to_msg()
        self.states.publish(message)
        if self.speed is not None:
            self.scaling.publish(Float64(data=self.speed))
        if self.hand_since is not None:
            self.wave(now)

    def set_point(self, now):
        if self.trajectory is None:
            return HOME
        begin, times, points = self.trajectory
        t = now - begin
        if t <= times[0]:
            return [self.q[name] for name in self.names]
        if t >= times[-1]:
            return list(points[-1].positions)
        k = max(i for i in range(len(times)) if times[i] <= t)
        a, b, T = points[k], points[k + 1], times[k + 1] - times[k]
        s = (t - times[k]) / T
        h = (1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2 * T, s * s * (3 - 2 * s), s * s * (s - 1) * T
        parts = zip(a.positions, a.velocities, b.positions, b.velocities)
        return [h[0] * q0 + h[1] * v0 + h[2] * q1 + h[3] * v1 for q0, v0, q1, v1 in parts]

    def wave(self, now):
        """Six centimetres, slowly, there and back."""
        pose = PoseStamped()
        pose.header.stamp = now.to_msg()
        pose.pose.position.x = 0.03 * (1.0 - math.cos(0.8 * (time.monotonic() - self.hand_since)))
        pose.pose.orientation.w = 1.0
        self.hands.publish(pose)

    def look_at_target(self, message):
        q = message.pose.orientation
        self.check("unit quaternion", math.isclose(q.x**2 + q.y**2 + q.z**2 + q.w**2, 1.0, abs_tol=1e-6))
        self.check("stamp", abs(seconds(message.header.stamp) - time.time()) < 60.0)
        self.seen["target"] = message.header.frame_id

    def look_at_path(self, message):
        if len(message.poses) > 1:
            self.seen["path"] = message.poses[0].header.frame_id

    def look_at_liquid(self, message):
        self.check("sizes", all(m.scale.x > 0.0 and m.color.a > 0.0 for m in message.markers))
        self.seen["liquid"] = [[m.ns, m.type, m.action] for m in message.markers]

    def obey(self, order):
        if "hand" in order:
            self.hand_since = time.monotonic() if order["hand"] else None
        self.speed = order.get("speed", self.speed)
        if "topics" in order:
            shown = [f"/steadyhand/{name}" for name in ("target", "path", "liquid")]
            tell(topics=[self.describe(topic) for topic in [f"{self.controller}/joint_trajectory", *shown]])

    def describe(self, topic):
        """As `ros2 topic info -v` does."""
        mine = self.get_name()
        others = [i for i in self.get_publishers_info_by_topic(topic) if i.node_name != mine]
        subscribed = [i for i in self.get_subscriptions_info_by_topic(topic) if i.node_name == mine]
        return {
            "topic": topic,
            "publishers": len(others),
            "types": [i.topic_type for i in others],
            "hashes": [str(i.topic_type_hash) for i in others],
            "expected": str(subscribed[0].topic_type_hash),
            "lifespans": [1e-9 * i.qos_profile.lifespan.nanoseconds for i in others],
        }


STRINGS = ["", "base_link", "tool0/\u00fc", "\u95a2\u7bc0 \u2713 \U0001f9be", 'say "hi"\n', "x" * 300]
WHOLE_NUMBERS = {"uint8": (0, 2**8 - 1), "int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1)}


def filled(kind, some, lengths):
    """A value of a field's type as ROS writes it, every field below it random, by the generator `some`."""
    if kind.startswith("sequence<"):
        inner = kind[len("sequence<") : -1]
        values = [filled(inner, some, lengths) for _ in range(some.choice(lengths))]
        return values
    extreme = some.random() < 0.2
    if kind in WHOLE_NUMBERS:
        return some.choice(WHOLE_NUMBERS[kind]) if extreme else some.randint(*WHOLE_NUMBERS[kind])
    if kind == "double":
        return some.choice([5e-324, -1.7976931348623157e308]) if extreme else some.gauss(0.0, 1e3)
    if kind == "float":
        return struct.unpack("f", struct.pack("f", some.gauss(0.0, 1e3)))[0]
    if kind == "boolean":
        return some.random() < 0.5
    if kind == "string":
        return some.choice(STRINGS)
    package, name = kind.split("/")
    message = getattr(__import__(f"{package}.msg", fromlist=[name]), name)()
    for field, inner in message.get_fields_and_field_types().items():
        setattr(message, field, filled(inner, some, lengths))
    return message


def echo():
    """Says which messages came back as they were, and which did not."""
    node = rclpy.create_node("echo")
    some = random.Random(7)
    for kind in [JointTrajectory, JointState, PoseStamped, Path, MarkerArray]:
        answers = []
        name = kind.__name__
        package = kind.__module__.split(".")[0]
        there = node.create_publisher(kind, f"/echo/in/{name}", 10)
        back = node.create_subscription(kind, f"/echo/out/{name}", answers.append, 10)
        samples = [kind(), *(filled(f"{package}/{name}", some, lengths) for lengths in ([1, 2, 3], [0, 1, 40]))]
        for index, sample in enumerate(samples):
            end = time.monotonic() + 20.0
            while time.monotonic() < end and sample not in answers:
                there.publish(sample)
                rclpy.spin_once(node, timeout_sec=0.02)
            tell(message=name, sample=index, same=sample in answers)
        node.destroy_publisher(there)
        node.destroy_subscription(back)
    node.destroy_node()


def main():
    rclpy.init()
    if sys.argv[1] == "echo":
        echo()
        return
    world = World(**json.loads(sys.argv[2]))

    def listen():
        for line in sys.stdin:
            world.obey(json.loads(line))
        rclpy.try_shutdown()

    threading.Thread(target=listen, daemon=True).start()
    try:
        rclpy.spin(world)
    except rclpy.executors.ExternalShutdownException:
        pass


if __name__ == "__main__":
    main()
