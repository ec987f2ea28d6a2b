#pragma once

/// @file
/// What is said: what an action is refused with, and the parts of a text.

#include <gtest/gtest.h>

#include <initializer_list>
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

/// Expects that a text has each of these parts.
inline void expectSays(const std::string& text, std::initializer_list<std::string> parts) {
  for (const std::string& part : parts) EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
}

/// Expects that a text has none of these parts.
inline void expectSaysNot(const std::string& text, std::initializer_list<std::string> parts) {
  for (const std::string& part : parts) EXPECT_EQ(text.find(part), std::string::npos) << part << "\n" << text;
}

}  // namespace jackal_aic
