#pragma once

/// @file
/// The pages of the documentation, and the test that runs their commands.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <regex>
#include <string>
#include <vector>

#include "../repository.hpp"

namespace jackal_aic {

/// README, CONTRIBUTING and everything in doc.
inline std::vector<std::filesystem::path> allPages() {
  std::vector<std::filesystem::path> found{kRoot / "README.md", kRoot / "CONTRIBUTING.md"};
  for (const auto& entry : std::filesystem::recursive_directory_iterator(kRoot / "doc")) {
    if (entry.path().extension() == ".md") found.push_back(entry.path());
  }
  return found;
}

/// The pages that a user goes through (README, tutorial, guides), or all others. Their commands run in two tests,
/// because they take minutes.
inline std::vector<std::filesystem::path> pages(bool of_users) {
  std::vector<std::filesystem::path> chosen;
  for (const auto& page : allPages()) {
    const std::string name = page.stem();
    const bool is_of_users = name == "README" || name == "getting_started" || page.parent_path().stem() == "guides";
    if (is_of_users == of_users) chosen.push_back(page);
  }
  return chosen;
}

inline std::string nameOf(const testing::TestParamInfo<std::filesystem::path>& page) {
  return std::regex_replace(page.param.stem().string(), std::regex("\\W"), "_");
}

class Commands : public testing::TestWithParam<std::filesystem::path> {};

TEST_P(Commands, DoWhatThePageSays) {
  const std::string command = "/usr/bin/python3 " + (kRoot / "test/doc/run_commands").string() + " " + kRoot.string() +
                              " " + GetParam().string();
  EXPECT_EQ(std::system(command.c_str()), 0) << GetParam();
}

}  // namespace jackal_aic
