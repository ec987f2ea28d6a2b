#include "jackal_aic/safety/phase_lock.hpp"

#include <algorithm>

namespace jackal_aic {
namespace {

/// In [0, period).
std::int64_t modulo(std::int64_t value, std::int64_t period) {
  const std::int64_t rest = value % period;
  return rest < 0 ? rest + period : rest;
}

/// In [-period/2, period/2).
std::int64_t wrapped(std::int64_t value, std::int64_t period) {
  return modulo(value + period / 2, period) - period / 2;
}

}  // namespace

PhaseLock::PhaseLock(std::int64_t period) : period_(period) {}

void PhaseLock::reset() {
  count_ = 0;
  locked_ = false;
}

void PhaseLock::arrived(std::int64_t now) {
  if (count_ > 0) {
    const std::int64_t since_last = now - arrivals_[(count_ - 1) % kMost];
    if (since_last < period_ / 2) return;
    if (since_last > static_cast<std::int64_t>(kMost) * period_) reset();
  }
  arrivals_[count_++ % kMost] = now;
}

std::int64_t PhaseLock::next(std::int64_t due, std::int64_t now) {
  std::int64_t next = due + period_;
  if (count_ > 0 && now - arrivals_[(count_ - 1) % kMost] <= static_cast<std::int64_t>(kMost) * period_) {
    const std::int64_t shift = bestShift(next);
    if (locked_) {
      next += std::clamp(shift, -margin(), margin());
    } else {
      next += modulo(shift, period_);
      locked_ = true;
    }
  }
  return next + period_ < now ? now : next;
}

std::int64_t PhaseLock::drift() const {
  if (count_ < kMost) return 0;
  // Between measurements that are half of all apart. Where rates differ, the phases repeat after 2 (20 Hz against 50),
  // 4 or 5 of them (80 against 50): a multiple of all compares the same with the same. The median is not moved by a
  // measurement that was late, nor by the one after which some were lost.
  std::array<std::int64_t, kMost / 2> drifts;
  for (std::size_t i = 0; i < drifts.size(); ++i) {
    const std::int64_t from = arrivals_[(count_ + i) % kMost], to = arrivals_[(count_ + i + drifts.size()) % kMost];
    const std::int64_t periods = std::max<std::int64_t>(1, (to - from + period_ / 2) / period_);
    drifts[i] = wrapped(to - from, period_) / periods;
  }
  const auto middle = drifts.begin() + drifts.size() / 2;
  std::nth_element(drifts.begin(), middle, drifts.end());
  return *middle;
}

std::int64_t PhaseLock::bestShift(std::int64_t due) const {
  const std::int64_t per_period = drift();
  const auto n = static_cast<std::int64_t>(std::min(count_, kMost));
  // Phases of the measurements after `due`; 0..period. The margin is for jitter that the measurements did not show.
  std::array<std::int64_t, kMost> after;
  for (std::int64_t i = 0; i < n; ++i) {
    const std::int64_t arrival = arrivals_[i];
    const std::int64_t periods = (due - arrival) / period_;
    after[i] = modulo(arrival + per_period * periods + margin() - due, period_);
  }
  const auto end = after.begin() + n;
  std::sort(after.begin(), end);
  // Sum of age and `after` over all, with the action right after the k-th: the later ones wait for the action after it.
  std::int64_t best = 0, best_age = 0;
  for (std::int64_t k = 0; k < n; ++k) {
    const std::int64_t age = n * after[k] + period_ * (n - 1 - k);
    if (k == 0 || age < best_age) {
      best_age = age;
      best = after[k];
    }
  }
  const auto with_it = std::upper_bound(after.begin(), end, 0) - after.begin();  // those at `due` itself
  const std::int64_t age = period_ * (n - with_it);
  // The phase would wander with measurements of another rate, for which all phases are equal.
  if (age - best_age < n * margin()) return 0;
  return wrapped(best, period_);
}

}  // namespace jackal_aic
