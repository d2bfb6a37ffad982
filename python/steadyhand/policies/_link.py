"""A connection to a live session, with its own thread, for loops that must not wait for it."""

from __future__ import annotations

import threading
import time
from typing import Any

from .._page_client import PageClient
from ._live import _observation, _targets
from ._policy import Action, Observation

_NEWS = 1.0  # s without a state after which the connection counts as lost


class Link:
    """The newest observation of the session on this machine, and a way to send targets. Any thread.

    policy: its name, if act() may control the arm; period: s, from one action to the next.
    """

    def __init__(self, port: int = 8642, *, policy: str = "", period: float = 1 / 30, patience: float = 10.0) -> None:
        self._client = PageClient(port)
        self._lock = threading.Lock()
        self._state: dict[str, Any] | None = None
        self._things: list[str] = []
        self._heard, self._ends, self._error = time.monotonic(), False, ""
        if policy:
            self._client.send(type="policy", name=policy, period_s=period)
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()
        deadline = time.monotonic() + patience
        while self._state is None:
            if not self._thread.is_alive() or time.monotonic() > deadline:
                self.close()
                raise ConnectionError(self._error or "steadyhand sends nothing")
            time.sleep(0.005)

    def _listen(self) -> None:
        try:
            while not self._ends:
                with self._lock:
                    messages = list(self._client.messages(0.005))
                for message in messages:
                    if message["type"] == "welcome":
                        self._things = message["task"]["things"] if message["task"] else []
                    elif message["type"] == "state":
                        self._state, self._heard = message, time.monotonic()
                    elif message["type"] == "error":
                        self._error = message["message"]
                time.sleep(0.002)
        except ConnectionError as error:
            self._error = str(error)

    @property
    def alive(self) -> bool:
        """Whether the program still sends states."""
        return self._thread.is_alive() and time.monotonic() - self._heard < _NEWS

    @property
    def state(self) -> dict[str, Any]:
        """The newest state message (docs/reference/protocol.md). Raises ConnectionError when the program sends no more."""
        if not self.alive or self._state is None:
            raise ConnectionError(self._error or "steadyhand has stopped sending")
        return self._state

    def observe(self) -> Observation:
        """The newest observation. Raises ConnectionError like state."""
        return _observation(self.state, self._things)

    def act(self, action: Action) -> None:
        """Sends a target for each tool, for the newest state. The arm follows it only in the policy's turn."""
        messages = _targets(action, self.state["now_s"])
        with self._lock:
            for message in messages:
                self._client.send(**message)

    def take_turn(self) -> None:
        """Takes control, if no client has it, and gives the policy its turn."""
        with self._lock:
            self._client.send(type="take")
            self._client.send(type="request", kind="policy", value=1)

    def end_turn(self) -> None:
        """Ends the turn, if this program gave it."""
        with self._lock:
            self._client.send(type="request", kind="policy", value=0)

    def close(self) -> None:
        """Closes the connection, which ends the turn."""
        self._ends = True
        self._thread.join(1.0)
        self._client.close()
