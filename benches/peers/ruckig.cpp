// Ruckig as a peer: trajectories to a target state, in batches.
#include <algorithm>
#include <cstddef>
#include <exception>
#include <iostream>
#include <ruckig/ruckig.hpp>
#include <vector>

namespace {


template <std::size_t N>
struct Peer {
  ruckig::Ruckig<N> generator;
  std::vector<ruckig::InputParameter<N>> inputs;
  ruckig::Trajectory<N> trajectory;

  Peer(const double* problems, std::size_t count) : inputs(count) {
    for (auto& input : inputs) {
      for (auto* row : {&input.current_position, &input.current_velocity,
                        &input.current_acceleration, &input.target_position,
                        &input.target_velocity, &input.max_velocity, &input.max_acceleration,
                        &input.max_jerk}) {
        std::copy_n(problems, N, row->begin());
        problems += N;
      }
    }
  }
};

template <std::size_t N>
void* open(const double* problems, std::size_t count) try {
  return new Peer<N>(problems, count);
} catch (const std::exception& error) {
  std::cerr << "Ruckig: " << error.what() << '\n';
  return nullptr;
}

template <std::size_t N>
void plan(void* opened) {
  auto& peer = *static_cast<Peer<N>*>(opened);
  for (const auto& input : peer.inputs) {
    peer.generator.calculate(input, peer.trajectory);
    asm volatile("" : : "r"(&peer) : "memory");  // every result counts as used
  }
}

template <std::size_t N>
void durations(void* opened, double* out) {
  auto& peer = *static_cast<Peer<N>*>(opened);
  for (const auto& input : peer.inputs) {
    const auto result = peer.generator.calculate(input, peer.trajectory);
    *out++ = result == ruckig::Result::Working ? peer.trajectory.get_duration() : -1.0;
  }
}

}  // namespace

// The planners of `count` problems of 3 and of 7 axes.
extern "C" void* peer_open_3(const double* problems, std::size_t count) {
  return open<3>(problems, count);
}
extern "C" void* peer_open_7(const double* problems, std::size_t count) {
  return open<7>(problems, count);
}

// Plans every problem once.
extern "C" void peer_plan_3(void* opened) { plan<3>(opened); }
extern "C" void peer_plan_7(void* opened) { plan<7>(opened); }

// Durations in seconds; -1 where there is no trajectory.
extern "C" void peer_durations_3(void* opened, double* out) { durations<3>(opened, out); }
extern "C" void peer_durations_7(void* opened, double* out) { durations<7>(opened, out); }
