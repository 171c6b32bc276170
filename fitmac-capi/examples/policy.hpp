// Stands where a policy's process would: answers queries with chunks of motions
// towards a place. A real one hands chunks over from another thread.
#ifndef POLICY_HPP
#define POLICY_HPP

#include <algorithm>

#include "fitmac.hpp"

class Policy {
 public:
  explicit Policy(fitmac::Vector3 goal_m) : goal_m_(goal_m) {}

  void ask(const fitmac::PolicyQuery& query, const fitmac::StateSample& seen) noexcept {
    chunk_ = {};
    chunk_.sequence = ++asked_;
    chunk_.session = 1;
    chunk_.observation_ns = seen.stamp_ns;
    chunk_.stamp_ns = seen.stamp_ns + 30'000'000;  // a model takes its time
    chunk_.query_id = query.query_id;
    chunk_.epoch = query.epoch;
    chunk_.subtask = query.subtask;
    chunk_.prompt_id = query.prompt_id;
    chunk_.horizon = 8;
    chunk_.action_space = FITMAC_ACTION_SPACE_OSC_POSE_DELTA;
    chunk_.frame = FITMAC_ACTION_FRAME_BASE;
    chunk_.gripper = FITMAC_GRIPPER_CONVENTION_MINUS_ONE_OPEN;
    fitmac::Vector3 at_m{seen.ee_position_m[0], seen.ee_position_m[1], seen.ee_position_m[2]};
    for (auto& action : chunk_.actions) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double share = std::clamp((goal_m_[axis] - at_m[axis]) / kUnit_m, -kSpeed, kSpeed);
        action[axis] = static_cast<float>(share);
        at_m[axis] += share * kUnit_m;
      }
      action[6] = -1.0F;
    }
    waiting_ = true;
  }

  // The answer, once it is due; nullptr until then.
  const fitmac::ActionChunk* poll(std::uint64_t now_ns) noexcept {
    if (!waiting_ || now_ns < chunk_.stamp_ns) {
      return nullptr;
    }
    waiting_ = false;
    return &chunk_;
  }

  std::uint64_t asked() const noexcept { return asked_; }

 private:
  static constexpr double kUnit_m = 0.05;  // what an action of 1 means
  static constexpr double kSpeed = 0.5;    // at most 25 mm a policy step

  fitmac::Vector3 goal_m_;
  fitmac::ActionChunk chunk_{};
  std::uint64_t asked_ = 0;
  bool waiting_ = false;
};

#endif  // POLICY_HPP
