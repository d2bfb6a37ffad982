"""The Python package against the program's output, against Pinocchio, and against equations; and what it says to bad input."""

import copy
import json
import os
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import steadyhand
import yaml

from places import PROGRAM, ROOT

PACKAGE = Path(steadyhand.__file__).parent
HAND = ROOT / ".deps/node_modules/super-hands/examples/physics/demo-recording.json"
QUAT_XYZW = ("qx", "qy", "qz", "qw")


def program(*arguments, **options):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120, **options)


def package(*arguments, env={}, **options):
    """`python -m steadyhand`."""
    command = [sys.executable, "-m", "steadyhand", *map(str, arguments)]
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE.parent), **env}
    return subprocess.run(command, capture_output=True, text=True, timeout=120, env=environment, **options)


@pytest.fixture(scope="module")
def replayed(tmp_path_factory):
    """What the program writes of 4 s of a hand."""
    out = tmp_path_factory.mktemp("out")
    done = program("replay", HAND, "--until", "4", "--profile", "waiter", "--rate", "25", "--scale", "0.4", "--dump-problems", "--out", out)
    assert done.returncode == 0, done.stderr
    return out / "waiter"


@pytest.fixture(scope="module")
def plan_csv(replayed):
    return np.genfromtxt(replayed / "plan.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")


@pytest.fixture(scope="module")
def replay():
    return steadyhand.replay(HAND, "waiter", 25, until=4, scale=0.4)


def stack(table, names):
    return np.column_stack([table[name] for name in names])


# ---- against the program's output


def test_a_replay_is_the_programs_bit_for_bit(replay, plan_csv):
    steps, joints = replay.steps, range(6)
    assert len(plan_csv) == len(steps.t) == 100
    assert (steps.t == plan_csv["t_s"]).all()
    assert (steps.q == stack(plan_csv, [f"q{i}_rad" for i in joints])).all()
    assert (steps.dq == stack(plan_csv, [f"dq{i}_rad_s" for i in joints])).all()
    assert (steps.ddq == stack(plan_csv, [f"ddq{i}_rad_s2" for i in joints])).all()
    assert (steps.local_acceleration == stack(plan_csv, [f"local_acceleration_{a}_m_s2" for a in "xyz"])).all()
    assert (steps.T_base_target[:, :3, 3] == stack(plan_csv, [f"target_{a}_m" for a in "xyz"])).all()
    assert (steps.T_base_tool[:, :3, 3] == stack(plan_csv, [f"planned_{a}_m" for a in "xyz"])).all()
    assert (steps.objective == plan_csv["objective"]).all()
    for term, share in steps.shares.items():
        assert (share == plan_csv[f"objective_{term}"]).all(), term
    assert (steps.iterations == plan_csv["iterations"]).all() and (steps.status == plan_csv["status"]).all()
    assert (steps.clearance == plan_csv["smallest_sphere_distance_m"]).all() and (steps.engaged == plan_csv["engaged"]).all()


def test_quaternions_are_the_programs(replay, plan_csv):
    for kind, T in (("target", replay.steps.T_base_target), ("planned", replay.steps.T_base_tool)):
        theirs = stack(plan_csv, [f"{kind}_{name}" for name in QUAT_XYZW])
        ours = steadyhand.quat_xyzw(T)
        assert np.abs(ours * np.sign((ours * theirs).sum(1))[:, None] - theirs).max() < 1e-9
        p = stack(plan_csv, [f"{kind}_{a}_m" for a in "xyz"])
        assert np.abs(steadyhand.pose(p, theirs) - T).max() < 1e-9


def test_a_session_reads_back_as_it_was_replayed(replay, replayed):
    session = steadyhand.read_session(replayed / "session.mcap")
    assert session.complete and session.joint_names == replay.robot.joint_names and session.metadata["run"]["profile"] == "waiter"
    for part in ("steps", "commands"):
        for key, ours in vars(getattr(replay, part)).items():
            theirs = getattr(getattr(session, part), key)
            if key in ("solve_us", "shares"):
                continue
            if key == "object_distances":
                assert set(ours) == set(theirs) == {"floor", "column", "foot"}
                assert all((ours[name] == theirs[name]).all() for name in ours)
                continue
            if key.startswith("T_"):
                assert np.abs(ours - theirs).max() < 1e-9
            else:
                assert np.array_equal(ours, theirs, equal_nan=ours.dtype.kind == "f"), (part, key)
    recorded = len(session.hand.t)  # those that a plan came after
    assert 340 < recorded <= len(replay.hand.t)
    assert np.abs(session.hand.T_operator_hand - replay.hand.T_operator_hand[:recorded]).max() < 1e-9
    assert (session.states.q == session.commands.q).all()  # in a replay the arm follows exactly
    assert session.changes == [] and session.settings == []


