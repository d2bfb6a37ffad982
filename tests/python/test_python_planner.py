"""steadyhand.Planner: plans that keep what they promise, and what it says to bad input."""

import os
import pydoc
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
import steadyhand


def target(robot, x=0.0, y=0.0, z=0.0):
    T = robot.fk(robot.home)
    T[:3, 3] += [x, y, z]
    return T


@pytest.mark.parametrize("profile", ["tracking", "anti-slosh", "waiter"])
def test_a_plan_leads_to_the_target_inside_the_limits(robot, profile):
    planner = steadyhand.Planner(robot, profile=profile)
    T, before = target(robot, y=0.1, z=0.05), (robot.home, np.zeros(6))
    for i in range(60):
        t = 0.05 * i
        plan = planner.update(T, t)
        assert plan.status == "solved" and plan.fault == "none" and plan.dt == 0.05 and abs(plan.start - t) < 1e-9
        assert plan.q.shape == plan.dq.shape == (len(plan.ddq) + 1, 6)
        assert np.abs(plan.dq[-1]).max() < 1e-12
        assert (np.abs(plan.dq) <= robot.velocity_max + 1e-5).all()
        assert (np.abs(plan.ddq) <= robot.acceleration_max + 1e-5).all()
        np.testing.assert_allclose(plan.q[0], before[0], atol=1e-9)  # continues what went before
        np.testing.assert_allclose(plan.dq[0], before[1], atol=1e-9)
        before = plan.at(t + 0.05)[:2]
    assert np.abs(robot.fk(before[0])[:3, 3] - T[:3, 3]).max() < (0.05 if profile == "anti-slosh" else 0.01)


def test_at_is_the_exact_double_integrator(robot):
    plan = steadyhand.Planner(robot, profile="tracking").update(target(robot, x=0.2), 1.0)
    times = 1.0 + plan.dt * np.array([-1.0, 0.0, 0.25, 1.0, 2.5, 1000.0])
    q, dq, ddq = plan.at(times)
    for row, (k, h) in enumerate([(0, 0.0), (0, 0.0), (0, 0.25 * plan.dt), (1, 0.0), (2, 0.5 * plan.dt)]):
        np.testing.assert_allclose(q[row], plan.q[k] + h * plan.dq[k] + h * h / 2 * plan.ddq[k], atol=1e-12)
        np.testing.assert_allclose(dq[row], plan.dq[k] + h * plan.ddq[k], atol=1e-12)
    np.testing.assert_allclose(q[-1], plan.q[-1])
    assert (dq[-1] == 0).all() and (ddq[-1] == 0).all()
    for one, many in zip(plan.at(times[2]), (q, dq, ddq)):
        assert (one == many[2]).all()


BAD = {
    "a shape": (np.eye(3), 0.0, ValueError, "T_base_tool has shape (3, 3); expected (4, 4)"),
    "a list of rows that differ": ([[1, 2], [3]], 0.0, ValueError, "expected (4, 4)"),
    "text": ("T", 0.0, TypeError, "T_base_tool must be numbers, not 'T'; expected (4, 4)"),
    "NaN": (np.full((4, 4), np.nan), 0.0, ValueError, "T_base_tool has numbers that are not finite"),
    "no rotation": (np.diag([2.0, 1, 1, 1]), 0.0, ValueError, "T_base_tool is no pose"),
    "a mirror": (np.diag([-1.0, 1, 1, 1]), 0.0, ValueError, "T_base_tool is no pose"),
    "a transposed one": (np.eye(4) + np.eye(4, k=-3), 0.0, ValueError, "its last row is [1, 0, 0, 1]; it must be [0, 0, 0, 1]"),
    "no time": (np.eye(4), float("nan"), ValueError, "t is nan; it must be finite"),
    "a late time": (np.eye(4), 1e10, ValueError, "t is 10000000000 s; it must be finite, at most 9e9"),
    "a time in words": (np.eye(4), "now", TypeError, "t must be a number of seconds, not 'now'"),
}


