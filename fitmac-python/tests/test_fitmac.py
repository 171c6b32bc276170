"""The package as a user meets it. Run by the crate `tests`, or by
`python -m unittest` where `fitmac` is installed."""

import json
import pathlib
import tempfile
import unittest

import fitmac
import numpy as np
from fitmac import kinematics
from fitmac.demo import episode
from fitmac.report import wilson
from fitmac.toy import ToyEnv, ToyPolicy

TASK = fitmac.Task(target="can", destination="plate")


def wrapped(policy, task=TASK, config=None):
    return fitmac.wrap(policy, ToyEnv(), poses=lambda env, _: env.poses(), task=task, config=config)


class ConfigTest(unittest.TestCase):
    def test_settings_may_be_keys_or_tables(self):
        by_key = fitmac.Config(settings={"gate.failure_streak": 4, "switches.hard_pick": False})
        by_table = fitmac.Config(settings={"gate": {"failure_streak": 4},
                                           "switches": {"hard_pick": False}})
        self.assertEqual(by_key, by_table)
        self.assertNotEqual(by_key, fitmac.Config())
        self.assertEqual(fitmac.Config("paper"), fitmac.Config(settings={"profile": "paper"}))

    def test_errors_name_the_parameter(self):
        for settings, kind, says in (
            ({"gate.failure_streek": 3}, KeyError, "gate.failure_streek"),
            ({"gate.failure_streak": "three"}, TypeError, "gate.failure_streak"),
            ({"gate.failure_streak": [3]}, TypeError, "gate.failure_streak"),
            ({"gate.failure_streak": 0, "gate.confidence": float("nan")}, ValueError,
             "gate.failure_streak.*gate.confidence"),
            ({"profile": "brave"}, ValueError, "profile.*guarded"),
        ):
            with self.subTest(settings), self.assertRaisesRegex(kind, says):
                fitmac.Config(settings=settings)

    def test_every_parameter_has_a_reference(self):
        table = fitmac.Config.parameters()
        self.assertGreater(len(table), 80)
        for row in table:
            self.assertTrue(row["min"] <= row["default"] <= row["max"], row["key"])
            fitmac.Config(settings={row["key"]: int(row["default"])
                                    if float(row["default"]).is_integer() else row["default"]})


class MessageTest(unittest.TestCase):
    def test_fields_are_words_arrays_and_numbers(self):
        state = fitmac.message("StateSample", ee_position_m=[0.4, 0, 0.3], gripper_width_m=0.08)
        self.assertEqual(state.ee_position_m.dtype, np.float64)
        self.assertEqual(state.ee_position_m.tolist(), [0.4, 0.0, 0.3])
        record = fitmac.message("GroundingRecord", relation="in", destination_kind="direct")
        self.assertEqual((record.relation, record.as_dict()["destination_kind"]), ("in", "direct"))
        again = fitmac.Message("GroundingRecord", record.to_bytes())
        self.assertEqual(again, record)

    def test_errors_name_the_field(self):
        for fields, kind, says in (
            ({"ee_position_m": [1, 2]}, ValueError, "StateSample.ee_position_m.*shape"),
            ({"ee_position_m": "here"}, ValueError, "StateSample.ee_position_m"),
            ({"sequence": -1}, ValueError, "StateSample.sequence"),
            ({"position": 1}, AttributeError, "StateSample.*position"),
        ):
            with self.subTest(fields), self.assertRaisesRegex(kind, says):
                fitmac.message("StateSample", **fields)
        with self.assertRaisesRegex(ValueError, "PlaceRelation has no 'under'; it has on, in"):
            fitmac.message("GroundingRecord", relation="under")
        with self.assertRaisesRegex(ValueError, "StateSample"):
            fitmac.message("Sample")


class ControllerTest(unittest.TestCase):
    def test_a_tick_without_a_state_holds_and_says_why(self):
        output = fitmac.Controller().tick(1_000_000)
        self.assertEqual(output.command.mode, "hold")
        self.assertIn("no_state", output.command.reasons)
        self.assertIsNone(output.query)

    def test_a_snapshot_continues_as_if_nothing_had_been(self):
        controller = fitmac.Controller()
        controller.tick(1_000_000)
        snapshot = controller.snapshot()
        first = controller.tick(2_000_000).command
        controller.tick(9_000_000)
        controller.restore(snapshot)
        self.assertEqual(controller.tick(2_000_000).command, first)
        controller.reset()
        self.assertEqual(controller.tick(1_000_000).command.sequence, 1)

    def test_wrong_arguments_raise(self):
        controller = fitmac.Controller()
        with self.assertRaisesRegex(ValueError, "StateSample has"):
            controller.tick(1, fitmac.message("Plan"))
        with self.assertRaisesRegex(ValueError, "Request has no 'go'"):
            controller.tick(1, request="go")
        with self.assertRaises(OverflowError):
            controller.tick(-1)


    def test_a_snapshot_of_other_parameters_is_refused(self):
        other = fitmac.Controller(fitmac.Config("paper")).snapshot()
        with self.assertRaisesRegex(ValueError, "other parameters"):
            fitmac.Controller().restore(other)


