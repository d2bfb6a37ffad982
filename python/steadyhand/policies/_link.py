"""A connection to the running program on a thread of its own, for loops that must not wait for it."""

from __future__ import annotations

import threading
import time
from typing import Any

from .._page_client import PageClient
from ._live import _observation, _target
from ._policy import Action, Observation

_NEWS = 1.0  # s without a state after which the connection counts as lost


class Link:
    """The newest observation of the program on this machine, and a way to say targets. Any thread.

    policy: its name, if what is said by send() may lead; period: s, from one action to the next.
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
                raise ConnectionError(self._error or "steadyhand says nothing")
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
        """The program is there and goes on telling."""
        return self._thread.is_alive() and time.monotonic() - self._heard < _NEWS

    @property
    def state(self) -> dict[str, Any]:
        """The newest, as docs/reference/protocol.md has it. Raises ConnectionError where there is none any more."""
        if not self.alive or self._state is None:
            raise ConnectionError(self._error or "steadyhand says nothing any more")
        return self._state

    def observe(self) -> Observation:
        """The newest. Raises as state."""
        return _observation(self.state, self._things)

    def act(self, action: Action) -> None:
        """Says where the tool is to be, of what was seen newest. It is done in the policy's turn only."""
        message = _target(action, self.state["now_s"])
        with self._lock:
            self._client.send(**message)

    def take_turn(self) -> None:
        """Takes the arm, if nobody has it, and gives the policy its turn."""
        with self._lock:
            self._client.send(type="take")
            self._client.send(type="request", kind="policy", value=1)

    def end_turn(self) -> None:
        """Ends it, where this program gave it."""
        with self._lock:
            self._client.send(type="request", kind="policy", value=0)

    def close(self) -> None:
        """The turn ends with the connection."""
        self._ends = True
        self._thread.join(1.0)
        self._client.close()
