// FIT-MAC in a 1 kHz callback in the manner of libfranka: Cartesian poses out.
//
// Prints how far the loop stays inside libfranka's Cartesian limits for the
// Panda, and how often it allocated (never). Exits with 1 if a limit is passed,
// if it allocated, or if the arm did not arrive.
#include <cmath>
#include <cstdio>
#include <iterator>

#include "counting.hpp"
#include "fitmac.hpp"
#include "franka_like.hpp"
#include "policy.hpp"
#include "transform.hpp"

namespace {

// libfranka, rate_limiting.h, and the FCI documentation's table for the Panda:
// norms of the translation.
constexpr double kVelocity_m_s = 1.7;
constexpr double kAcceleration_m_s2 = 13.0;
constexpr double kJerk_m_s3 = 6500.0;
constexpr double kPeriod_s = 1e-3;

// The largest velocity, acceleration and jerk of a series of positions, by the
// differences that the robot itself takes.
class Extremes {
 public:
  void note(const fitmac::Vector3& p) noexcept {
    const fitmac::Vector3 v = rate(p, p_, count_ > 0), a = rate(v, v_, count_ > 0);
    const fitmac::Vector3 j = rate(a, a_, count_ > 0);
    velocity = std::fmax(velocity, norm(v));
    acceleration = std::fmax(acceleration, norm(a));
    jerk = std::fmax(jerk, norm(j));
    p_ = p, v_ = v, a_ = a;
    ++count_;
  }

  double velocity = 0, acceleration = 0, jerk = 0;

 private:
  // Before the first pose the arm stands still.
  static fitmac::Vector3 rate(const fitmac::Vector3& now, const fitmac::Vector3& before,
                              bool known) noexcept {
    if (!known) {
      return {};
    }
    return {(now[0] - before[0]) / kPeriod_s, (now[1] - before[1]) / kPeriod_s,
            (now[2] - before[2]) / kPeriod_s};
  }

  static double norm(const fitmac::Vector3& v) noexcept { return std::hypot(v[0], v[1], v[2]); }

  fitmac::Vector3 p_{}, v_{}, a_{};
  unsigned count_ = 0;
};

fitmac::StateSample sample(const franka_like::RobotState& robot, std::uint64_t now_ns,
                           const fitmac::Command& last) noexcept {
  fitmac::StateSample state{};
  state.sequence = last.sequence + 1;
  state.session = 1;
  state.stamp_ns = now_ns;
  state.applied_command = last.sequence;
  std::copy(robot.q.begin(), robot.q.end(), std::begin(state.joint_position_rad));
  std::copy(robot.dq.begin(), robot.dq.end(), std::begin(state.joint_velocity_rad_s));
  const auto position = transform::position(robot.O_T_EE);
  const auto orientation = transform::orientation(robot.O_T_EE);
  std::copy(position.begin(), position.end(), std::begin(state.ee_position_m));
  std::copy(orientation.begin(), orientation.end(), std::begin(state.ee_orientation));
  state.gripper_width_m = 0.08;  // from franka::Gripper, read in another thread
  return state;                  // objects: from your perception
}

}  // namespace

int main() try {
  const fitmac::Vector3 goal_m{0.55, -0.15, 0.20};
  // Our limits hold for each axis, libfranka's for the norm: the root of three
  // lies between them.
  fitmac::Config config("guarded");
  config.set("shaping.velocity_m_s", "0.95").set("shaping.acceleration_m_s2", "7.0");
  fitmac::Controller controller(config);
  fitmac::Output output;
  Policy policy(goal_m);
  Extremes extremes;
  franka_like::Robot robot;

  std::uint64_t now_ns = 1'000'000'000;
  const unsigned long allocated_before = counting::allocations;
  robot.control([&](const franka_like::RobotState& measured, franka_like::Duration period) {
    now_ns += period.milliseconds * 1'000'000;
    const fitmac::StateSample state = sample(measured, now_ns, output.command());
    fitmac::Input input;
    input.state = &state;
    input.chunk = policy.poll(now_ns);
    const auto status = controller.tick(now_ns, input, output);
    if (output.query() != nullptr) {
      policy.ask(*output.query(), state);
    }
    const auto& command = output.command();
    const franka_like::CartesianPose pose{
        transform::from(command.setpoint_position_m, command.setpoint_orientation)};
    extremes.note(transform::position(pose.O_T_EE));
    const bool over = status != fitmac::Status::ok || measured.time.milliseconds >= 6000;
    return over ? franka_like::MotionFinished(pose) : pose;
  });
  const unsigned long allocated = counting::allocations - allocated_before;

  const auto end = transform::position(robot.readOnce().O_T_EE);
  const double missed_m = std::hypot(end[0] - goal_m[0], end[1] - goal_m[1], end[2] - goal_m[2]);
  std::printf("ticks %llu, queries %llu, mode %s\n",
              static_cast<unsigned long long>(output.command().sequence),
              static_cast<unsigned long long>(policy.asked()), name(output.mode()).c_str());
  std::printf("velocity %.3f of %.1f m/s, acceleration %.2f of %.0f m/s^2, jerk %.0f of %.0f m/s^3\n",
              extremes.velocity, kVelocity_m_s, extremes.acceleration, kAcceleration_m_s2,
              extremes.jerk, kJerk_m_s3);
  std::printf("distance to the goal %.4f m, allocations in the loop %lu\n", missed_m, allocated);
  const bool inside = extremes.velocity < kVelocity_m_s &&
                      extremes.acceleration < kAcceleration_m_s2 && extremes.jerk < kJerk_m_s3;
  const bool moved = extremes.velocity > 0.02 && missed_m < 0.01;
  return inside && moved && allocated == 0 && counting::meter_works() ? 0 : 1;
} catch (const fitmac::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