class KinematicsTest(unittest.TestCase):
    def test_the_jacobian_is_the_derivative_of_the_position(self):
        q = np.array([0.1, -0.7, 0.2, -2.2, 0.1, 1.6, 0.8])
        jacobian = kinematics.jacobian(q)
        self.assertEqual(jacobian.shape, (6, 7))
        for joint in range(7):
            ahead, behind = q.copy(), q.copy()
            ahead[joint] += 1e-6
            behind[joint] -= 1e-6
            both = kinematics.forward(np.array([ahead, behind])).position_m
            difference = both[0] - both[1]
            np.testing.assert_allclose(difference / 2e-6, jacobian[:3, joint], atol=1e-8)
        with self.assertRaisesRegex(ValueError, "q: joint 2"):
            kinematics.forward([0, 0, float("nan"), 0, 0, 0, 0])
        with self.assertRaisesRegex(ValueError, r"q: its shape is \(6,\)"):
            kinematics.jacobian([0] * 6)

    def test_the_inverse_comes_back_to_where_forward_was(self):
        q = np.array([0.3, -0.5, 0.1, -2.0, 0.2, 1.7, 0.5])
        pose = kinematics.forward(q)
        np.testing.assert_allclose(np.linalg.det(pose.matrix()[:3, :3]), 1.0, atol=1e-12)
        found = kinematics.inverse(pose)
        self.assertTrue(found.reached)
        self.assertTrue(np.all((kinematics.LOWER <= found.q) & (found.q <= kinematics.UPPER)))
        again = kinematics.forward(found.q)
        np.testing.assert_allclose(again.position_m, pose.position_m, atol=2e-6)
        far = kinematics.Pose(np.array([2.0, 0.0, 0.0]), pose.orientation)
        self.assertIsNone(kinematics.inverse(far))
        for bad, says in (
            (kinematics.Pose(np.full(3, np.nan), pose.orientation), "target"),
            (kinematics.Pose(pose.position_m, np.zeros(4)), "orientation"),
            (kinematics.Pose(pose.position_m, np.zeros(3)), "orientation.*shape"),
        ):
            with self.subTest(says), self.assertRaisesRegex(ValueError, says):
                kinematics.inverse(bad)

    def test_a_motion_keeps_its_limits_and_arrives(self):
        limits = {"velocity_max": [1.0, 2.0], "acceleration_max": [2.0, 2.0],
                  "jerk_max": [10.0, 10.0]}
        motion = kinematics.plan([0.0, 1.0], [0.5, -1.0], **limits)
        self.assertTrue(motion.synchronised)
        times = np.linspace(0.0, motion.duration_s, 200)
        position, velocity, acceleration = motion.at(times)
        self.assertEqual(position.shape, (200, 2))
        np.testing.assert_allclose(position[0], [0.0, 1.0], atol=1e-12)
        np.testing.assert_allclose(position[-1], [0.5, -1.0], atol=1e-9)
        self.assertTrue(np.all(np.abs(velocity) <= np.array([1.0, 2.0]) + 1e-9))
        self.assertTrue(np.all(np.abs(acceleration) <= 2.0 + 1e-9))
        np.testing.assert_allclose(np.gradient(position[:, 1], times)[1:-1], velocity[1:-1, 1],
                                   atol=2e-3)
        for arguments, says in (
            (([0.0] * 13, [0.0] * 13), "1 to 12 axes"),
            (([0.0, 0.0], [0.0]), r"target: its shape is \(1,\)"),
        ):
            with self.subTest(says), self.assertRaisesRegex(ValueError, says):
                kinematics.plan(*arguments, **limits)
        with self.assertRaisesRegex(ValueError, "from 0 on"):
            motion.at(-1.0)
        with self.assertRaises(ValueError):
            kinematics.plan([0.0], [1.0], velocity_max=[0.0], acceleration_max=[1.0], jerk_max=[1])


