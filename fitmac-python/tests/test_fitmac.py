"""The package as a user meets it. Run by the crate `tests`, or by
`python -m unittest` where `fitmac` is installed."""

import unittest

import fitmac
import numpy as np
from fitmac.demo import episode
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


class KinematicsTest(unittest.TestCase):
    def test_the_jacobian_is_the_derivative_of_the_position(self):
        q = np.array([0.1, -0.7, 0.2, -2.2, 0.1, 1.6, 0.8])
        jacobian = np.array(fitmac.panda_jacobian(q))
        self.assertEqual(jacobian.shape, (6, 7))
        for joint in range(7):
            ahead, behind = q.copy(), q.copy()
            ahead[joint] += 1e-6
            behind[joint] -= 1e-6
            difference = np.subtract(fitmac.panda_forward(ahead)[0], fitmac.panda_forward(behind)[0])
            np.testing.assert_allclose(difference / 2e-6, jacobian[:3, joint], atol=1e-8)
        with self.assertRaisesRegex(ValueError, "q: joint 2"):
            fitmac.panda_forward([0, 0, float("nan"), 0, 0, 0, 0])


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
