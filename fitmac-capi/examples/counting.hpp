// Counts allocations of the whole process: every malloc, whoever calls it.
// (glibc; with another C library the count stays 0 and meter_works() is false.)
#ifndef COUNTING_HPP
#define COUNTING_HPP

#include <atomic>
#include <cstddef>
#include <cstdlib>

namespace counting {

inline std::atomic<unsigned long> allocations{0};

// True if an allocation of ours is counted.
inline bool meter_works() {
  const auto before = allocations.load();
  void* volatile memory = std::malloc(1);
  std::free(memory);
  return allocations.load() == before + 1;
}

}  // namespace counting

#if defined(__GLIBC__)
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) noexcept {
  counting::allocations++;
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) noexcept {
  counting::allocations++;
  return __libc_calloc(count, size);
}

void* realloc(void* memory, std::size_t size) noexcept {
  counting::allocations++;
  return __libc_realloc(memory, size);
}

int posix_memalign(void** memory, std::size_t alignment, std::size_t size) noexcept {
  counting::allocations++;
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? 12 : 0;
}

void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  counting::allocations++;
  return __libc_memalign(alignment, size);
}
}
#endif

#endif  // COUNTING_HPP