def test_a_session_is_replayed_with_its_own_settings(replayed):
    again = steadyhand.replay(replayed / "session.mcap", until=1)
    assert (again.profile, again.rate) == ("waiter", 25.0)


def test_solve_is_the_programs_bit_for_bit(replayed):
    file = replayed / "problems.json"
    theirs = json.loads(program("solve", file).stdout)
    problems = json.loads(file.read_text())
    with_arrays = [{**p, "x0": np.array(p["x0"]), "guess": {k: np.array(v) for k, v in p["guess"].items()}} for p in problems]
    for ours in (steadyhand.solve(file), steadyhand.solve(with_arrays)):
        assert len(ours) == len(theirs) == 100
        for a, b in zip(ours, theirs):
            assert (a.status, a.objective, a.iterations, a.kkt_error) == (b["status"], b["objective"], b["iterations"], b["kkt_error"])
            assert (a.x == b["x"]).all() and (a.u == b["u"]).all()
    assert (steadyhand.solve(problems[7]).x == theirs[7]["x"]).all()


def test_the_stages_by_hand_are_the_replay(replay):
    """Retargeter, Robot and Planner, wired in Python as the pipeline wires them."""
    hand, steps, robot = replay.hand, replay.steps, replay.robot
    retargeter, planner = steadyhand.Retargeter(scale=0.4), steadyhand.Planner(robot, "waiter")
    q, plan, fed = robot.home, None, 0
    for i, t in enumerate(steps.t):
        while fed < len(hand.t) and hand.t[fed] <= t:
            q = plan.at(hand.t[fed])[0] if plan else robot.home
            T, engaged = retargeter.update(hand.T_operator_hand[fed], hand.t[fed], robot.fk(q), hand.clutch[fed])
            planner.aim(T, hand.t[fed], engaged)
            fed += 1
        plan = planner.plan(t)
        assert np.abs(plan.q[0] - steps.q[i]).max() < 1e-9 and np.abs(plan.ddq[0] - steps.ddq[i]).max() < 1e-6


def test_a_pipeline_follows_as_the_replay_does(replay):
    hand, commands = replay.hand, replay.commands
    arm, fed = steadyhand.Pipeline(replay.robot, "waiter", rate=25, scale=0.4), 0
    for i, t in enumerate(commands.t):
        while fed < len(hand.t) and hand.t[fed] <= t:
            arm.feed(hand.T_operator_hand[fed], hand.t[fed], hand.clutch[fed])
            fed += 1
        q, dq, ddq = arm.update(t)
        assert np.abs(q - commands.q[i]).max() < 1e-9 and np.abs(dq - commands.dq[i]).max() < 1e-7
    assert arm.engaged and np.abs(arm.target - replay.steps.T_base_target[-1])[:3, 3].max() < 0.02


# ---- robots


def test_a_robot_is_what_the_program_describes(robot):
    described = json.loads(program("describe", "ur5e").stdout)
    assert robot.description == described
    for key in ("home", "position_min", "position_max", "velocity_max", "acceleration_max"):
        assert (getattr(robot, key) == described[key]).all()
    assert robot.dof == 6 and robot.joint_units == ("rad",) * 6 and robot.doubts == ()
    with pytest.raises(ValueError):
        robot.home[0] = 1.0


def test_kinematics_agree_with_pinocchio(robot):
    settings = yaml.safe_load((ROOT / "robots/ur5e.yaml").read_text())
    [folder] = ROOT.glob(f".deps/venv/lib/python3*/site-packages/{settings['urdf']['package']}")
    model = pin.buildModelFromUrdf(str(folder / settings["urdf"]["path"]))
    tool, parent = settings["tool"], model.getFrameId(settings["tool"]["link"])
    placement = model.frames[parent].placement * pin.SE3(pin.rpy.rpyToMatrix(*tool["rpy"]), np.array(tool["xyz"]))
    frame = model.addFrame(pin.Frame("glass", model.frames[parent].parentJoint, parent, placement, pin.FrameType.OP_FRAME))
    spheres = []
    for sphere in settings["spheres"]:
        link = model.frames[model.getFrameId(sphere["link"])]
        at = link.placement * pin.SE3(np.eye(3), np.array(sphere["center"]))
        spheres.append(model.addFrame(pin.Frame(sphere["name"], link.parentJoint, at, pin.FrameType.OP_FRAME)))
    data, aligned = model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    states = np.random.default_rng(3).uniform(-1, 1, (3, 10_000, 6)) * np.array([2 * np.pi, np.pi, 15.0])[:, None, None]
    T, J, a = robot.fk(states[0]), robot.jacobian(states[0]), robot.local_acceleration(*states)
    for i, (q, dq, ddq) in enumerate(zip(*states)):
        pin.forwardKinematics(model, data, q, dq, ddq)
        pin.updateFramePlacements(model, data)
        pose = data.oMf[frame]
        assert np.abs(T[i] - pose.homogeneous).max() < 1e-12
        assert np.abs(J[i] - pin.computeFrameJacobian(model, data, q, frame, aligned)).max() < 1e-12
        acceleration = pin.getFrameClassicalAcceleration(model, data, frame, aligned).linear
        assert np.abs(a[i] - pose.rotation.T @ (acceleration + [0, 0, 9.81])).max() < 1e-9
        assert np.abs(robot.body_centers(q) - [data.oMf[sphere].translation for sphere in spheres]).max() < 1e-12
    assert (robot.fk(states[0, 0]) == T[0]).all() and (robot.jacobian(states[0, 0]) == J[0]).all()


