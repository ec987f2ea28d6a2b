#pragma once

/// @file
/// Tables with one entry for each enumerator.

#include <array>
#include <cstddef>

namespace jackal_aic {

/// True if the entries stand in the order of their enumerators. @param key of an entry.
template <class Entry, std::size_t size, class Enum>
constexpr bool inOrder(const std::array<Entry, size>& entries, Enum Entry::*key) {
  for (std::size_t i = 0; i < size; ++i) {
    if (static_cast<std::size_t>(entries[i].*key) != i) return false;
  }
  return true;
}

}  // namespace jackal_aic
