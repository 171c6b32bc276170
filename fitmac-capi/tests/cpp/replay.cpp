// Feeds recorded inputs to the core through fitmac.hpp and writes down every
// answer, byte for byte. Usage: replay INPUTS OUTPUTS
//
// A record of INPUTS is now_ns, the request and the contents (u64 each), then
// the messages whose bits are set; one of OUTPUTS is the contents, the command,
// then the messages whose bits are set.
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <vector>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include "../../examples/counting.hpp"
#include "fitmac.hpp"

namespace {

template <typename T>
const T* take(const unsigned char*& at, std::uint64_t contents, unsigned bit, T& place) {
  if ((contents >> bit & 1) == 0) {
    return nullptr;
  }
  std::memcpy(&place, at, sizeof place);
  at += sizeof place;
  return &place;
}

template <typename T>
void put(unsigned char*& at, const T* message) {
  if (message != nullptr) {
    std::memcpy(at, message, sizeof *message);
    at += sizeof *message;
  }
}

}  // namespace

int main(int count, char** arguments) try {
  if (count != 3) {
    std::fprintf(stderr, "usage: replay INPUTS OUTPUTS\n");
    return 2;
  }
  std::ifstream in(arguments[1], std::ios::binary);
  const std::vector<unsigned char> inputs{std::istreambuf_iterator<char>(in), {}};
  std::vector<unsigned char> outputs(64U << 20);
  fitmac::Controller controller;
  fitmac::Output output;
  fitmac::StateSample state;
  fitmac::ActionChunk chunk;
  fitmac::GroundingRecord grounding;
  fitmac::Plan plan;
  fitmac::VerifierReport verifier;
  fitmac::CriticReport critic;
#if defined(__x86_64__)
  _mm_setcsr(_mm_getcsr() | 0x8040);  // a host that flushes subnormals
#endif

  const unsigned long allocated_before = counting::allocations;
  const unsigned char* at = inputs.data();
  unsigned char* to = outputs.data();
  unsigned long ticks = 0;
  while (at < inputs.data() + inputs.size()) {
    if (to + 4096 > outputs.data() + outputs.size()) {
      std::fprintf(stderr, "more outputs than there is room for\n");
      return 1;
    }
    std::uint64_t head[3];
    std::memcpy(head, at, sizeof head);
    at += sizeof head;
    fitmac::Input input;
    input.request = static_cast<fitmac::Request>(head[1]);
    input.state = take(at, head[2], 0, state);
    input.chunk = take(at, head[2], 1, chunk);
    input.grounding = take(at, head[2], 2, grounding);
    input.plan = take(at, head[2], 3, plan);
    input.verifier = take(at, head[2], 4, verifier);
    input.critic = take(at, head[2], 5, critic);
    const auto status = controller.tick(head[0], input, output);
    if (status != fitmac::Status::ok) {
      std::fprintf(stderr, "tick %lu: %s\n", ticks, fitmac::text(status));
      return 1;
    }
    if (ticks++ % 100 == 0) {  // a snapshot and its return change nothing
      if (controller.restore(controller.snapshot()) != fitmac::Status::ok) {
        return 1;
      }
    }
    const std::uint64_t contents =
        (output.query() != nullptr ? 1U : 0U) | (output.rebind() != nullptr ? 2U : 0U) |
        (output.trace() != nullptr ? 4U : 0U) | (output.event() != nullptr ? 8U : 0U);
    put(to, &contents);
    put(to, &output.command());
    put(to, output.query());
    put(to, output.rebind());
    put(to, output.trace());
    put(to, output.event());
  }
  const unsigned long allocated = counting::allocations - allocated_before;
  const unsigned float_state = output.float_state();
#if defined(__x86_64__)
  _mm_setcsr(_mm_getcsr() & ~0x8040U);
  const bool told = float_state == (FITMAC_FLOAT_FLUSH_TO_ZERO | FITMAC_FLOAT_DENORMALS_ZERO);
#else
  const bool told = float_state == 0;
#endif
  std::ofstream out(arguments[2], std::ios::binary);
  out.write(reinterpret_cast<const char*>(outputs.data()), to - outputs.data());
  std::printf("ticks %lu, allocations %lu\n", ticks, allocated);
  return out.good() && allocated == 0 && told && counting::meter_works() ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