def test_clearance_is_that_of_the_nearest_pair(robot):
    spheres, pairs = robot.description["spheres"], np.array(robot.description["pairs"])
    radius = np.array([sphere["radius"] for sphere in spheres])
    for q in np.random.default_rng(4).uniform(-np.pi, np.pi, (50, 6)):
        c = robot.body_centers(q)
        gaps = np.linalg.norm(c[pairs[:, 0]] - c[pairs[:, 1]], axis=1) - radius[pairs].sum(1)
        assert abs(robot.clearance(q) - gaps.min()) < 1e-12
    center, reach = robot.reach()
    assert np.linalg.norm(robot.fk(robot.home)[:3, 3] - center) < reach < 1.5


def test_a_bare_urdf_is_a_robot(robot):
    urdf = next(ROOT.glob(".deps/venv/lib/python3*/site-packages/airo_models/arms/ur5e/ur5e.urdf"))
    bare = steadyhand.Robot(urdf)
    assert bare.dof == 6 and bare.clearance(bare.home) == np.inf and bare.doubts


# ---- stages


def test_a_predictor_goes_on_as_the_target_did():
    predictor = steadyhand.Predictor(horizon=4, dt=0.1)
    assert predictor.predict(0.0).shape == (0, 4, 4)
    T = np.eye(4)
    for i in range(20):
        T[:3, 3] = 0.3 * 0.01 * i, 0.0, -0.1 * 0.01 * i
        predictor.update(T, 0.01 * i)
    np.testing.assert_allclose(predictor.velocity, [0.3, 0, -0.1], atol=1e-9)
    np.testing.assert_allclose(predictor.angular_velocity, 0.0, atol=1e-9)
    ahead = predictor.predict(0.2)
    np.testing.assert_allclose(ahead[:, 0, 3], 0.3 * (0.2 + 0.1 * np.arange(1, 5)), atol=1e-9)
    np.testing.assert_allclose(predictor.at(0.3)[2, 3], -0.03, atol=1e-9)
    clipped = steadyhand.Predictor(horizon=4, dt=0.1, robot="ur5e")
    T[:3, 3] = 5.0, 0.0, 0.0
    clipped.update(T, 0.0)
    assert (np.linalg.norm(clipped.predict(0.0)[:, :3, 3], axis=1) < 1.5).all()


def test_a_planner_follows_poses_of_the_callers_own(robot):
    planner, T = steadyhand.Planner(robot), robot.fk(robot.home)
    ahead = np.repeat(T[None], planner.horizon, axis=0)
    ahead[:, 1, 3] += 0.2 * planner.dt * np.arange(1, planner.horizon + 1)
    plan = planner.follow(ahead, 0.0)
    assert plan.status == "solved"
    assert np.abs(robot.fk(plan.q[planner.horizon])[:3, 3] - ahead[-1, :3, 3]).max() < 0.02


def test_retargeting_scales_and_turns_and_never_steps():
    retargeter = steadyhand.Retargeter(scale=0.5, yaw=np.pi / 2)
    hand, tool = steadyhand.pose([1, 2, 3]), steadyhand.pose([0.4, 0, 0.5])
    T, engaged = retargeter.update(hand, 0.0, tool)
    assert engaged and np.abs(T - tool).max() < 1e-12
    T, engaged = retargeter.update(steadyhand.pose([1.2, 2, 3]), 0.1, T)  # forward is the arm's left
    np.testing.assert_allclose(T[:3, 3], [0.4, 0.1, 0.5], atol=1e-12)
    assert not retargeter.update(hand, 0.2, T, clutch=False)[1]


