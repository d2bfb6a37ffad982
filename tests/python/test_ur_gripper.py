"""The gripper of a UR: from a sample of the page to a server that speaks as Robotiq's URCap does, and back."""

import contextlib
import socketserver
import subprocess
import threading
import time

from live_client import PROGRAM, Demo
from test_fake_ur_controller import controller

PATIENCE = 60.0  # s


class Fingers(socketserver.StreamRequestHandler):
    def handle(self):
        values = self.server.values
        for line in self.rfile:
            word, name, *value = line.decode().split()
            if word == "SET":
                values["POS" if name == "POS" else name] = int(value[0])
                self.wfile.write(b"ack\n")
            else:
                self.wfile.write(f"{name} {values[name]}\n".encode())


@contextlib.contextmanager
def urcap(address, **values):
    server = socketserver.ThreadingTCPServer((address, 0), Fingers)
    server.daemon_threads = True
    server.values = {"STA": 3, "FLT": 0, "POS": 3, **values}
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()


def words(address, port):
    return ["--arm", "ur", "--host", address, "--robot", "ur5e_gripper", "--gripper-port", str(port), "--yes", "--no-recording"]


def test_the_operator_closes_and_opens_it(tmp_path):
    with controller("--robot", "ur5e_gripper") as (address, _), urcap(address) as server:
        demo = Demo(tmp_path, *words(address, server.server_address[1]))
        client = demo.client()
        client.send(type="take")

        def shown():
            return (client.state["tools"][0]["gripper"] if client.state else None) or 0.0

        def reaches(wish, position):
            deadline = time.monotonic() + PATIENCE
            while abs(shown() - wish) > 0.01 or server.values["POS"] != position:
                assert time.monotonic() < deadline, (client.state, server.values)
                client.sample((0, 0, 0), clutch=False, gripper=wish)
                client.messages(0.02)

        reaches(1.0, 255)
        assert server.values["SPE"] == 255 and server.values["FOR"] == 51 and server.values["GTO"] == 1
        reaches(0.0, 0)
        demo.end()
        assert server.values["POS"] == 0


def test_one_that_is_not_there_or_not_ready_is_told_before_anything_moves(tmp_path):
    def refusal(address, port):
        done = subprocess.run([PROGRAM, "demo", "--no-browser", "--port", "0", *words(address, port)], capture_output=True, text=True, timeout=PATIENCE)
        assert done.returncode == 2, done.stdout + done.stderr
        return done.stderr

    with controller("--robot", "ur5e_gripper") as (address, _):
        with urcap(address, STA=0) as server:
            told = refusal(address, server.server_address[1])
            assert "not activated" in told and "at the pendant" in told
            port = server.server_address[1]
        told = refusal(address, port)
        assert f"{address}:{port} does not answer" in told and "--gripper-port 0" in told
