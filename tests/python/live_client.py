"""A client of `steadyhand demo` over a real WebSocket (docs/reference/protocol.md), with nothing but the standard library."""

import base64
import json
import os
import re
import select
import signal
import socket
import struct
import subprocess
import threading
import time
from pathlib import Path

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))
PROGRAM = os.environ.get("STEADYHAND_PROGRAM", str(ROOT / "build/release/steadyhand"))


def run_soon(soon):
    """For benchmarks, where it is permitted: what a client waits for its turn between stamp and sending is not the program's latency."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO if soon else os.SCHED_OTHER, os.sched_param(20 if soon else 0))
    except PermissionError:
        pass


class Demo:
    """The program, with a page on a free port."""

    def __init__(self, folder, *arguments, browser=False, command=(PROGRAM, "demo"), environment=None):
        self.process = subprocess.Popen(
            [*command, *([] if browser else ["--no-browser"]), "--port", "0", "--sessions", str(folder), *map(str, arguments)],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
        self.lines, self.codes = [], []
        self.new_code = threading.Condition()
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()
        self.code()

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(line)
            found = re.match(r"open +http://[^:]+:(\d+)/#(?:\w+=)?(\w+)", line)
            if found:
                with self.new_code:
                    self.port = int(found.group(1))
                    self.codes.append(found.group(2))
                    self.new_code.notify_all()

    def code(self, after=None):
        """The newest pairing code; one that follows `after`."""
        with self.new_code:
            assert self.new_code.wait_for(lambda: self.codes and self.codes[-1] != after, 60.0), "".join(self.lines)
            return self.codes[-1]

    def client(self, pair=True):
        client, code = Client(self.port), None
        while pair:
            code = self.code(after=code)
            client.send(type="pair", code=code)
            # Another client may have used the code up; then the next one is on its way.
            answer = client.wait_for(("paired", "error"))
            if answer["type"] == "paired":
                client.token = answer["token"]
                break
        return client

    def end(self):
        """Ctrl-C; what the program printed."""
        self.process.send_signal(signal.SIGINT)
        code = self.process.wait(60.0)
        assert code == 0, self.process.stderr.read()
        self.reader.join(60.0)  # all that is in the pipe
        return "".join(self.lines)


class Client:
    def __init__(self, port, version=3):
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(
            f"GET /live HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
        self.token = None  # once it is paired
        self.pictures = []  # of cameras that it watches: when each came, and the message
        self.parts = b""  # a message in several frames
        self.buffer, self.state, self.closed, self.sequence = b"", None, False, 0
        self.echo = None  # from the newest pong: its now_s, when it came
        self.pinged = 0.0
        while b"\r\n\r\n" not in self.buffer:
            self.buffer += self._more()
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        assert b" 101 " in head.split(b"\r\n")[0], head
        self.send(type="hello", version=version)

    def _more(self):
        more = self.socket.recv(65536)
        if not more:
            raise ConnectionError("closed")
        return more

    def send(self, **message):
        payload = json.dumps(message).encode()
        mask = os.urandom(4)
        length = struct.pack("!B", 0x80 | len(payload)) if len(payload) < 126 else struct.pack("!BH", 0x80 | 126, len(payload))
        self.socket.sendall(b"\x81" + length + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload)))

    def messages(self, seconds=0.0):
        """What has come, waiting for at most so long."""
        if select.select([self.socket], [], [], seconds)[0]:
            try:
                self.buffer += self._more()
            except ConnectionError:
                self.closed = True
        found = []
        while len(self.buffer) >= 2:
            size, start = self.buffer[1] & 127, 2
            if size == 126:
                size, start = struct.unpack_from("!H", self.buffer, 2)[0] if len(self.buffer) >= 4 else 1 << 30, 4
            elif size == 127:
                size, start = struct.unpack_from("!Q", self.buffer, 2)[0] if len(self.buffer) >= 10 else 1 << 30, 10
            if len(self.buffer) < start + size:
                break
            final, opcode, payload = self.buffer[0] & 128, self.buffer[0] & 15, self.buffer[start:start + size]
            self.buffer = self.buffer[start + size:]
            if opcode == 8:
                self.closed = True
            elif opcode == 2:
                self.pictures.append((time.monotonic(), payload))
            elif opcode <= 1:
                self.parts += payload
                if not final:
                    continue
                came = time.monotonic()
                found.append(json.loads(self.parts))
                self.parts = b""
                if found[-1]["type"] == "state":
                    self.state = found[-1]
                if found[-1]["type"] == "pong":
                    self.echo = found[-1]["now_s"], came
        return found

    def ping(self):
        now = time.monotonic()
        self.send(type="ping", t_s=now, **({"echo_s": self.echo[0], "held_s": now - self.echo[1]} if self.echo else {}))

    def stay(self):
        """A ping now and then keeps connection and lease; one for each answer would exceed the rate, and what comes then is discarded."""
        if time.monotonic() > self.pinged + 0.1:
            self.pinged = time.monotonic()
            self.ping()

    def wait_for(self, kind, seconds=30.0, **members):
        """The first message of this type, or of one of these, with these members."""
        kinds = (kind,) if isinstance(kind, str) else kind
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline and not self.closed:
            for message in self.messages(0.05):
                if message["type"] in kinds and all(message.get(k) == v for k, v in members.items()):
                    return message
        raise AssertionError(f"no {kind} with {members}; closed: {self.closed}, last state: {self.state and self.state['state']}")

    def sample(self, p, clutch, **members):
        self.sequence += 1
        self.send(**({"type": "sample", "sequence": self.sequence, "t_s": time.monotonic(), "p": list(p), "q": [0, 0, 0, 1],
                      "clutch": clutch, "tracked": True, "emulated": False} | members))

    def move(self, path, seconds, clutch=True, rate=90.0, each=None):
        """Sends the hand path(t) for so long, at `rate`; `each` is called with every state that comes."""
        begin = time.monotonic()
        tick = 0
        while (t := time.monotonic() - begin) < seconds and not self.closed:
            self.sample(path(t), clutch)
            tick += 1
            while time.monotonic() < begin + tick / rate:
                for message in self.messages(max(0.0, begin + tick / rate - time.monotonic())):
                    if message["type"] == "state":
                        if each:
                            each(message)
                        self.ping()

    def grip(self, take=True):
        """Takes the lease, opens and closes the clutch; until the arm follows."""
        if take:
            self.send(type="take")
            self.wait_for("lease", yours=True)
        for _ in range(20):
            self.move(lambda t: (0, 0, 0), 0.3, clutch=False)
            engaged = []
            self.move(lambda t: (0, 0, 0), 0.5, each=lambda s: engaged.append(s["state"] == "engaged"))
            if any(engaged):
                return
        raise AssertionError(f"never engaged: {self.state and (self.state['state'], self.state['reason'])}")