def test_a_profile_says_how_far_the_glass_leans_with_the_hand():
    t = 0.01 * np.arange(200)
    hand = np.repeat(np.eye(4)[None], len(t), axis=0)
    angle = np.minimum(t, 1.0)  # rad, about x
    hand[:, 1, 1] = hand[:, 2, 2] = np.cos(angle)
    hand[:, 2, 1], hand[:, 1, 2] = np.sin(angle), -np.sin(angle)
    lean = {}
    for name, profile, tilt in (("upright", "carry", None), ("a little", "carry", 0.2), ("as the hand", "tracking", None)):
        target = steadyhand.replay((t, hand), profile, tilt=tilt).steps.T_base_target
        lean[name] = np.arccos(np.clip(target[-1, 2, 2], -1, 1))
    assert lean["upright"] < 0.03 and abs(lean["a little"] - 0.2) < 0.03 and abs(lean["as the hand"] - 1.0) < 0.05
    retargeter = steadyhand.Retargeter(tilt=0.0)
    for i in range(len(t)):
        T, _ = retargeter.update(hand[i], t[i], np.eye(4))
    assert T[2, 2] > 1 - 1e-9
    retargeter.set_tilt(np.pi)
    leans = [np.arccos(np.clip(retargeter.update(hand[-1], 2 + 0.01 * i, T)[0][2, 2], -1, 1)) for i in range(150)]
    assert np.diff(leans).max() < 0.011 and abs(leans[-1] - 1.0) < 0.01  # at a radian a second


def test_a_glass_of_another_shape_swings_at_its_own_frequency():
    bowl = steadyhand.Glass(radius=0.07, height=0.06, fill=0.045, frequency_factor=0.9)
    alike = steadyhand.Liquid(*bowl[:4])
    assert abs(steadyhand.Liquid(*bowl).frequency / alike.frequency - 0.9) < 1e-12
    with pytest.raises(ValueError, match="frequency_factor is 0.1; it must be from 0.2 to 5"):
        steadyhand.Liquid(frequency_factor=0.1)
    arm = steadyhand.Pipeline("ur5e", "carry", glass=bowl)
    arm.feed(np.eye(4), 0.0)
    assert np.isfinite(arm.update(0.01)).all()


def test_a_liquid_swings_at_its_frequency():
    liquid = steadyhand.Liquid(viscosity=0.0)
    k = 1.8411837813 / 0.035
    assert abs(liquid.frequency - np.sqrt(9.81 * k * np.tanh(k * 0.09))) < 1e-9
    assert liquid.update(0.1, [0, 0, 9.81]) == (0, 0, pytest.approx(0.01), False, 0.0)
    tilts = [liquid.update(1e-3, [0.2, 0, 9.81]).tilt_y for _ in range(2000)]
    turns = np.flatnonzero(np.diff(np.sign(np.array(tilts) - np.mean(tilts))))
    assert abs(np.pi / np.diff(turns).mean() * 1e3 / liquid.frequency - 1) < 0.02
    assert liquid.update(1.0, [9, 0, 9.81]).spilled_share > 0.1
    liquid.reset()
    assert not liquid.update(0.001, [0, 0, 9.81]).spilled


def test_weights_are_changed_and_a_planner_is_reset(robot):
    planner = steadyhand.Planner(robot, "tracking", weights={"lateral": 3.0}, horizon=6, dt=0.04)
    assert (planner.horizon, planner.dt) == (6, 0.04) and planner.weights["lateral"] == [3.0]
    planner.set_weights({"vertical": 2.0, "position": [1, 2, 3]})
    assert planner.weights["lateral"] == [3.0] and planner.weights["vertical"] == [2.0] and list(planner.weights["position"]) == [1, 2, 3]
    T = robot.fk(robot.home)
    planner.update(T, 5.0)
    q = robot.home + 0.1
    planner.reset(q, 1.0)
    plan = planner.update(T, 1.0)
    assert np.abs(plan.q[0] - q).max() < 1e-12


def test_arrays_in_place_of_a_file(robot):
    t = np.arange(0, 2, 0.011)
    p = np.column_stack([0 * t, 0.2 * np.sin(t), 0 * t])
    T = steadyhand.pose(p, np.tile([0, 0, 0, 1.0], (len(t), 1)))
    done = steadyhand.replay((t, T, t > 0.5), "tracking")
    assert (done.steps.engaged == (done.steps.t > 0.51)).mean() > 0.95
    assert np.abs(done.steps.q[done.steps.t < 0.5] - robot.home).max() < 1e-6


# ---- bad input, for each call

