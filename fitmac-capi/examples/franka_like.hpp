// The part of libfranka's shape that the example needs, with an arm that follows
// at once: swap it for <franka/robot.h>. Names, units and matrix layout are
// libfranka's.
#ifndef FRANKA_LIKE_HPP
#define FRANKA_LIKE_HPP

#include <array>
#include <cstdint>

namespace franka_like {

struct Duration {
  std::uint64_t milliseconds = 0;
  double toSec() const noexcept { return static_cast<double>(milliseconds) * 1e-3; }
};

struct RobotState {
  std::array<double, 16> O_T_EE{};  // measured, column-major
  std::array<double, 7> q{};        // rad
  std::array<double, 7> dq{};       // rad/s
  Duration time;
};

struct CartesianPose {
  std::array<double, 16> O_T_EE{};
  bool motion_finished = false;
};

inline CartesianPose MotionFinished(CartesianPose pose) noexcept {
  pose.motion_finished = true;
  return pose;
}

class Robot {
 public:
  RobotState readOnce() const noexcept { return state_; }

  // Calls `callback(state, period)` once a millisecond of the arm's time until
  // it answers MotionFinished.
  template <typename Callback>
  void control(Callback callback) {
    Duration period{};
    for (;;) {
      const CartesianPose goal = callback(state_, period);
      state_.O_T_EE = goal.O_T_EE;
      state_.time.milliseconds += 1;
      period.milliseconds = 1;
      if (goal.motion_finished) {
        return;
      }
    }
  }

 private:
  // The hand points down, at (0.45, 0, 0.30) m.
  RobotState state_{{1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0.45, 0, 0.30, 1},
                    {0, -0.785, 0, -2.356, 0, 1.571, 0.785},
                    {},
                    {}};
};

}  // namespace franka_like

#endif  // FRANKA_LIKE_HPP