@pytest.mark.parametrize("T, t, kind, said", BAD.values(), ids=BAD.keys())
def test_bad_targets(robot, T, t, kind, said):
    with pytest.raises(kind) as refused:
        steadyhand.Planner(robot).update(T, t)
    assert said in str(refused.value)


def test_times_do_not_go_back(robot):
    planner = steadyhand.Planner(robot)
    planner.update(target(robot), 1.0)
    with pytest.raises(ValueError, match="t is 0.9 s, before 1 s of the last plan; times must not go back"):
        planner.update(target(robot), 0.9)


def test_two_threads_do_not_share_a_planner_and_others_run_meanwhile(robot):
    planner, T = steadyhand.Planner(robot, profile="waiter"), target(robot, x=0.1)
    planned, refused = [], []

    def plan():
        for _ in range(300):
            try:
                planned.append(planner.update(T, 0.0).status)
            except steadyhand.SteadyhandError as error:
                refused.append(str(error))

    threads = [threading.Thread(target=plan) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(planned) + len(refused) == 1200 and planned
    assert set(refused) <= {"another thread is using this object; give each thread its own object"}


def test_help_tells_shapes_units_frames_and_errors():
    for words in ("(4, 4)", "in the base", "position in m", "s, on your clock", "Raises ValueError", "SteadyhandError"):
        assert words in steadyhand.Planner.__doc__ + steadyhand.Planner.update.__doc__, words


@pytest.mark.parametrize(
    "name, words",
    [
        ("Plan", ["q: (K + 1, n), rad (m): positions at start + k dt.", 'status: "solved": the optimum']),
        ("Steps", ["T_base_target: (m, 4, 4), m: target of the tool, in the base.", "solve_us: (m,), us, wall time of the solver."]),
        ("Hand", ["T_operator_hand: (m, 4, 4): in the operator frame with robot axes (z up), m."]),
        ("Solution", ["x: (N + 1, 2n): states [q; dq], rad (m), rad/s (m/s)."]),
        ("Robot", ["velocity_max: (n,), rad/s (m/s)."]),
        ("Node", ["dq: (n,), rad/s (m/s)."]),
        ("LiquidState", ["freeboard: m, height from the surface's highest point to the rim; negative: over the rim."]),
        ("Pipeline", ["Other arguments and errors: as Planner."]),
        ("SteadyhandError", ["which values are valid"]),
    ],
)
def test_help_tells_of_the_members_too(name, words):
    text = pydoc.render_doc(getattr(steadyhand, name), renderer=pydoc.plaintext)
    assert [w for w in words if w not in text] == []


@pytest.mark.parametrize("pause", [0.0, 0.05])
@pytest.mark.parametrize("objectives", ["", "objectives=[Effort()], weights={'effort': 0.01}"], ids=["", "objective"])
def test_the_interpreter_ends_though_daemon_threads_plan(objectives, pause):
    """Two control loops that nobody stops, as many write them."""
    script = f"""if True:
        import threading, time
        import numpy as np, steadyhand

        class Effort(steadyhand.Objective):
            name = "effort"
            value = lambda self, node, weight: weight[0] * node.ddq @ node.ddq
            gradient = lambda self, node, weight: np.r_[np.zeros(12), 2 * weight[0] * node.ddq]
            hessian = lambda self, node, weight: np.diag(np.r_[np.zeros(12), np.full(6, 2 * weight[0])])

        robot = steadyhand.Robot("ur5e")
        started = threading.Barrier(3)

        def loop():
            planner, T, i = steadyhand.Planner(robot, horizon=60, {objectives}), robot.fk(robot.home), 0
            started.wait()
            while True:
                i, T[1, 3] = i + 1, 0.1 * np.sin(0.3 * i)
                planner.update(T, 0.05 * i)
                time.sleep({pause})

        for _ in range(2):
            threading.Thread(target=loop, daemon=True).start()
        started.wait()
        time.sleep(0.2)"""
    environment = {**os.environ, "PYTHONPATH": str(Path(steadyhand.__file__).parents[1])}
    for _ in range(3):
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, env=environment)
        assert (done.returncode, done.stderr) == (0, "")


