// FIT-MAC as a controller in the shape of ros2_control: update(time, period).
//
// The tool centre point's pose comes in by state interfaces, its setpoint and
// the gripper's go out by command interfaces. A small manager runs it at 250 Hz.
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "counting.hpp"
#include "fitmac.hpp"
#include "policy.hpp"
#include "ros2_shape.hpp"

using namespace ros2_shape;

class FitmacController : public ControllerInterface {
 public:
  explicit FitmacController(fitmac::Vector3 goal_m) : policy_(goal_m) {}

  InterfaceConfiguration command_interface_configuration() const override {
    InterfaceConfiguration all = pose_names();
    all.names.push_back("gripper/position");
    return all;
  }

  InterfaceConfiguration state_interface_configuration() const override {
    return command_interface_configuration();
  }

  // Not in the loop: this may throw, allocate and take its time.
  CallbackReturn on_configure() override {
    try {
      fitmac::Config config;
      config.set("clock.settle_steps", "4").check();  // your parameters go here
      controller_.emplace(config);
      return CallbackReturn::SUCCESS;
    } catch (const fitmac::Error& error) {
      std::fprintf(stderr, "%s\n", error.what());
      return CallbackReturn::ERROR;
    }
  }

  CallbackReturn on_activate() override {
    output_ = {};
    return controller_->reset() == fitmac::Status::ok ? CallbackReturn::SUCCESS
                                                      : CallbackReturn::ERROR;
  }

  CallbackReturn on_deactivate() override { return CallbackReturn::SUCCESS; }

  return_type update(const Time& time, const Duration&) override {
    const auto now_ns = static_cast<std::uint64_t>(time.nanoseconds());
    read_state(now_ns);
    fitmac::Input input;
    input.state = &state_;
    input.chunk = policy_.poll(now_ns);
    if (controller_->tick(now_ns, input, output_) != fitmac::Status::ok) {
      return return_type::ERROR;
    }
    if (output_.query() != nullptr) {
      policy_.ask(*output_.query(), state_);
    }
    write_command();
    return return_type::OK;
  }

  const fitmac::Output& output() const noexcept { return output_; }

 private:
  static InterfaceConfiguration pose_names() {
    return {{"tcp/position.x", "tcp/position.y", "tcp/position.z", "tcp/orientation.w",
             "tcp/orientation.x", "tcp/orientation.y", "tcp/orientation.z"}};
  }

  void read_state(std::uint64_t now_ns) noexcept {
    state_.sequence += 1;
    state_.session = 1;
    state_.stamp_ns = now_ns;
    state_.applied_command = output_.command().sequence;
    for (int i = 0; i < 3; ++i) {
      state_.ee_position_m[i] = state_interfaces_[i].get_value();
    }
    for (int i = 0; i < 4; ++i) {
      state_.ee_orientation[i] = state_interfaces_[3 + i].get_value();
    }
    state_.gripper_width_m = state_interfaces_[7].get_value();
  }

  void write_command() noexcept {
    const auto& command = output_.command();
    for (int i = 0; i < 3; ++i) {
      command_interfaces_[i].set_value(command.setpoint_position_m[i]);
    }
    for (int i = 0; i < 4; ++i) {
      command_interfaces_[3 + i].set_value(command.setpoint_orientation[i]);
    }
    command_interfaces_[7].set_value(command.action[6] < 0 ? 0.08 : 0.0);
  }

  std::optional<fitmac::Controller> controller_;
  fitmac::Output output_;
  fitmac::StateSample state_{};
  Policy policy_;
};

int main() {
  const fitmac::Vector3 goal_m{0.40, 0.20, 0.25};
  FitmacController controller(goal_m);
  for (const auto& name : controller.command_interface_configuration().names) {
    controller.command_interfaces_.emplace_back(name);
  }
  for (const auto& name : controller.state_interface_configuration().names) {
    controller.state_interfaces_.emplace_back(name);
  }
  const std::array<double, 8> start{0.45, 0.0, 0.30, 0.0, 1.0, 0.0, 0.0, 0.08};
  for (std::size_t i = 0; i < start.size(); ++i) {
    controller.state_interfaces_[i].set_value(start[i]);
  }
  if (controller.on_configure() != CallbackReturn::SUCCESS ||
      controller.on_activate() != CallbackReturn::SUCCESS) {
    return 1;
  }
  const unsigned long allocated_before = counting::allocations;
  Time time{1'000'000'000};
  const Duration period{4'000'000};
  for (int cycle = 0; cycle < 1500; ++cycle) {
    time.ns += period.ns;
    if (controller.update(time, period) != return_type::OK) {
      return 1;
    }
    for (std::size_t i = 0; i < start.size(); ++i) {  // hardware that follows at once
      controller.state_interfaces_[i].set_value(controller.command_interfaces_[i].get_value());
    }
  }
  const unsigned long allocated = counting::allocations - allocated_before;
  controller.on_deactivate();

  double squares = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    squares += std::pow(controller.state_interfaces_[i].get_value() - goal_m[i], 2);
  }
  std::printf("cycles %llu, mode %s, distance to the goal %.4f m, allocations in update %lu\n",
              static_cast<unsigned long long>(controller.output().command().sequence),
              name(controller.output().mode()).c_str(), std::sqrt(squares), allocated);
  return std::sqrt(squares) < 0.01 && allocated == 0 && counting::meter_works() ? 0 : 1;
}
