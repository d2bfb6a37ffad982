"""`steadyhand demo` opens a browser; what stands among its arguments every user of the machine can read."""

import os
import re
import stat
import time

from live_client import Client, Demo


def test_the_address_that_is_opened_holds_no_code_and_pairs_its_user(tmp_path, monkeypatch):
    told = tmp_path / "arguments"
    program = tmp_path / "xdg-open"
    program.write_text(f'#!/bin/sh\necho "$@" > {told}.part && mv {told}.part {told}\n')
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    monkeypatch.setenv("DISPLAY", ":7")
    demo = Demo(tmp_path / "sessions", browser=True)
    try:
        deadline = time.monotonic() + 30.0
        while not told.exists():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        address = told.read_text()
        assert demo.code() not in address
        host, port, word = re.match(r"http://([^:]+):(\d+)/#code=(\w+)$", address.strip()).groups()
        assert (host, int(port)) == ("127.0.0.1", demo.port)
        client = Client(demo.port)
        client.send(type="pair", code=word)
        client.wait_for("paired")
    finally:
        demo.end()
