// fitmac.hpp - the FIT-MAC decision core for C++17, header only over fitmac.h.
//
// Value types: a Config is a value, a Controller owns its memory inside itself,
// a Snapshot is a value. Nothing here allocates. What is wrong with a call is
// thrown as fitmac::Error, except in Controller::tick and the other functions
// marked noexcept, which answer with a Status: a control callback must not
// throw.
//
// FIT-MAC is not a safety function: keep the robot's own stops in place.
#ifndef FITMAC_HPP
#define FITMAC_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "fitmac.h"

namespace fitmac {

// The messages, as fitmac.h documents them; `T{}` is all zero.
using ObjectId = fitmac_object_id;
using ObjectSample = fitmac_object_sample;
using ActionChunk = fitmac_action_chunk;
using Candidate = fitmac_candidate;
using Plan = fitmac_plan;
using VerifierReport = fitmac_verifier_report;
using CriticReport = fitmac_critic_report;
using Command = fitmac_command;
using PolicyQuery = fitmac_policy_query;
using RebindRequest = fitmac_rebind_request;
using TraceRecord = fitmac_trace_record;
using GroundingRecord = fitmac_grounding_record;
using StateSample = fitmac_state_sample;

using Vector3 = std::array<double, 3>;
// (w, x, y, z), unit.
using Quaternion = std::array<double, 4>;

// What a call answers.
enum class Status : std::uint32_t {
  ok = FITMAC_STATUS_OK,
  null_pointer = FITMAC_STATUS_NULL_POINTER,
  misaligned = FITMAC_STATUS_MISALIGNED,
  wrong_size = FITMAC_STATUS_WRONG_SIZE,
  wrong_version = FITMAC_STATUS_WRONG_VERSION,
  not_initialised = FITMAC_STATUS_NOT_INITIALISED,
  busy = FITMAC_STATUS_BUSY,
  forked = FITMAC_STATUS_FORKED,
  panicked = FITMAC_STATUS_PANICKED,
  unknown_key = FITMAC_STATUS_UNKNOWN_KEY,
  bad_value = FITMAC_STATUS_BAD_VALUE,
  bad_syntax = FITMAC_STATUS_BAD_SYNTAX,
  out_of_range = FITMAC_STATUS_OUT_OF_RANGE,
};

// What a status means; the text lives as long as the program.
inline const char* text(Status status) noexcept {
  return ::fitmac_status_text(static_cast<std::uint32_t>(status));
}

enum class Mode : std::uint8_t {
  normal = FITMAC_MODE_NORMAL,
  warn = FITMAC_MODE_WARN,
  hold = FITMAC_MODE_HOLD,
  stop = FITMAC_MODE_STOP,
};

enum class Route : std::uint8_t {
  base = FITMAC_ROUTE_BASE,
  execution_correction = FITMAC_ROUTE_EXECUTION_CORRECTION,
  target_correction = FITMAC_ROUTE_TARGET_CORRECTION,
  pending_correction = FITMAC_ROUTE_PENDING_CORRECTION,
};

enum class Phase : std::uint8_t {
  approach = FITMAC_PHASE_APPROACH,
  grasp = FITMAC_PHASE_GRASP,
  lift = FITMAC_PHASE_LIFT,
  transport = FITMAC_PHASE_TRANSPORT,
  descend = FITMAC_PHASE_DESCEND,
  release = FITMAC_PHASE_RELEASE,
  stabilise = FITMAC_PHASE_STABILISE,
  complete = FITMAC_PHASE_COMPLETE,
};

enum class Request : std::uint8_t {
  none = FITMAC_REQUEST_NONE,
  stop = FITMAC_REQUEST_STOP,
  reset = FITMAC_REQUEST_RESET,
};

// A code or a bit's number in words; empty for one that has none.
inline std::string name(fitmac_vocabulary vocabulary, std::uint32_t code) {
  char text[64];
  const auto status = ::fitmac_name(static_cast<std::uint32_t>(vocabulary), code, text, sizeof text);
  return status == FITMAC_STATUS_OK ? std::string(text) : std::string();
}

inline std::string name(Mode mode) {
  return name(FITMAC_VOCABULARY_MODE, static_cast<std::uint32_t>(mode));
}
inline std::string name(Route route) {
  return name(FITMAC_VOCABULARY_ROUTE, static_cast<std::uint32_t>(route));
}
inline std::string name(Phase phase) {
  return name(FITMAC_VOCABULARY_PHASE, static_cast<std::uint32_t>(phase));
}

// A call that was wrong.
class Error : public std::runtime_error {
 public:
  Error(Status status, const std::string& what)
      : std::runtime_error(what + ": " + text(status)), status_(status) {}

  Status status() const noexcept { return status_; }

 private:
  Status status_;
};

namespace detail {

inline void require(fitmac_status status, const char* what) {
  if (status != FITMAC_STATUS_OK) {
    throw Error(static_cast<Status>(status), what);
  }
}

}  // namespace detail

// Parameters. A value: copies are independent.
class Config {
 public:
  // "guarded" (do no harm) or "paper" (as published).
  explicit Config(const char* profile = "guarded") {
    fitmac_config* made = nullptr;
    const auto status = ::fitmac_config_init(storage_, sizeof storage_, profile, &made);
    if (status != FITMAC_STATUS_OK) {
      throw Error(static_cast<Status>(status), std::string("profile ") + profile);
    }
  }

