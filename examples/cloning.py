"""Behaviour cloning of a task, and DAgger: a small network in numpy that leads the arm in turns with the scripted operator.

    ./steadyhand python examples/cloning.py clone --task stack --out cloned.npz          # 50 episodes of the scripted operator
    ./steadyhand python examples/cloning.py evaluate cloned.npz                          # success over 200 seeds
    ./steadyhand python examples/cloning.py dagger cloned.npz --out better.npz           # the operator takes over where it errs
    ./steadyhand python examples/cloning.py evaluate better.npz
    ./steadyhand policy examples/cloning.py:Cloned better.npz                            # beside `./steadyhand demo`

docs/how-to/policies.md says what came of it.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import sys
import time
from dataclasses import dataclass

import numpy as np

from steadyhand.policies import Action, Observation, Simulation

PERIOD = 0.1  # s, of the policy
AHEAD = 0.3  # s: the network says where the tool is to be then
PACE = 0.5  # share of the way there that an action asks for: the tool is some 60 ms behind its target
DEMONSTRATIONS, TAKEOVERS, JUDGED = 1, 100_001, 1_000_001  # first seeds of each kind
STALL, STALL_WAY = 2.0, 0.004  # s in which the tool goes less far, m: the operator takes over
LONG = 20.0  # s after which it takes over, too
LEADS = 5.0  # s that it leads then
KNOWN = ("red", "blue", "peg", "hole", "block", "mark", "glass_bottom")  # things that the network sees, where a task has them
NOISE = 0.004  # m, by which frames are varied
SYMMETRY = 4  # a block looks the same after a quarter turn


def heading(T: np.ndarray) -> float:
    return float(np.arctan2(T[1, 0], T[0, 0]))


def about_z(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def features(seen: Observation) -> np.ndarray:
    """What the network sees: the tool's height, the gripper, and of each thing where it is from the tool, and how it is turned."""
    tool = seen.T_base_tool
    turned = heading(tool)
    row = [tool[2, 3], seen.gripper if seen.gripper is not None else 0.0]
    for name in KNOWN:
        if name not in seen.things:
            continue
        thing = seen.things[name]
        off = SYMMETRY * (heading(thing) - turned)
        row += [*(thing[:3, 3] - tool[:3, 3]), np.cos(off), np.sin(off)]
    return np.array(row)


def label(seen: Observation, wanted: np.ndarray, gripper: float | None) -> np.ndarray:
    """What whoever led wanted a while later: shift and turn of the tool from where it was, and the gripper."""
    turn = heading(wanted) - heading(seen.T_base_tool)
    return np.array([*(wanted[:3, 3] - seen.T_base_tool[:3, 3]), np.arctan2(np.sin(turn), np.cos(turn)), gripper or 0.0])


# ---- the network
@dataclass
class Network:
    """tanh, tanh, linear; inputs and outputs scaled."""

    weights: list[np.ndarray]
    scales: list[np.ndarray]  # mean and deviation of inputs, of outputs

    def __call__(self, x: np.ndarray) -> np.ndarray:
        W1, b1, W2, b2, W3, b3 = self.weights
        h = np.tanh(np.tanh(((x - self.scales[0]) / self.scales[1]) @ W1 + b1) @ W2 + b2)
        return (h @ W3 + b3) * self.scales[3] + self.scales[2]


