"""A checkpoint of LeRobot's ACT controls the arm in turns with a person, in a simulated task. Needs lerobot 0.4.4 (docs/how-to/policies.md).

    PYTHONPATH=build/release/python python -m steadyhand.policies examples/lerobot_act.py:Act CHECKPOINT DATASET

CHECKPOINT: the folder `pretrained_model` that lerobot-train wrote. DATASET: the folder it was trained on, made with `--action pose`.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import torch
from lerobot.policies.act.modeling_act import ACTPolicy
from lerobot.policies.factory import make_pre_post_processors

from steadyhand import pose, quat_xyzw
from steadyhand.policies import Action, Observation

TOOL = [f"tool.{name}" for name in ("x", "y", "z", "qx", "qy", "qz", "qw")]


class Act:
    """What lerobot-train made of a data set without pictures."""

    def __init__(self, checkpoint: str, dataset: str, device: str = "cuda" if torch.cuda.is_available() else "cpu") -> None:
        info = json.loads((Path(dataset) / "meta/info.json").read_text(encoding="utf-8"))
        self.period = 1.0 / info["fps"]
        self.names = {name: feature["names"] for name, feature in info["features"].items()}
        if self.names["action"][:7] != TOOL:
            raise ValueError(f"{dataset}: its actions are no poses of the tool; make it with --action pose")
        self.policy = ACTPolicy.from_pretrained(checkpoint).to(device)
        if self.policy.config.image_features:
            raise ValueError(f"{checkpoint} wants pictures, which policies do not get from this program; train without")
        self.wants = list(self.policy.config.input_features)
        self.before, self.after = make_pre_post_processors(self.policy.config, checkpoint, preprocessor_overrides={"device_processor": {"device": device}})
        self.quaternions: dict[str, np.ndarray] = {}

    def row(self, name: str, T: np.ndarray) -> np.ndarray:
        """As data sets have a pose, whose quaternion does not change its sign from one frame to the next."""
        quaternion = quat_xyzw(T)
        if quaternion @ self.quaternions.get(name, quaternion) < 0.0:
            quaternion = -quaternion
        self.quaternions[name] = quaternion
        return np.hstack([T[:3, 3], quaternion])

    def act(self, seen: Observation) -> Action:
        if seen.leader != "policy":  # what was planned before its turn is out of date, as are signs
            self.policy.reset()
            self.quaternions.clear()
        things = dict.fromkeys(name.rpartition(".")[0] for name in self.names["observation.environment_state"])
        if missing := [thing for thing in things if thing not in seen.things]:
            raise ValueError(f"the task has no {', '.join(missing)}: this policy was trained in another")
        rows = {
            "observation.state": np.hstack([seen.q, seen.dq, [] if seen.gripper is None else [seen.gripper]]),
            "observation.tool": self.row("tool", seen.T_base_tool),
            "observation.environment_state": np.hstack([self.row(thing, seen.things[thing]) for thing in things]),
        }
        with torch.inference_mode():
            batch = self.before({name: torch.from_numpy(rows[name].astype(np.float32)) for name in self.wants})
            action = self.after(self.policy.select_action(batch)).squeeze(0).cpu().numpy().astype(float)
        length = np.linalg.norm(action[3:7])
        T = pose(action[:3], action[3:7] / length) if length > 1e-6 else np.full((4, 4), np.nan)  # which holds the arm
        return Action(T, float(action[7]) if len(action) > 7 else None)