def tool_turn(robot, q, T):
    """How far tool axes x, y, z are from those of T, rad."""
    return np.arccos(np.clip(np.sum(robot.fk(q)[:3, :3] * T[:3, :3], axis=0), -1, 1))


def test_the_turn_about_the_glass_may_be_left_free(robot):
    """The hand turns the glass about its own axis by a quarter turn and goes sideways: free, the arm keeps to the opening."""
    T = target(robot, y=0.2)
    T[:3, :3] = T[:3, :3] @ steadyhand.pose(quat_xyzw=[0, 0, 0.5**0.5, 0.5**0.5])[:3, :3]
    turns = {}
    for weight in (5.0, (0.0, 0.0, 5.0)):
        planner = steadyhand.Planner(robot, "tracking", weights={"orientation": weight})
        for i in range(80):
            plan = planner.update(T, 0.05 * i)
        assert np.abs(robot.fk(plan.q[0])[:3, 3] - T[:3, 3]).max() < 0.02
        turns[weight] = tool_turn(robot, plan.q[0], T)
    assert turns[5.0].max() < 0.1, "followed"
    free = turns[(0.0, 0.0, 5.0)]
    assert free[2] < 0.02 and free[0] > 1.0, "upright, and not turned"


def test_posture_draws_the_joints_home_where_the_task_leaves_them_a_choice(robot):
    """With the orientation free three joints are left over: after a detour they come back, and without the term they do not."""
    left = {}
    for weight in (0.0, 1.0):
        planner = steadyhand.Planner(robot, "tracking", weights={"orientation": 0.0, "posture": weight})
        for i in range(160):
            far = i < 80
            plan = planner.update(target(robot, x=-0.2 * far, y=0.5 * far, z=0.3 * far), 0.05 * i)
        assert np.abs(robot.fk(plan.q[0])[:3, 3] - target(robot)[:3, 3]).max() < 0.02
        left[weight] = np.abs(plan.q[0] - robot.home).max()
    assert left[1.0] < 0.02 and left[0.0] > 1.0


def test_an_arm_of_seven_joints_comes_back_to_its_posture():
    """Led away and back, its elbow is where it was, which nothing else than `posture` sees to; an arm of six has no such term."""
    arm, left = steadyhand.Robot("gen3"), {}
    assert steadyhand.Planner(arm).weights["posture"].tolist() == [0.1] * 7
    for name, weights in (("default", {}), ("none", {"posture": 0.0})):
        planner = steadyhand.Planner(arm, "tracking", weights=weights)
        for i in range(700):
            t = 0.05 * min(i, 200)  # 10 s of circles, 25 s at rest
            plan = planner.update(target(arm, x=0.15 * np.sin(3 * t), y=0.25 * np.sin(2 * t), z=0.15 * (1 - np.cos(t))) if i < 200 else target(arm), 0.05 * i)
        assert np.abs(arm.fk(plan.q[0])[:3, 3] - target(arm)[:3, 3]).max() < 1e-3
        left[name] = np.abs(plan.q[0] - arm.home).max()
    assert left["default"] < 0.02 and left["none"] > 4 * left["default"], left


def test_posture_is_a_term_only_where_it_is_named(robot):
    assert "posture" not in steadyhand.Planner(robot).weights
    assert steadyhand.Planner(robot, weights={"posture": 0.5}).weights["posture"].tolist() == [0.5] * 6
    with pytest.raises(steadyhand.SteadyhandError, match="'posture' has 2 numbers, it needs 1 or 6"):
        steadyhand.Planner(robot, weights={"posture": [1, 2]})
