"""A gripper behind an action server of rclpy, as a program of its own: the newest goal takes the place of the one before,
as gripper controllers do it. Takes orders, and tells a test what it does, in lines of JSON.

    python ros2_gripper_peer.py /gripper_controller/gripper_cmd GripperCommand
"""

import json
import sys
import threading
import time

import rclpy
from control_msgs import action as actions
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState

TURN = 0.02  # s


class Gripper(Node):
    def __init__(self, action, kind):
        super().__init__("gripper")
        self.kind = getattr(actions, kind)
        self.is_parallel = kind != "GripperCommand"  # then goals and answers are states of joints
        self.action = action
        self.position = 0.0
        self.newest = None
        self.rejects = self.gives_up = False
        self.speed = 1.0  # its position's change in a second
        self.object_at = None  # no further than there
        self.goals, self.ends = [], []
        group = ReentrantCallbackGroup()
        self.server = ActionServer(
            self, self.kind, action, execute_callback=self.execute, goal_callback=self.decide,
            cancel_callback=lambda _: CancelResponse.ACCEPT, callback_group=group,
        )
        self.create_timer(0.1, self.tell, callback_group=group)

    def tell(self, **words):
        words = words or {"position": self.position, "speed": self.speed, "goals": self.goals, "ends": self.ends}
        sys.stdout.write(json.dumps(words) + "\n")  # in one piece: more than one thread tells
        sys.stdout.flush()

    def decide(self, goal):
        if self.rejects:
            return GoalResponse.REJECT
        command = goal.command
        self.goals.append([*command.position, *command.effort, *command.name] if self.is_parallel else [command.position, command.max_effort])
        return GoalResponse.ACCEPT

    def execute(self, handle):
        self.newest = handle
        goal = handle.request.command.position[0] if self.is_parallel else handle.request.command.position
        stalled = False
        while True:
            result = self.kind.Result(**self.where(), stalled=stalled, reached_goal=self.position == goal)
            if self.newest is not handle:
                return self.end(handle.abort, "replaced", result)
            if handle.is_cancel_requested:
                return self.end(handle.canceled, "cancelled", result)
            if self.gives_up or stalled:
                return self.end(handle.abort, "stalled" if stalled else "given up", result)
            if result.reached_goal:
                return self.end(handle.succeed, "reached", result)
            step = max(-self.speed * TURN, min(self.speed * TURN, goal - self.position))
            self.position += step
            if self.object_at is not None and self.position > self.object_at:
                self.position, stalled = self.object_at, True
            handle.publish_feedback(self.kind.Feedback(**self.where()))
            time.sleep(TURN)

    def where(self):
        return {"state": JointState(name=["fingers"], position=[self.position])} if self.is_parallel else {"position": self.position}

    def end(self, how, why, result):
        self.ends.append(why)
        how()
        return result

    def obey(self, order):
        self.rejects = order.get("rejects", self.rejects)
        self.gives_up = order.get("gives_up", self.gives_up)
        self.object_at = order.get("object_at", self.object_at)
        self.speed = order.get("speed", self.speed)
        if "topics" in order:
            self.tell(topics=[self.describe(kind, name) for kind, name in order["topics"]])

    def describe(self, kind, topic):
        """Whether others' types at this topic are ours, by their hashes."""
        find = self.get_publishers_info_by_topic if kind == "publishes" else self.get_subscriptions_info_by_topic
        mine = self.get_subscriptions_info_by_topic if kind == "publishes" else self.get_publishers_info_by_topic
        name = self.get_name()
        others = [i for i in find(topic, no_mangle=True) if i.node_name != name]
        own = [i for i in mine(topic, no_mangle=True) if i.node_name == name]
        return {
            "topic": topic,
            "types": [i.topic_type for i in others],
            "hashes": [str(i.topic_type_hash) for i in others],
            "expected_types": [i.topic_type for i in own],
            "expected": [str(i.topic_type_hash) for i in own],
        }


def main():
    rclpy.init()
    gripper = Gripper(*sys.argv[1:])

    def listen():
        for line in sys.stdin:
            gripper.obey(json.loads(line))
        rclpy.try_shutdown()

    threading.Thread(target=listen, daemon=True).start()
    executor = MultiThreadedExecutor(num_threads=6)
    executor.add_node(gripper)
    try:
        executor.spin()
    except ExternalShutdownException:
        pass


if __name__ == "__main__":
    main()