  // Sets one parameter: set("gate.failure_streak", "3").
  Config& set(const char* key, const char* value) {
    const auto status = ::fitmac_config_set(get(), key, value);
    if (status != FITMAC_STATUS_OK) {
      throw Error(static_cast<Status>(status), std::string(key) + " = " + value);
    }
    return *this;
  }

  // Reads the text of a configuration file over what is set.
  Config& parse(std::string_view text) {
    std::uint32_t line = 0;
    const auto status = ::fitmac_config_parse(get(), text.data(), text.size(), &line);
    if (status != FITMAC_STATUS_OK) {
      throw Error(static_cast<Status>(status), "configuration, line " + std::to_string(line));
    }
    return *this;
  }

  // Throws an Error that names every parameter that does not hold.
  void check() const {
    char names[2048];
    const auto status = ::fitmac_config_check(get(), names, sizeof names);
    if (status != FITMAC_STATUS_OK) {
      throw Error(static_cast<Status>(status), names);
    }
  }

  const fitmac_config* get() const noexcept {
    return reinterpret_cast<const fitmac_config*>(storage_);
  }

 private:
  fitmac_config* get() noexcept { return reinterpret_cast<fitmac_config*>(storage_); }

  alignas(16) unsigned char storage_[FITMAC_CONFIG_STORAGE];
};

// Everything that arrived since the last tick; nullptr means nothing new.
struct Input {
  const StateSample* state = nullptr;
  const ActionChunk* chunk = nullptr;
  const GroundingRecord* grounding = nullptr;
  const Plan* plan = nullptr;
  const VerifierReport* verifier = nullptr;
  const CriticReport* critic = nullptr;
  Request request = Request::none;
};

// The answer to one tick: a value.
class Output {
 public:
  Output() noexcept { std::memset(&raw_, 0, sizeof raw_); }

  const Command& command() const noexcept { return raw_.command; }
  Mode mode() const noexcept { return static_cast<Mode>(raw_.command.mode); }
  Route route() const noexcept { return static_cast<Route>(raw_.command.route); }
  Phase phase() const noexcept { return static_cast<Phase>(raw_.command.phase); }

  // nullptr where the tick has none.
  const PolicyQuery* query() const noexcept { return raw_.has_query != 0 ? &raw_.query : nullptr; }
  const RebindRequest* rebind() const noexcept {
    return raw_.has_rebind != 0 ? &raw_.rebind : nullptr;
  }
  const TraceRecord* trace() const noexcept { return raw_.has_trace != 0 ? &raw_.trace : nullptr; }
  const TraceRecord* event() const noexcept { return raw_.has_event != 0 ? &raw_.event : nullptr; }

  // How the host computes that is not IEEE 754's default: FITMAC_FLOAT_*.
  std::uint32_t float_state() const noexcept { return raw_.float_state; }

 private:
  friend class Controller;
  fitmac_output raw_;
};

class Controller;

// What a controller remembers: a value, of this process only.
class Snapshot {
 private:
  friend class Controller;
  Snapshot() = default;
  alignas(16) unsigned char storage_[FITMAC_SNAPSHOT_STORAGE];
};

// Watches the policy and decides who acts. It holds its memory itself (32 KiB)
// and has no copy and no move: take a snapshot.
class Controller {
 public:
  // Throws an Error that names every parameter that does not hold.
  explicit Controller(const Config& config = Config()) {
    config.check();
    detail::require(::fitmac_controller_init(storage_, sizeof storage_, FITMAC_ABI_VERSION,
                                             config.get(), &handle_),
                    "the controller");
  }

  ~Controller() { ::fitmac_controller_deinit(handle_); }

  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  // Decides one control tick at `now_ns` of a monotonic clock. Anything but
  // Status::ok means that nothing was decided: stop the robot.
  [[nodiscard]] Status tick(std::uint64_t now_ns, const Input& input, Output& output) noexcept {
    fitmac_input raw{};
    raw.struct_size = sizeof raw;
    raw.state = input.state;
    raw.chunk = input.chunk;
    raw.grounding = input.grounding;
    raw.plan = input.plan;
    raw.verifier = input.verifier;
    raw.critic = input.critic;
    raw.request = static_cast<std::uint8_t>(input.request);
    output.raw_.struct_size = sizeof output.raw_;
    return static_cast<Status>(::fitmac_tick(handle_, now_ns, &raw, &output.raw_));
  }

  // As new: forgets everything but its parameters.
  [[nodiscard]] Status reset() noexcept { return static_cast<Status>(::fitmac_reset(handle_)); }

  Snapshot snapshot() const {
    Snapshot taken;
    detail::require(::fitmac_take_snapshot(handle_, taken.storage_, sizeof taken.storage_),
                    "the snapshot");
    return taken;
  }

  // Goes on from a snapshot of a controller with the same parameters.
  [[nodiscard]] Status restore(const Snapshot& snapshot) noexcept {
    return static_cast<Status>(
        ::fitmac_restore(handle_, snapshot.storage_, sizeof snapshot.storage_));
  }

 private:
  fitmac_controller* handle_ = nullptr;
  alignas(16) unsigned char storage_[FITMAC_CONTROLLER_STORAGE];
};

static_assert(std::is_trivially_copyable_v<Config> && std::is_trivially_copyable_v<Snapshot>);

}  // namespace fitmac

#endif  // FITMAC_HPP
