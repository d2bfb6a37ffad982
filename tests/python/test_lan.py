"""`steadyhand demo --lan` from outside: TLS with a certificate of its own that stays, its fingerprint, pairing with the
printed code over a real WebSocket, and what strangers are refused."""

import base64
import hashlib
import http.client
import json
import os
import re
import signal
import socket
import ssl
import stat
import struct
import subprocess
import threading

import pytest

from places import PROGRAM


def has_network():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing; fails without a route
        except OSError:
            return False
    return True


needs_network = pytest.mark.skipif(not has_network(), reason="this machine is in no network")


class Demo:
    """A program that serves the local network until the end of the `with`."""

    def __init__(self, folder):
        environment = os.environ | {"XDG_STATE_HOME": str(folder / "state")}
        command = [PROGRAM, "demo", "--lan", "--port", "0", "--set", "server.lan_port=0", "--no-browser", "--no-recording"]
        self.process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.text, self.told = "", threading.Condition()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            with self.told:
                self.text += line
                self.told.notify_all()

    def wait_for(self, pattern, count=1):
        with self.told:
            assert self.told.wait_for(lambda: len(re.findall(pattern, self.text)) >= count, timeout=60), self.text
            return re.findall(pattern, self.text)[count - 1]

    def __enter__(self):
        self.fingerprint = self.wait_for(r"fingerprint: (\S+)")
        host, port, self.code = self.wait_for(r"https://([^:/]+):(\d+)/#code=(\w+)")
        self.host, self.port = host, int(port)
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        self.process.wait(timeout=60)

    def get_plain(self, host):
        """The status of loopback's port, asked under this name."""
        port = int(self.wait_for(r"http://127\.0\.0\.1:(\d+)/"))
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
        connection.request("GET", "/", headers={"Host": f"{host}:{port}"})
        return connection.getresponse().status

    def connect(self):
        """Any certificate will do; the caller looks at it."""
        context = ssl.create_default_context()
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        return context.wrap_socket(socket.create_connection((self.host, self.port), timeout=30))

    def get(self, path="/", host=None):
        with self.connect() as stream:
            stream.sendall(f"GET {path} HTTP/1.1\r\nHost: {host or self.host}:{self.port}\r\nConnection: close\r\n\r\n".encode())
            response = http.client.HTTPResponse(stream)
            response.begin()
            return response.status, response.read(), stream.getpeercert(binary_form=True)


class WebSocket:
    def __init__(self, demo, origin):
        self.stream = demo.connect()
        key = base64.b64encode(os.urandom(16)).decode()
        self.stream.sendall(
            f"GET /live HTTP/1.1\r\nHost: {demo.host}:{demo.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\nOrigin: {origin}\r\n\r\n".encode())
        self.file = self.stream.makefile("rb")
        self.status = int(self.file.readline().split()[1])
        while self.file.readline() not in (b"\r\n", b""):
            pass

    def say(self, message):
        body, mask = json.dumps(message).encode(), os.urandom(4)
        assert len(body) < 126
        self.stream.sendall(bytes([0x81, 0x80 | len(body)]) + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(body)))

    def hear(self, kind):
        body = b""
        while True:
            first, length = self.file.read(2)
            if length in (126, 127):
                length = struct.unpack(">H" if length == 126 else ">Q", self.file.read(2 if length == 126 else 8))[0]
            part = self.file.read(length)
            if first & 15 > 1:  # ping, close
                continue
            body += part
            if not first & 128:  # continued in the next frame
                continue
            message, body = json.loads(body), b""
            if message["type"] == kind:
                return message

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()
        self.stream.close()


@needs_network
def test_serves_the_network_over_tls_to_who_knows_the_code(tmp_path):
    with Demo(tmp_path) as demo:
        status, body, certificate = demo.get()
        assert status == 200 and body
        digest = hashlib.sha256(certificate).hexdigest().upper()
        assert demo.fingerprint == ":".join(digest[i : i + 2] for i in range(0, 64, 2))
        assert "█" in demo.text or "▀" in demo.text, "a QR code"
        kept = tmp_path / "state/steadyhand/server.pem"
        assert stat.S_IMODE(kept.stat().st_mode) == 0o600
        assert demo.get(host="elsewhere.example")[0] == 421, "a name that is not this machine's"
        name = socket.gethostname()
        assert demo.get(host=name)[0] == demo.get(host=f"{name}.local")[0] == 200
        assert demo.get_plain("localhost") == 200
        # Another machine could claim a name on the network and point it here, and `local` would pair the page.
        assert {demo.get_plain(host) for host in (name, f"{name}.local", demo.host)} == {421}
        status, body, _ = demo.get("/sessions")
        assert status == 401 and b"paired" in body

        with WebSocket(demo, "https://elsewhere.example") as stranger:
            assert stranger.status == 403
        own = f"https://{demo.host}:{demo.port}"
        with WebSocket(demo, own) as client, WebSocket(demo, own) as other:
            assert client.status == other.status == 101
            for one in (client, other):
                one.say({"type": "hello", "version": 3})
                one.hear("welcome")
            client.say({"type": "take"})
            assert client.hear("error")["code"] == "unpaired"
            client.say({"type": "pair", "code": demo.code})
            assert client.hear("paired")["token"]
            rows = demo.text.count("\x1b[38;2")
            client.say({"type": "take"})
            while not client.hear("lease")["yours"]:
                pass
            demo.wait_for(r"\x1b\[38;2", count=2 * rows)  # the next code as a QR code, too
            demo.wait_for(r"https://\S+#code=(\w+)", count=2)
            other.say({"type": "pair", "code": demo.code})
            refusal = other.hear("error")
            assert refusal["code"] == "code" and "used up" in refusal["message"], "one who commanded used it up"
            assert isinstance(client.hear("state")["q"], list)
    with Demo(tmp_path) as demo:
        assert hashlib.sha256(demo.get()[2]).hexdigest().upper() == digest, "the certificate stays"


@needs_network
def test_refuses_a_key_that_others_may_read(tmp_path):
    with Demo(tmp_path):
        pass
    kept = tmp_path / "state/steadyhand/server.pem"
    kept.chmod(0o644)
    done = subprocess.run([PROGRAM, "demo", "--lan", "--port", "0", "--set", "server.lan_port=0", "--no-browser", "--no-recording"],
                          env=os.environ | {"XDG_STATE_HOME": str(tmp_path / "state")}, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and "server.pem" in done.stderr, done.stderr