def vary(X: np.ndarray, Y: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Frames as they might have been as well: all turned about the vertical, and the tool elsewhere by some mm, from where it is led back."""
    X, Y = X.copy(), Y.copy()
    c, s = (f(random.uniform(-np.pi, np.pi, len(X))) for f in (np.cos, np.sin))
    off = random.normal(0.0, NOISE, (len(X), 3))
    X[:, 0] += off[:, 2]
    for k in range(2, X.shape[1], 5):
        X[:, k : k + 3] -= off
        X[:, k], X[:, k + 1] = c * X[:, k] - s * X[:, k + 1], s * X[:, k] + c * X[:, k + 1]
    Y[:, :3] -= off
    Y[:, 0], Y[:, 1] = c * Y[:, 0] - s * Y[:, 1], s * Y[:, 0] + c * Y[:, 1]
    return X, Y


def train(X: np.ndarray, Y: np.ndarray, epochs: int, seed: int = 0, width: int = 128, batch: int = 128, rate: float = 2e-3) -> Network:
    """Least squares by Adam, with a rate that falls to nothing."""
    random = np.random.default_rng(seed)
    many = vary(np.repeat(X, 4, 0), np.repeat(Y, 4, 0), random)
    scales = [many[0].mean(0), np.maximum(many[0].std(0), 1e-3), many[1].mean(0), np.maximum(many[1].std(0), 1e-4)]
    sizes = [X.shape[1], width, width, Y.shape[1]]
    weights: list[np.ndarray] = []
    for fan_in, fan_out in zip(sizes, sizes[1:]):
        weights += [random.normal(0.0, fan_in**-0.5, (fan_in, fan_out)), np.zeros(fan_out)]
    m, v = [np.zeros_like(w) for w in weights], [np.zeros_like(w) for w in weights]
    steps = epochs * max(1, len(X) // batch)
    for step in range(1, steps + 1):
        rows = random.integers(len(X), size=batch)
        x, y = vary(X[rows], Y[rows], random)
        x, y = (x - scales[0]) / scales[1], (y - scales[2]) / scales[3]
        W1, b1, W2, b2, W3, b3 = weights
        h1 = np.tanh(x @ W1 + b1)
        h2 = np.tanh(h1 @ W2 + b2)
        off = (h2 @ W3 + b3 - y) / batch
        d2 = (off @ W3.T) * (1 - h2 * h2)
        d1 = (d2 @ W2.T) * (1 - h1 * h1)
        gradients = [x.T @ d1, d1.sum(0), h1.T @ d2, d2.sum(0), h2.T @ off, off.sum(0)]
        now = rate * 0.5 * (1 + np.cos(np.pi * step / steps))
        for k, gradient in enumerate(gradients):
            m[k] = 0.9 * m[k] + 0.1 * gradient
            v[k] = 0.999 * v[k] + 0.001 * gradient * gradient
            weights[k] = weights[k] - now * (m[k] / (1 - 0.9**step)) / (np.sqrt(v[k] / (1 - 0.999**step)) + 1e-8)
    return Network(weights, scales)


class Cloned:
    """A policy of a file that `clone` or `dagger` wrote."""

    period = PERIOD

    def __init__(self, path: str) -> None:
        try:
            with np.load(path) as file:
                self.task, self.profile = str(file["task"]), str(file["profile"])
                self.network = Network([file[f"w{k}"] for k in range(6)], [file[f"s{k}"] for k in range(4)])
                self.upright = file["upright"]
                self.X, self.Y = file["X"], file["Y"]
        except (OSError, KeyError, ValueError) as error:
            raise ValueError(f"{path}: is no policy that cloning.py wrote ({error})") from None

    def act(self, seen: Observation) -> Action:
        x = features(seen)
        if x.shape != self.network.scales[0].shape:
            raise ValueError(f"this policy is for the task {self.task}")
        *shift, turn, gripper = self.network(x)
        T = np.eye(4)
        T[:3, :3] = about_z(heading(seen.T_base_tool) + PACE * turn) @ self.upright
        T[:3, 3] = seen.T_base_tool[:3, 3] + PACE * np.array(shift)
        return Action(T, None if seen.gripper is None else float(gripper > 0.5))


def save(path: str, task: str, profile: str, network: Network, upright: np.ndarray, X: np.ndarray, Y: np.ndarray) -> None:
    arrays = {f"w{k}": w for k, w in enumerate(network.weights)} | {f"s{k}": s for k, s in enumerate(network.scales)}
    with open(path, "wb") as file:
        np.savez_compressed(file, task=task, profile=profile, upright=upright, X=X, Y=Y, **arrays)


# ---- episodes
def upright_of(seen: Observation) -> np.ndarray:
    return about_z(-heading(seen.T_base_tool)) @ seen.T_base_tool[:3, :3]


def led(simulation: Simulation, seconds: float) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """What was seen and wanted while the operator leads, for so long or until all is over. Frames in which it waits are left out."""
    seen = [simulation.observe()]
    while not simulation.outcome.over and seen[-1].t < seen[0].t + seconds and simulation.operating:
        seen.append(simulation.advance(PERIOD))
    ahead, X, Y = round(AHEAD / PERIOD), [], []
    for k, now in enumerate(seen[:-1]):
        after, wanted = seen[k + 1], seen[min(k + ahead, len(seen) - 1)]
        moves = np.linalg.norm(wanted.T_base_target[:3, 3] - now.T_base_target[:3, 3]) > 5e-4 or abs(heading(wanted.T_base_target) - heading(now.T_base_target)) > 5e-3
        closes = now.gripper is not None and abs(after.gripper - now.gripper) > 5e-3
        if after.leader == now.leader == wanted.leader == "person" and (moves or closes):
            X.append(features(now))
            Y.append(label(now, wanted.T_base_target, after.gripper_command))
    return X, Y


def demonstrate(job: tuple[str, str, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
    task, profile, seed = job
    simulation = Simulation(task, profile=profile)
    seen = simulation.begin(seed)
    simulation.operate()
    X, Y = led(simulation, np.inf)
    while not simulation.outcome.over:
        simulation.advance(PERIOD)
    return np.array(X), np.array(Y), upright_of(seen), simulation.outcome.success is True


def judge(job: tuple[str, int]) -> tuple[int, bool, float, int, int]:
    path, seed = job
    policy = Cloned(path)
    simulation = Simulation(policy.task, profile=policy.profile)
    simulation.begin(seed)
    outcome = simulation.run(policy)
    return seed, outcome.success is True, outcome.time, outcome.beyond_limits, outcome.forbidden


def correct(job: tuple[str, int]) -> tuple[np.ndarray, np.ndarray, int, bool]:
    """One episode of the policy in which the operator takes over where it stalls or takes long, and hands back."""
    path, seed = job
    policy = Cloned(path)
    simulation = Simulation(policy.task, profile=policy.profile)
    seen = simulation.begin(seed)
    simulation.connect("cloned", PERIOD)
    simulation.turn()
    X: list[np.ndarray] = []
    Y: list[np.ndarray] = []
    takeovers, patience, track = 0, LONG, [seen.T_base_tool[:3, 3]]
    while not simulation.outcome.over:
        simulation.target(policy.act(seen))
        seen = simulation.advance(PERIOD)
        track.append(seen.T_base_tool[:3, 3])
        recent = np.array(track[-int(STALL / PERIOD) :])
        stalls = len(recent) * PERIOD >= STALL and np.ptp(recent, axis=0).max() < STALL_WAY
        if (stalls or len(track) * PERIOD > patience) and seen.leader == "policy":
            takeovers += 1
            simulation.operate(in_the_middle=True)
            x, y = led(simulation, LEADS)
            X += x
            Y += y
            simulation.let_go()
            simulation.advance(0.02)
            seen, track, patience = simulation.observe(), [], 6.0
            track.append(seen.T_base_tool[:3, 3])
    return np.array(X), np.array(Y), takeovers, simulation.outcome.success is True


def interval(successes: int, of: int) -> tuple[float, float]:
    """Wilson's, 95 %."""
    z = 1.96
    p = successes / of
    middle, half = p + z * z / (2 * of), z * np.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    return max(0.0, (middle - half) / (1 + z * z / of)), min(1.0, (middle + half) / (1 + z * z / of))


def say_rate(what: str, successes: int, of: int) -> None:
    low, high = interval(successes, of)
    print(f"{what}: {successes} of {of}, {100 * low:.0f} to {100 * high:.0f} %", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    clone = commands.add_parser("clone", help="demonstrations by the scripted operator, and a network that does as it did")
    clone.add_argument("--task", default="stack")
    clone.add_argument("--profile", default="tracking")
    clone.add_argument("--episodes", type=int, default=50)
    evaluate = commands.add_parser("evaluate", help="how often a policy succeeds")
    evaluate.add_argument("policy")
    evaluate.add_argument("--seeds", type=int, default=200)
    dagger = commands.add_parser("dagger", help="episodes of the policy in which the operator takes over, and a network that learns from these, too")
    dagger.add_argument("policy")
    dagger.add_argument("--rounds", type=int, default=3)
    dagger.add_argument("--episodes", type=int, default=50, help="in each round")
    for each in (clone, dagger):
        each.add_argument("--out", required=True)
        each.add_argument("--epochs", type=int, default=300)
    for each in (clone, evaluate, dagger):
        each.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    begin = time.monotonic()
    with concurrent.futures.ProcessPoolExecutor(max(1, options.workers)) as pool:
        if options.command == "clone":
            done = list(pool.map(demonstrate, [(options.task, options.profile, DEMONSTRATIONS + k) for k in range(options.episodes)]))
            kept = [each for each in done if each[3]]
            say_rate("the operator", len(kept), len(done))
            X, Y = np.concatenate([each[0] for each in kept]), np.concatenate([each[1] for each in kept])
            network = train(X, Y, options.epochs)
            save(options.out, options.task, options.profile, network, kept[0][2], X, Y)
            print(f"{options.out}: {len(X)} frames of {len(kept)} episodes, residual {np.sqrt(((network(X) - Y) ** 2).mean(0))}")
        elif options.command == "dagger":
            policy = Cloned(options.policy)
            X, Y, path = policy.X, policy.Y, options.policy
            for k in range(options.rounds):
                first = TAKEOVERS + k * options.episodes
                done_of = list(pool.map(correct, [(path, first + i) for i in range(options.episodes)]))
                new = [each for each in done_of if len(each[0])]
                alone = sum(each[2] == 0 and each[3] for each in done_of)
                X, Y = np.concatenate([X, *[each[0] for each in new]]), np.concatenate([Y, *[each[1] for each in new]])
                network = train(X, Y, options.epochs, seed=k + 1)
                save(options.out, policy.task, policy.profile, network, policy.upright, X, Y)
                path = options.out
                print(f"round {k + 1}: {sum(each[2] for each in done_of)} takeovers in {len(done_of)} episodes, {len(X)} frames by now", flush=True)
                say_rate("  without a takeover", alone, len(done_of))
        else:
            results = list(pool.map(judge, [(options.policy, JUDGED + k) for k in range(options.seeds)]))
            say_rate(options.policy, sum(each[1] for each in results), len(results))
            times = [each[2] for each in results if each[1]]
            print(f"median {np.median(times):.1f} s" if times else "none", f"beyond limits {sum(e[3] for e in results)}, forbidden contacts {sum(e[4] for e in results)}")
    print(f"{time.monotonic() - begin:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
