// The shape of ros2_control's controller_interface, as far as the example needs
// it: swap it for <controller_interface/controller_interface.hpp>.
#ifndef ROS2_SHAPE_HPP
#define ROS2_SHAPE_HPP

#include <cstdint>
#include <string>
#include <vector>

namespace ros2_shape {

struct Time {
  std::int64_t ns = 0;
  std::int64_t nanoseconds() const noexcept { return ns; }
};

struct Duration {
  std::int64_t ns = 0;
  double seconds() const noexcept { return static_cast<double>(ns) * 1e-9; }
};

enum class return_type { OK, ERROR };
enum class CallbackReturn { SUCCESS, FAILURE, ERROR };

struct InterfaceConfiguration {
  std::vector<std::string> names;
};

// A number that hardware or simulation holds.
class LoanedInterface {
 public:
  explicit LoanedInterface(std::string name) : name_(std::move(name)) {}
  const std::string& get_name() const noexcept { return name_; }
  double get_value() const noexcept { return value_; }
  void set_value(double value) noexcept { value_ = value; }

 private:
  std::string name_;
  double value_ = 0;
};

class ControllerInterface {
 public:
  virtual ~ControllerInterface() = default;
  virtual InterfaceConfiguration command_interface_configuration() const = 0;
  virtual InterfaceConfiguration state_interface_configuration() const = 0;
  virtual CallbackReturn on_configure() = 0;
  virtual CallbackReturn on_activate() = 0;
  virtual CallbackReturn on_deactivate() = 0;
  virtual return_type update(const Time& time, const Duration& period) = 0;

  std::vector<LoanedInterface> command_interfaces_;
  std::vector<LoanedInterface> state_interfaces_;
};

}  // namespace ros2_shape

#endif  // ROS2_SHAPE_HPP
