"""A ROS 2 machine without ROS, in Python: Eclipse's own binding of DDS, and the messages as ros2-pyterfaces has them from
ROS's .msg files. Shares nothing with the program but the network."""

import os
import random
import re
import time

URI = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>50</MaxAutoParticipantIndex><Peers><Peer address='127.0.0.1'/></Peers></Discovery>"
    "</Domain></CycloneDDS>"
)
os.environ["CYCLONEDDS_URI"] = URI  # DDS reads it once


def any_domain():
    return random.randint(1, 100)


class Peer:
    def __init__(self, domain):
        from cyclonedds.domain import DomainParticipant

        self.participant = DomainParticipant(domain)
        self.topics = {}

    def topic(self, name, message):
        from cyclonedds.topic import Topic

        if name not in self.topics:
            # ROS's names on DDS: pkg/msg/Name is pkg::msg::dds_::Name_
            message.__idl__.populate()
            message.__idl__.idl_transformed_typename = re.sub(
                r"(\w+)/msg/(\w+)", r"\1::msg::dds_::\2_", message.__idl_typename__
            )
            self.topics[name] = Topic(self.participant, "rt" + name, message)
        return self.topics[name]

    def reader(self, name, message):
        from cyclonedds.core import Policy, Qos
        from cyclonedds.sub import DataReader
        from cyclonedds.util import duration

        # As rclcpp's default subscription: reliable, volatile, the last ten.
        qos = Qos(Policy.Reliability.Reliable(duration(milliseconds=100)), Policy.History.KeepLast(10))
        return DataReader(self.participant, self.topic(name, message), qos)

    def writer(self, name, message):
        from cyclonedds.core import Policy, Qos
        from cyclonedds.pub import DataWriter
        from cyclonedds.util import duration

        qos = Qos(Policy.Reliability.Reliable(duration(milliseconds=100)), Policy.History.KeepLast(10))
        return DataWriter(self.participant, self.topic(name, message), qos)


def take_until(reader, good=lambda message: True, seconds=40.0, meanwhile=lambda: None):
    """The first message that is good; None if none came."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for message in reader.take(50):
            if good(message):
                return message
        meanwhile()
        time.sleep(0.01)
    return None