EYE = np.eye(4)
NAN4 = np.full((4, 4), np.nan)
PROBLEM = {
    "robot": "ur5e", "dt": 0.05, "horizon": 2, "x0": [0.0, -1.5, 1.5, 0, 0, 0] + [0.0] * 6, "weights": {"position": 1.0},
    "reference": [{"p": [0.4, 0.1, 0.5], "R": np.eye(3)}] * 2,
}  # fmt: skip
P, R, V, T, F, S = steadyhand, "ur5e", ValueError, TypeError, FileNotFoundError, steadyhand.SteadyhandError
BAD = [
    (lambda: P.Robot("ur55"), S, "robot 'ur55' is neither a file nor one of the names in robots/: fr3"),
    (lambda: P.Robot("a/b.urdf"), F, "'a/b.urdf' is neither a file nor"),
    (lambda: P.Robot(5), T, "robot must be a name or the path of a file, not int"),
    (lambda: P.Robot(ROOT / "README.md"), S, "README.md"),
    (lambda: P.Robot(R).fk(np.zeros(5)), V, "q has shape (5,); expected (6,) or (m, 6), one number for each joint of ur5e"),
    (lambda: P.Robot(R).fk(np.zeros((2, 2, 6))), V, "q has shape (2, 2, 6); expected (6,) or (m, 6)"),
    (lambda: P.Robot(R).fk(0.5), V, "q has shape (); expected (6,)"),
    (lambda: P.Robot(R).fk([np.nan] * 6), V, "q has numbers that are not finite"),
    (lambda: P.Robot(R).fk(["a"] * 6), T, "q must be numbers, not list"),
    (lambda: P.Robot(R).fk(np.zeros(6, dtype=complex)), T, "q must be numbers, not ndarray"),
    (lambda: P.Robot(R).jacobian(np.zeros(7)), V, "q has shape (7,)"),
    (lambda: P.Robot(R).clearance([[1, 2], [3]]), V, "q is no array: its rows differ in length"),
    (lambda: P.Robot(R).local_acceleration(np.zeros(6), np.zeros(5), np.zeros(6)), V, "dq has shape (5,); expected (6,), as q"),
    (lambda: P.Planner(R, "wayter"), S, "'wayter' is neither a file nor one of the names in profiles/: anti-slosh, carry, follow, tracking, tray, waiter"),
    (lambda: P.Planner(R, "my.yaml"), F, "'my.yaml'"),
    (lambda: P.Planner(R, weights={"latral": 1.0}), S, "latral"),
    (lambda: P.Planner(R, weights={"lateral": -1.0}), S, "lateral"),
    (lambda: P.Planner(R, weights={"lateral": [1.0, 2.0]}), S, "lateral"),
    (lambda: P.Planner(R, weights={"lateral": np.inf}), V, "weights['lateral'] has numbers that are not finite"),
    (lambda: P.Planner(R, weights=[1.0]), T, "weights must be a dict from names of terms to numbers, not list"),
    (lambda: P.Planner(R, solver="ipopt"), S, "realtime"),
    (lambda: P.Planner(R, horizon=0), S, "horizon is 0; it must be from 1 to 128"),
    (lambda: P.Planner(R, horizon=2.5), V, "horizon is 2.5; it must be a whole number"),
    (lambda: P.Planner(R, dt=-0.1), S, "dt is -0.1; it must be above 0"),
    (lambda: P.Planner(R, tolerance=0.0), S, "tolerance is 0; it must be above 0"),
    (lambda: P.Planner(R, velocity_scale=1.5), S, "velocity_scale is 1.5; it must be above 0, to 1"),
    (lambda: P.Planner(R).set_weights({"nothing": 1.0}), S, "nothing"),
    (lambda: P.Planner(R).reset(np.full(6, 100.0)), S, "6 numbers inside the arm's limits are expected"),
    (lambda: P.Planner(R).reset(np.zeros(3)), V, "q has shape (3,); expected (6,)"),
    (lambda: P.Planner(R).follow(np.tile(EYE, (3, 1, 1)), 0.0), V, "T_base_tool has shape (3, 4, 4); expected (8, 4, 4), a pose for each node of the horizon"),
    (lambda: P.Planner(R).update(EYE, 0.0).at([[0.0]]), V, "t has shape (1, 1); expected (m,), times in s"),
    (lambda: P.Planner(R).update(EYE, 0.0).at(np.nan), V, "t is nan; it must be finite"),
    (lambda: P.Pipeline(R, rate=0.0), S, "rate is 0 Hz; it must be from 0.001 to 1e4"),
    (lambda: P.Pipeline(R, scale=-1.0), S, "scale is -1; it must be above 0"),
    (lambda: P.Pipeline(R, rotation_frame="hand"), S, "rotation_frame is 'hand'; the frames are base, tool"),
    (lambda: P.Pipeline(R).feed(np.zeros((4, 4)), 0.0), V, "T_operator_hand is no pose"),
    (lambda: P.Pipeline(R).feed(NAN4, 0.0), V, "T_operator_hand has numbers that are not finite"),
    (lambda: P.Pipeline(R).feed(np.eye(3), 0.0), V, "T_operator_hand has shape (3, 3); expected (4, 4)"),
    (lambda: P.Pipeline(R).update("soon"), T, "t must be a number of seconds, not 'soon'"),
    (lambda: P.Retargeter(tilt=4.0), S, "tilt is 4; it must be from 0 to pi"),
    (lambda: P.Retargeter(tilt=-0.1), S, "tilt is -0.1; it must be from 0 to pi"),
    (lambda: P.Pipeline(R, glass=P.Glass()), S, "glass: profile 'tracking' knows no liquid"),
    (lambda: P.Pipeline(R, "carry", glass=(0.1, 0.2)), V, "glass has 2 numbers; it needs radius, height, fill, viscosity and frequency_factor"),
    (lambda: P.Pipeline(R, "carry", glass=P.Glass(frequency_factor=9.0)), S, "frequency_factor is 9; it must be from 0.2 to 5"),
    (lambda: P.Pipeline(R, "carry", glass=P.Glass(fill=0.2)), S, "a glass of radius 0.035 m and height 0.1 m, filled to 0.2 m"),
    (lambda: P.Pipeline(R).set_no_spill(True), S, "no_spill: the profile knows no liquid"),
    (lambda: P.Retargeter(scale=0.0), S, "scale is 0; it must be above 0"),
    (lambda: P.Retargeter(ramp=-1.0), S, "ramp is -1 s; it must be at least 0"),
    (lambda: P.Retargeter().update(EYE, 0.0, np.eye(3)), V, "T_base_tool has shape (3, 3)"),
    (lambda: P.Predictor(horizon=200), V, "horizon is 200; it must be from 1 to 128"),
    (lambda: P.Predictor(dt=0.0), V, "dt is 0; it must be above 0"),
    (lambda: P.Predictor().update(NAN4, 0.0), V, "T_base_tool has numbers that are not finite"),
    (lambda: P.Predictor().predict(None), T, "t must be a number of seconds, not None"),
    (lambda: P.Liquid(fill=0.2), V, "the fill below the height"),
    (lambda: P.Liquid().update(0.0, [0, 0, 9.81]), V, "dt is 0 s; it must be above 0, to 10"),
    (lambda: P.Liquid().update(0.1, [0, 0]), V, "local_acceleration has shape (2,); expected (3,)"),
    (lambda: P.replay("nowhere.csv"), F, "nowhere.csv: no such file"),
    (lambda: P.replay(ROOT / "README.md"), S, "README.md"),
    (lambda: P.replay(HAND, "wayter"), S, "wayter"),
    (lambda: P.replay(HAND, rate=1000), S, "rate is 1000 Hz; it must be from 1 to 500 Hz, the arm's rate"),
    (lambda: P.replay(HAND, track="feet"), S, "feet"),
    (lambda: P.replay(HAND, until=-1.0), V, "until is -1 s; it must be above 0"),
    (lambda: P.replay(HAND, start=-1.0), S, "it must start at 0 s or later"),
    (lambda: P.replay(5), T, "recording must be the path of a file, a Hand, or arrays (t, T_operator_hand)"),
    (lambda: P.replay(([0.0, 1.0], np.zeros((3, 4, 4)))), V, "T_operator_hand has shape (3, 4, 4); expected (2, 4, 4), a pose for each time"),
    (lambda: P.replay(([0.0, 0.0], np.tile(EYE, (2, 1, 1)))), S, "recording[1]"),
    (lambda: P.replay(([0.0], EYE[None])), S, "at least 2"),
    (lambda: P.read_recording("nowhere.csv"), F, "nowhere.csv: no such file"),
    (lambda: P.read_session("nowhere.mcap"), F, "nowhere.mcap"),
    (lambda: P.read_session(HAND), S, "demo-recording.json"),
    (lambda: P.solve("nowhere.json"), F, "nowhere.json: cannot be read"),
    (lambda: P.solve(ROOT / "README.md"), S, "is no JSON"),
    (lambda: P.solve(7), T, "problem must be a dict, a list of them or the path of a JSON file, not int"),
    (lambda: P.solve({}), S, "problem: 'robot' is missing"),
    (lambda: P.solve({**PROBLEM, "x0": [0.0] * 11}), S, "problem: 'x0' has 11 entries"),
    (lambda: P.solve({**PROBLEM, "x0": np.full(12, np.nan)}), S, "problem: 'x0' must be a number, not \"nan\""),
    (lambda: P.solve({**PROBLEM, "robot": "ur55"}), S, "problem: robot 'ur55' is neither"),
    (lambda: P.solve({**PROBLEM, "weights": {"latral": 1.0}}), S, "latral"),
    (lambda: P.solve({**PROBLEM, "speed": 1.0}), S, "problem: 'speed' is unknown; there are robot, dt"),
    (lambda: P.solve({**PROBLEM, "robot": object()}), T, "problem: Object of type object is not JSON serializable"),
    (lambda: P.solve([PROBLEM, {**PROBLEM, "horizon": 3}]), S, "problem[1]: 'reference' has 2 entries; it must have 3"),
    (lambda: P.solve(PROBLEM, solver="ipopt"), S, "realtime"),
    (lambda: P.pose([0, 0]), V, "p has shape (2,); expected (3,) or (m, 3)"),
    (lambda: P.pose([0, 0, 0], [1, 1, 0, 0]), V, "quat_xyzw is of length 1.41421; it must be 1"),
    # Numbers that a stage would take, and answer nonsense to.
    (lambda: P.Planner(R, dt=1e300), S, "dt is 1e+300; it must be above 0, to 10"),
    (lambda: P.Planner(R, horizon=1e300), S, "horizon is 1e+300; it must be from 1 to 128"),
    (lambda: P.Planner(R, tolerance=1e300), S, "tolerance is 1e+300; it must be above 0, to 0.1"),
    (lambda: P.Planner(R, time_budget_us=1e300), S, "time_budget_us is 1e+300; it must be from 0 to 1e9"),
    (lambda: P.Pipeline(R, rate=1e-300), S, "rate is 1e-300 Hz; it must be from 0.001 to 1e4"),
    (lambda: P.Predictor(dt=1e10), V, "dt is 1e+10; it must be above 0, to 10 s"),
    (lambda: P.Planner(R).update(EYE, 10**400), V, "t is inf; it must be finite"),
    # None and other types, for which Python or nanobind would have its own message.
    (lambda: P.Predictor(horizon=None), T, "horizon must be a number, not None"),
    (lambda: P.Predictor(window=None), T, "window must be a number of seconds, not None"),
    (lambda: P.Liquid(radius=None), T, "radius must be a number of metres, not None"),
    (lambda: P.Planner(R, objectives=5), T, "objectives must be a list of instances of steadyhand.Objective, not int"),
    (lambda: P.Planner(R, objectives=None), T, "objectives must be a list of instances of steadyhand.Objective, not NoneType"),
    (lambda: P.Planner(R, weights={None: 1.0}), T, "the name of a term must be text, not None"),
    (lambda: P.solve(PROBLEM, solver=5), T, "solver must be text, not 5"),
    (lambda: P.replay(HAND, track=5), T, "track must be text, not 5"),
    (lambda: P.read_recording(HAND, track=b"x"), T, "track must be text, not b'x'"),
    (lambda: P.Robot("\udcff.yaml"), V, "the name of the robot is '\\udcff.yaml'; it must be Unicode without null characters"),
    (lambda: P.replay("a\0b"), V, "the name of the recording is 'a\\x00b'; it must be Unicode"),
    (lambda: P.read_recording("nowhere"), F, "nowhere: no such file"),
    (lambda: P.read_session("nowhere"), F, "nowhere: cannot be read"),
    (lambda: P.Pipeline(R).feed(EYE, 0.0, "no"), T, "clutch must be True or False, not 'no'"),
    (lambda: P.Pipeline(R).feed(EYE, 0.0, np.nan), T, "clutch must be True or False, not nan"),
    (lambda: P.Planner(R).update(EYE, 0.0, 2), T, "engaged must be True or False, not 2"),
    (lambda: P.replay(([0.0, 1.0], np.tile(EYE, (2, 1, 1)), [1.0, np.nan])), V, "clutch has numbers that are not finite"),
    (lambda: P.replay(([0.0, 1.0], np.tile(EYE, (2, 1, 1)), ["yes", "no"])), T, "clutch must be numbers"),
    (lambda: P.replay(([0.0, 1.0], np.tile(EYE, (2, 1, 1)), [True])), V, "clutch has shape (1,); expected (2,), one for each time"),
    (lambda: P.Planner(R).update(np.ma.masked_equal(EYE, 0.0), 0.0), V, "T_base_tool has masked entries"),
    (lambda: P.quat_xyzw(np.eye(3)), V, "T has shape (3, 3); expected (4, 4) or (m, 4, 4)"),
]


