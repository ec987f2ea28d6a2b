#pragma once

/// @file
/// The newest value from one thread for another, without either waiting for the other.

#include <array>
#include <atomic>
#include <cstdint>

namespace jackal_aic {

/// Three slots: one is written, one is read, one is in transit. For one writing and one reading thread. Neither side
/// locks or allocates; a value that was not read before the next was written is lost.
template <class T>
class Latest {
 public:
  /// @param initial value of all slots, so that values of its size need no allocation.
  explicit Latest(const T& initial = {}) : slots_{initial, initial, initial} {}

  /// Hands a value over.
  void write(const T& value) {
    slots_[writing_] = value;
    writing_ = between_.exchange(writing_ | kNew, std::memory_order_acq_rel) & kIndex;
  }

  /// The newest value if it was not read before; nullptr otherwise. It stays until the next call.
  const T* read() {
    if (!(between_.load(std::memory_order_relaxed) & kNew)) return nullptr;
    reading_ = between_.exchange(reading_, std::memory_order_acq_rel) & kIndex;
    return &slots_[reading_];
  }

 private:
  static constexpr std::uint8_t kIndex = 3;
  static constexpr std::uint8_t kNew = 4;

  std::array<T, 3> slots_;
  std::uint8_t writing_ = 0;
  std::uint8_t reading_ = 1;
  std::atomic<std::uint8_t> between_{2};
};

}  // namespace jackal_aic
