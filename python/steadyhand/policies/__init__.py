"""Policies that control the arm in turns with a person: in this process in virtual time, or with a live session (docs/how-to/policies.md)."""

from ._link import Link
from ._live import lead
from ._policy import Action, Observation, Policy
from ._simulation import Outcome, Simulation

__all__ = ["Action", "Link", "Observation", "Outcome", "Policy", "Simulation", "lead"]