@pytest.mark.parametrize("call, kind, said", BAD, ids=range(len(BAD)))
def test_bad_input(call, kind, said):
    with pytest.raises(kind) as refused:
        call()
    assert said in str(refused.value)


def test_of_a_long_array_the_message_names_one_entry():
    q = np.zeros((100000, 6))
    q[70000, 3] = np.nan
    with pytest.raises(ValueError, match=r"^q has numbers that are not finite: \[70000, 3\] is nan$"):
        steadyhand.Robot("ur5e").clearance(q)


def test_no_rows_give_no_rows(robot):
    none = np.zeros((0, 6))
    assert robot.fk(none).shape == (0, 4, 4) and robot.jacobian(none).shape == (0, 6, 6)
    assert robot.clearance(none).shape == (0,) and robot.body_centers(none).shape == (0, 33, 3)


def test_robots_and_results_are_pickled(robot, replay):
    again = pickle.loads(pickle.dumps(replay))
    assert again.robot.name == "ur5e" and (again.robot.fk(robot.home) == robot.fk(robot.home)).all()
    assert (again.steps.q == replay.steps.q).all() and copy.deepcopy(robot).dof == 6


def test_flags_may_be_numbers():
    arm = steadyhand.Pipeline("ur5e")
    for held in (True, np.True_, 1, 1.0, np.float64(1.0), np.array(True)):
        arm.feed(np.eye(4), 0.0, held)
        assert arm.engaged
    arm.feed(np.eye(4), 0.1, 0)
    assert not arm.engaged


