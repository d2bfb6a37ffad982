"""A client whose messages meet what networks do to them, and that never waits for the program."""

import json
import os
import struct
import time

from live_client import Client


class Network:
    """Faults of one client's way to the program, any of them for a while."""

    def __init__(self):
        self.loss = 0.0  # share of samples that are lost
        self.reorder = 0.0  # share that changes places with its neighbour
        self.stall_until = 0.0  # everything waits, then comes in a burst
        self.clock = 0.0  # s, that the client's clock was set by


class FaultyClient(Client):
    """Logs what it wrote, when it had written it."""

    def __init__(self, port, log, name, random, token=None):
        self.log, self.name, self.random, self.network = log, name, random, Network()
        self.waiting, self.unsent, self.number, self.holds = [], b"", None, False
        self.token, self.pairs, self.deaf, self.gone = token, token is not None, False, False
        super().__init__(port)
        self.socket.setblocking(False)

    def send(self, **message):
        if not hasattr(self, "socket") or self.gone:
            return
        network = self.network
        if message["type"] == "hello" and self.token:
            message["token"] = self.token
        if message["type"] == "sample":
            if self.random.random() < network.loss:
                return
            message["t_s"] += network.clock
        if message["type"] == "ping":
            message["t_s"] += network.clock
        self.waiting.append(message)
        if message["type"] == "sample" and len(self.waiting) > 1 and self.random.random() < network.reorder:
            if self.waiting[-2]["type"] == "sample":
                self.waiting[-2:] = self.waiting[:-3:-1]
            return  # what it changed places with follows
        self.flush()

    def flush(self):
        """Writes what is due, as far as the socket takes it."""
        if self.gone or time.monotonic() < self.network.stall_until:
            return
        while self.waiting or self.unsent:
            if self.unsent:
                try:
                    self.unsent = self.unsent[self.socket.send(self.unsent):]
                except BlockingIOError:
                    return
                except OSError:
                    return self.leave()
                continue
            message = self.waiting.pop(0)
            self.note(message)
            self.unsent = frame(json.dumps(message).encode())

    def note(self, message):
        kind = message["type"]
        if kind == "sample":
            self.log("sample", client=self.name, clutch=message["clutch"])
        elif kind == "request":
            self.log("request", client=self.name, request=message["kind"], text=message.get("text"), value=message.get("value"))
        elif kind == "pair":
            self.pairs = True
        elif kind in ("take", "ask", "release"):
            self.log("give" if kind == "release" else "take", client=self.name, paired=self.pairs)

    def raw(self, data):
        """Bytes that are no message of ours."""
        self.unsent += data
        self.flush()

    def listen(self):
        """What came; the lease is noted."""
        if self.gone or self.deaf:
            return []
        try:
            messages = self.messages()
        except OSError:
            self.leave()
            return []
        for message in messages:
            if message["type"] == "lease":
                self.holds = message["yours"]
                if self.holds:
                    self.log("lease", client=self.name, holder=message["holder"])
            elif message["type"] == "welcome":
                self.number = message["client"]
            elif message["type"] == "paired":
                self.token = message["token"]
        if self.closed:
            self.leave()
        return messages

    def leave(self):
        if not self.gone:
            self.gone, self.holds = True, False
            self.log("gone", client=self.name)
            self.socket.close()


def frame(payload, opcode=1, final=True):
    """A masked WebSocket frame."""
    mask = os.urandom(4)
    size = len(payload)
    head = bytes([(128 if final else 0) | opcode])
    head += bytes([128 | size]) if size < 126 else struct.pack("!BH", 254, size) if size < 65536 else struct.pack("!BQ", 255, size)
    return head + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload))
