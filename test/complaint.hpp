#pragma once

/// @file
/// What an action is refused with.

#include <gtest/gtest.h>

#include <string>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {

/// The message of the error that an action throws, which is one line of at most so many bytes; empty if it throws none.
template <class Error = ParameterError, class Action>
std::string complaint(const Action& action, std::size_t most = 400) {
  try {
    action();
  } catch (const Error& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    EXPECT_LE(what.size(), most) << what;
    return what;
  }
  return "";
}

}  // namespace jackal_aic