def test_ctrl_c_ends_a_long_replay():
    """A thousand seconds at 500 Hz, which would take most of a minute."""
    script = """if True:
        import signal, numpy as np, steadyhand
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
        t = np.arange(0, 1000, 0.05)
        T = steadyhand.pose(np.column_stack([0.2 * np.sin(t), 0 * t, 0 * t]), np.tile([0, 0, 0, 1.0], (len(t), 1)))
        robot = steadyhand.Robot("ur5e")
        print("begins", flush=True)
        try:
            steadyhand.replay((t, T), rate=500, robot=robot)
        except KeyboardInterrupt:
            print("interrupted")"""
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE.parent)}
    running = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, env=environment)
    assert running.stdout.readline() == "begins\n"
    time.sleep(1.0)
    running.send_signal(signal.SIGINT)
    begun = time.monotonic()
    assert running.communicate(timeout=60)[0] == "interrupted\n"
    assert time.monotonic() - begun < 10.0  # and not the rest of it


def test_a_good_problem_is_solved():
    assert steadyhand.solve(PROBLEM).status == "solved"


# ---- the command


@pytest.mark.parametrize("arguments", [["--version"], ["describe", "ur5e"], ["descrbe"], ["replay", "nowhere.csv"], [], ["demo", "--port", "x"]])
def test_the_command_is_the_program(arguments, tmp_path):
    ours, theirs = package(*arguments, cwd=tmp_path), program(*arguments, cwd=tmp_path)
    assert (ours.returncode, ours.stdout, ours.stderr) == (theirs.returncode, theirs.stdout, theirs.stderr)


