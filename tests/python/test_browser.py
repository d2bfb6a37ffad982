"""`steadyhand demo` opens a browser; what stands among its arguments every user of the machine can read."""

import os
import re
import signal
import stat
import subprocess
import time

from live_client import PROGRAM, Client, Demo


def put_in_place_of_the_browser(folder, monkeypatch, script):
    program = folder / "xdg-open"
    program.write_text("#!/bin/sh\n" + script)
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")
    monkeypatch.setenv("DISPLAY", ":7")


def wait_for(path):
    deadline = time.monotonic() + 30.0
    while not path.exists():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return path.read_text()


def test_the_address_that_is_opened_holds_no_code_and_pairs_its_user(tmp_path, monkeypatch):
    told = tmp_path / "arguments"
    put_in_place_of_the_browser(tmp_path, monkeypatch, f'echo "$@" > {told}.part && mv {told}.part {told}\n')
    demo = Demo(tmp_path / "sessions", browser=True)
    try:
        address = wait_for(told)
        assert demo.code() not in address
        host, port, word = re.match(r"http://([^:]+):(\d+)/#code=(\w+)$", address.strip()).groups()
        assert (host, int(port)) == ("127.0.0.1", demo.port)
        client = Client(demo.port)
        client.send(type="pair", code=word)
        client.wait_for("paired")
    finally:
        demo.end()


def test_the_browser_that_stays_keeps_neither_port_nor_recording_nor_output_nor_terminal(tmp_path, monkeypatch):
    told = tmp_path / "process"
    put_in_place_of_the_browser(tmp_path, monkeypatch, f"echo $$ > {told}.part && mv {told}.part {told}\nexec sleep 600\n")
    demo = Demo(tmp_path / "sessions", browser=True)
    browser = int(wait_for(told))
    try:
        time.sleep(0.5)  # until it is `sleep`
        files = {os.readlink(f"/proc/{browser}/fd/{number}") for number in os.listdir(f"/proc/{browser}/fd")}
        assert files == {"/dev/null"}
        assert os.getsid(browser) == browser
        demo.end()
        again = subprocess.run([PROGRAM, "demo", "--no-browser", "--port", str(demo.port), "--seconds", "1", "--sessions", str(tmp_path / "sessions")],
                               capture_output=True, text=True, timeout=60)
        assert again.returncode == 0, again.stderr
        os.kill(browser, 0)  # it was there all the time
    finally:
        demo.process.kill()
        os.kill(browser, signal.SIGKILL)
