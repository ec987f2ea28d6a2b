// The result tables against the ones kept in golden/, so that a change of a number is a decision.
// scripts/regenerate_golden rewrites them on purpose.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "experiment_table.hpp"
#include "jackal_aic/config/text_file.hpp"

namespace jackal_aic::sim {
namespace {

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::stringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  return parts;
}

/// Equal text, or numbers within 1 % or 0.005: another compiler or processor rounds differently, a changed model does
/// not.
void expectAlike(const std::string& ours, const std::string& golden, const std::string& where) {
  if (ours == golden) return;
  char* end = nullptr;
  const double a = std::strtod(ours.c_str(), &end);
  const bool numbers = !ours.empty() && *end == '\0' && !golden.empty();
  const double b = std::strtod(golden.c_str(), &end);
  EXPECT_TRUE(numbers && *end == '\0' && std::abs(a - b) <= std::max(0.005, 0.01 * std::abs(b)))
      << where << ": '" << ours << "', golden '" << golden << "'";
}

class Golden : public ::testing::TestWithParam<const char*> {};

TEST_P(Golden, TableIsUnchanged) {
  const std::string name = GetParam();
  const auto golden = split(readText(files().path("test/closed_loop/golden/" + name + ".csv")), '\n');
  const auto columns = split(resultHeader().substr(0, resultHeader().size() - 1), ',');
  const auto runs = ExperimentTable(files()).runs(name);
  ASSERT_EQ(golden.size(), runs.size() + 1);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::string line = resultLine(runs[i]().row);
    // A last empty field needs its separator to be counted.
    const auto ours = split(line.substr(0, line.size() - 1) + ",.", ',');
    const auto kept = split(golden[i + 1] + ",.", ',');
    ASSERT_EQ(ours.size(), columns.size() + 1);
    ASSERT_EQ(kept.size(), columns.size() + 1);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      expectAlike(ours[c], kept[c], name + " row " + std::to_string(i) + " " + columns[c]);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Tables, Golden,
                         ::testing::Values("table_3-1a", "table_3-1b", "table_5-2", "table_5-4", "table_5-5",
                                           "table_5-6", "table_5-9", "table_5-10", "figure_4-2", "figure_4-5"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace jackal_aic::sim
