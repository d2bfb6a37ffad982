"""How the time of our solver grows with what the problem has: pairs of spheres, joints, intervals.

Robots are made for it: the UR5e with some of its pairs, and chains of 2 to 8 joints that carry the same glass.
"""

import json
import random
import subprocess

import numpy as np
import yaml

from peers import PeerError

SEQUENCE = "smooth"
JOINTS = (2, 3, 4, 5, 6, 7, 8)
HORIZONS = (8, 16, 32, 64)
PAIR_SHARES = (0.0, 0.125, 0.25, 0.5, 1.0)
LINK = 0.15  # m between joints of a chain


def ur5e_with_pairs(ur5e, description, count):
    """The UR5e with the first `count` of its pairs in a drawn order, each a superset of the smaller ones."""
    names = [sphere["name"] for sphere in description["spheres"]]
    pairs = [[names[i], names[j]] for i, j in description["pairs"]]
    random.Random(1).shuffle(pairs)
    robot = dict(ur5e, pairs=pairs[:count])
    if count == 0:
        del robot["spheres"], robot["pairs"]
    return robot


def chain_urdf(joints):
    """Links of equal length whose joints turn about z, y, x, y and so on."""
    axes = ["0 0 1"] + ["0 1 0" if i % 2 else "1 0 0" for i in range(1, joints)]
    links = "".join(f'<link name="link_{i}"/>' for i in range(joints + 1))
    hinges = "".join(
        f'<joint name="joint_{i}" type="revolute"><parent link="link_{i}"/><child link="link_{i + 1}"/>'
        f'<origin xyz="0 0 {LINK}"/><axis xyz="{axis}"/><limit lower="-3" upper="3" velocity="3" effort="1"/></joint>'
        for i, axis in enumerate(axes)
    )
    return f'<robot name="chain_{joints}">{links}{hinges}</robot>'


def chain(joints, urdf):
    home = [0.0] + [0.5 if i % 2 else -0.3 for i in range(1, joints)]
    tool = {"name": "glass", "link": f"link_{joints}", "xyz": [0.0, 0.0, LINK], "rpy": [0.0, 0.0, 0.0]}
    return {"name": f"chain_{joints}", "urdf": str(urdf), "tool": tool, "home": home}


def measure(program, robot, horizon, options):
    """Figures of each profile, as bench_solvers prints them."""
    command = [program, "--json", "--robot", robot, "--sequence", SEQUENCE, "--horizon", horizon]
    command += ["--solves", options.solves, "--profile", *options.profiles]
    run = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, text=True)
    if run.returncode != 0:
        raise PeerError(f"`{' '.join(map(str, command))}` ended with exit code {run.returncode}, see above")
    return {f["profile"]: f for f in map(json.loads, run.stdout.splitlines())}


def exponent(sizes, times):
    """e of time ~ size^e, by least squares in logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(times), 1)[0])


def run(program, description, robot_file, options, folder):
    """Prints a table for each kind of growth; returns all figures. @param robot_file of the UR5e"""
    ur5e = yaml.safe_load(robot_file.read_text())

    def written(robot):
        path = folder / "robot.yaml"
        path.write_text(yaml.safe_dump(robot, sort_keys=False))
        return path

    def chain_file(joints):
        urdf = folder / f"chain_{joints}.urdf"
        urdf.write_text(chain_urdf(joints))
        return written(chain(joints, urdf))

    pairs = [round(share * len(description["pairs"])) for share in PAIR_SHARES]
    kinds = {
        "pairs": (pairs, lambda count: (written(ur5e_with_pairs(ur5e, description, count)), 8)),
        "joints": (JOINTS, lambda joints: (chain_file(joints), 8)),
        "horizon": (HORIZONS, lambda horizon: (robot_file, horizon)),
    }
    results = {}
    for kind, (sizes, problem) in kinds.items():
        print(
            f"\n{kind:<10}{'profile':<12}{'p50 us':>9}{'mean us':>9}{'iterations':>12}{'iteration us':>15}"
            f"{'unsolved':>10}"
        )
        results[kind] = []
        for size in sizes:
            for profile, f in measure(program, *problem(size), options).items():
                results[kind].append({"size": size, **f})
                print(
                    f"{size:<10}{profile:<12}{f['p50_us']:9.1f}{f['mean_us']:9.1f}{f['iterations']:12.1f}"
                    f"{f['iteration_us']:15.2f}{f['unsolved']:>10}",
                    flush=True,
                )
        for profile in options.profiles:
            some = [r for r in results[kind] if r["profile"] == profile and r["size"] > 0]
            sizes_, solve, each = ([r[key] for r in some] for key in ("size", "p50_us", "iteration_us"))
            print(
                f"  {profile}: a solve (p50) grows as {kind}^{exponent(sizes_, solve):.2f}, an iteration as "
                f"{kind}^{exponent(sizes_, each):.2f}; linear is 1"
            )
    return results