def test_the_version_names_the_processor():
    assert program("--version").stdout.splitlines()[::2] == [f"steadyhand {steadyhand.__version__}", f"processor {steadyhand.processor}"]


def test_what_takes_a_checkout_or_the_program_says_so(tmp_path):
    done = package("bench")
    assert (done.returncode, done.stderr) == (2, "steadyhand: 'bench' needs the sources and compilers: run ./steadyhand bench in a checkout\n")
    bare = {"PYTHONPATH": str(PACKAGE.parent), "PATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-m", "steadyhand", "demo"], capture_output=True, text=True, env=bare, timeout=60)
    assert done.returncode == 2 and done.stderr.startswith("steadyhand: this installation has the library alone")
    done = package("demo", env={"STEADYHAND_PROGRAM": "nowhere"})
    assert (done.returncode, done.stderr) == (2, "steadyhand: STEADYHAND_PROGRAM is 'nowhere': no such file\n")


# ---- help


@pytest.mark.parametrize("name", [name for name in steadyhand.__all__ if isinstance(getattr(steadyhand, name), type) or callable(getattr(steadyhand, name))])
def test_every_public_thing_is_documented_and_typed(name):
    thing = getattr(steadyhand, name)
    if name == "SteadyhandError":
        return
    assert thing.__doc__ and "object at 0x" not in thing.__doc__
    members = vars(thing).items() if isinstance(thing, type) else ()
    for member, value in members:
        if not member.startswith("_") and callable(value):
            assert value.__doc__, f"{name}.{member}"
            assert "return" in value.__annotations__, f"{name}.{member}"
    assert (PACKAGE / "py.typed").exists() and "class Stages" in (PACKAGE / "_native.pyi").read_text()


WITHOUT_EXTRAS = """
import sys
sys.modules.update(dict.fromkeys(["av", "h5py", "matplotlib", "mcap", "pandas", "pyarrow", "rerun", "scipy", "statsmodels", "yaml"]))
from steadyhand.__main__ import main
sys.exit(main())
"""


@pytest.mark.parametrize("words, code, said", [
    (["dataset", "--help"], 0, ["usage: steadyhand dataset"]),
    (["study", "--help"], 0, ["usage: steadyhand study"]),
    (["score", "--help"], 0, ["usage: steadyhand score"]),
    (["policy", "--help"], 0, ["usage: steadyhand policy"]),
    (["dataset", "a.mcap", "--out", "set"], 2, ["the extra [dataset]"]),
    (["dataset", "a.mcap", "--out", "set", "--format", "robomimic"], 2, ["the extra [dataset]"]),
    (["study", "study.yaml", "--check"], 2, ["study: ", "the extra [study]"]),
    (["study", "analyse", "out"], 2, ["the extra [study]"]),
])  # fmt: skip
def test_the_command_without_extras_names_them(tmp_path, words, code, said):
    environment = {**os.environ, "PYTHONPATH": str(Path(P.__file__).parents[1])}
    done = subprocess.run([sys.executable, "-c", WITHOUT_EXTRAS, *words], capture_output=True, text=True, cwd=tmp_path, env=environment, timeout=60)
    assert done.returncode == code and "Traceback" not in done.stderr, done.stderr
    for words in said:
        assert words in done.stdout + done.stderr
    assert not list(tmp_path.iterdir())
