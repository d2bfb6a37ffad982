"""A ROS 2 machine without ROS, in Python: Eclipse's own binding of DDS, and the messages as ros2-pyterfaces has them from
ROS's .msg files. Shares nothing with the program but the network."""

import dataclasses
import math
import os
import random
import re
import struct
import time
import typing

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


STRINGS = ["", "base_link", "tool0/\u00fc", "\u95a2\u7bc0 \u2713 \U0001f9be", 'say "hi"\n', "x" * 300]
WHOLE_NUMBERS = {"uint8": (0, 2**8 - 1), "int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1)}


def filled(kind, some, lengths):
    """A value of a field's type, every field below it random, by the generator `some`.

    lengths: of sequences, to choose from"""
    metadata = typing.get_args(kind)[1:] if typing.get_origin(kind) is typing.Annotated else ()
    for entry in metadata:
        if hasattr(entry, "subtype"):
            return [filled(entry.subtype, some, lengths) for _ in range(some.choice(lengths))]
        extreme = some.random() < 0.2
        if entry in WHOLE_NUMBERS:
            return some.choice(WHOLE_NUMBERS[entry]) if extreme else some.randint(*WHOLE_NUMBERS[entry])
        if entry == "float64":
            return some.choice([5e-324, -1.7976931348623157e308, math.inf]) if extreme else some.gauss(0.0, 1e3)
        if entry == "float32":
            return struct.unpack("f", struct.pack("f", some.gauss(0.0, 1e3)))[0]
    if kind is bool:
        return some.random() < 0.5
    if kind is str:
        return some.choice(STRINGS)
    hints = typing.get_type_hints(kind, include_extras=True)
    return kind(**{f.name: filled(hints[f.name], some, lengths) for f in dataclasses.fields(kind)})


def differences(a, b, where=""):
    """The fields in which two messages differ, with both values."""
    if dataclasses.is_dataclass(a):
        fields = [f.name for f in dataclasses.fields(a)]
        return [d for name in fields for d in differences(getattr(a, name), getattr(b, name), f"{where}.{name}")]
    if isinstance(a, list):
        if len(a) != len(b):
            return [f"{where}: {len(a)} elements, {len(b)}"]
        return [d for i, pair in enumerate(zip(a, b)) for d in differences(*pair, f"{where}[{i}]")]
    return [] if a == b else [f"{where}: {a!r}, {b!r}"]
