"""A client of the program's page protocol (docs/reference/protocol.md): a WebSocket over loopback, with the standard library alone."""

from __future__ import annotations

import base64
import json
import os
import select
import socket
import struct
import time
from collections.abc import Iterator
from typing import Any

PROTOCOL_VERSION = 3
PING_EVERY = 0.3  # s


class Lost(ConnectionError):
    """The program has gone, or does not answer."""


class PageClient:
    """Raises Lost where the connection ends."""

    def __init__(self, port: int, timeout: float = 60.0) -> None:
        self._buffer, self._parts, self._pinged = b"", b"", 0.0
        try:
            self._socket = socket.create_connection(("127.0.0.1", port), timeout)
            key = base64.b64encode(os.urandom(16)).decode()
            self._socket.sendall(
                f"GET /live HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
            )
            while b"\r\n\r\n" not in self._buffer:
                self._more()
        except OSError as error:
            raise Lost(f"no steadyhand answers on port {port}: {error}") from None
        head, self._buffer = self._buffer.split(b"\r\n\r\n", 1)
        if b" 101 " not in head.split(b"\r\n")[0]:
            raise Lost(f"what answers on port {port} is no steadyhand: {head[:60]!r}")
        self.send(type="hello", version=PROTOCOL_VERSION)
        self.send(type="pair", code="local")

    def close(self) -> None:
        self._socket.close()

    def send(self, **message: Any) -> None:
        self._frame(1, json.dumps(message).encode())

    def _frame(self, opcode: int, payload: bytes) -> None:
        mask = os.urandom(4)
        size = struct.pack("!B", 0x80 | len(payload)) if len(payload) < 126 else struct.pack("!BH", 0x80 | 126, len(payload))
        try:
            self._socket.sendall(bytes([0x80 | opcode]) + size + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload)))
        except OSError as error:
            raise Lost(f"steadyhand has gone: {error}") from None

    def _more(self) -> None:
        try:
            more = self._socket.recv(65536)
        except OSError as error:
            raise Lost(f"steadyhand has gone: {error}") from None
        if not more:
            raise Lost("steadyhand has gone")
        self._buffer += more

    def messages(self, seconds: float) -> Iterator[dict[str, Any]]:
        """What has come, waiting for at most so long; keeps the connection."""
        if time.monotonic() > self._pinged + PING_EVERY:
            self._pinged = time.monotonic()
            self.send(type="ping", t_s=self._pinged)
        if select.select([self._socket], [], [], seconds)[0]:
            self._more()
        while (frame := self._next()) is not None:
            opcode, final, payload = frame
            if opcode == 8:
                raise Lost("steadyhand closed the connection")
            if opcode == 9:
                self._frame(10, payload)
            elif opcode <= 1:
                self._parts += payload
                if final:
                    text, self._parts = self._parts, b""
                    yield json.loads(text)

    def _next(self) -> tuple[int, bool, bytes] | None:
        data = self._buffer
        if len(data) < 2:
            return None
        size, start = data[1] & 127, 2
        if size == 126:
            if len(data) < 4:
                return None
            size, start = struct.unpack_from("!H", data, 2)[0], 4
        elif size == 127:
            if len(data) < 10:
                return None
            size, start = struct.unpack_from("!Q", data, 2)[0], 10
        if len(data) < start + size:
            return None
        self._buffer = data[start + size :]
        return data[0] & 15, bool(data[0] & 128), data[start : start + size]