EPISODE = {
    "schema": 1, "suite": "object", "task": "milk", "perturbation": "pos", "level": "standard",
    "backbone": "openvla-like", "config": "full", "profile": "guarded", "perception": "truth",
    "knowledge": "agents", "seed": 7, "episode": 0, "success": True, "intervened": True,
}


class ReportTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, *episodes, end="\n"):
        lines = "\n".join(json.dumps({**EPISODE, **episode}) for episode in episodes)
        (self.folder / "episodes-0-of-1.jsonl").write_text(lines + end)

    def test_rates_are_those_of_the_paper(self):
        self.write(*({"episode": i, "success": i % 2 == 0, "intervened": i < 4} for i in range(10)),
                   {"config": "base", "success": False, "intervened": False})
        results = fitmac.read_results(self.folder)
        self.assertEqual(len(results), 11)
        full, base = results.rates(by=("config",))
        self.assertEqual((full.sr.value, full.ir.value, full.rsr.value), (0.5, 0.4, 0.5))
        self.assertEqual((full.rsr.of, base.rsr.value, str(base.rsr)), (4, None, "-"))
        frame = results.rates_frame(by=("config",))
        self.assertEqual(frame["episodes"].tolist(), [10, 1])
        self.assertEqual(results.frame()["success"].sum(), 5)
        self.assertEqual(len(results.where(config="base")), 1)
        with self.assertRaisesRegex(ValueError, "no field 'robot'"):
            results.rates(by=("robot",))

    def test_intervals_are_wilsons(self):
        # Newcombe 1998, Statistics in Medicine 17, table I, method 3.
        for (k, n), expected in (((81, 263), (0.2553, 0.3662)), ((15, 148), (0.0624, 0.1605)),
                                 ((0, 20), (0.0, 0.1611)), ((1, 29), (0.0061, 0.1718))):
            np.testing.assert_allclose(wilson(k, n), expected, atol=5e-5)
        self.assertEqual(wilson(0, 0), (0.0, 1.0))

    def test_a_half_line_and_repetitions_are_left_out(self):
        self.write({}, {}, {"episode": 1}, end='\n{"suite": "obj')
        self.assertEqual(len(fitmac.read_results(self.folder)), 2)

    def test_errors_name_line_and_field(self):
        for episode, says in (
            ({"schema": 2}, "line 1: schema is 2"),
            ({"success": 1}, "line 1: success is 1, not a bool"),
            ({"seed": True}, "line 1: seed is True, not a int"),
        ):
            self.write(episode)
            with self.subTest(says), self.assertRaisesRegex(ValueError, says):
                fitmac.read_results(self.folder)
        (self.folder / "episodes-0-of-1.jsonl").write_text("{}\nnot json\n")
        with self.assertRaisesRegex(ValueError, "line 1: schema"):
            fitmac.read_results(self.folder)
        with self.assertRaisesRegex(FileNotFoundError, "jsonl"):
            fitmac.read_results(self.folder / "nowhere", tempfile.mkdtemp(dir=self.folder))


class WrapTest(unittest.TestCase):
    def test_a_competent_policy_keeps_the_arm(self):
        run = wrapped(ToyPolicy()).run(seed=1)
        self.assertTrue(run.success)
        self.assertEqual(run.interventions(), 0)

    def test_a_wrong_target_is_corrected_and_recorded(self):
        run = wrapped(ToyPolicy(target="soup")).run(max_steps=600, seed=1)
        self.assertTrue(run.success)
        self.assertGreater(run.interventions(), 0)
        frame = run.frame()
        self.assertEqual(len(frame), len(run.records))
        self.assertIn("target_correction", set(frame["route"]))
        self.assertIn("wrong_target", {word for words in frame["evidence"] for word in words})

    def test_runs_are_reproducible(self):
        first, second = (episode(ToyPolicy(stall_m=0.05), 7, fitmac.Config()) for _ in range(2))
        self.assertEqual(first.records, second.records)

    def test_errors_name_what_is_wrong(self):
        with self.assertRaisesRegex(ValueError, "task.target: there is no 'cup' among can"):
            wrapped(ToyPolicy(), fitmac.Task(target="cup", destination="plate")).run(seed=1)
        with self.assertRaisesRegex(ValueError, r"policy: .*shape \(1, 3\)"):
            wrapped(lambda observation, prompt: [0, 0, 0]).run(seed=1)
        with self.assertRaisesRegex(TypeError, "env must have reset"):
            fitmac.wrap(ToyPolicy(), object(), poses=lambda e, o: None, task=TASK)


if __name__ == "__main__":
    unittest.main()
