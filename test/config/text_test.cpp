#include "jackal_aic/config/text.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <regex>
#include <thread>

#include "../complaint.hpp"
#include "../temporary_directory.hpp"
#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/config/text_file.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "jackal_aic/config/yaml_text.hpp"

namespace jackal_aic {
namespace {

class TextFile : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return directory_.path(name); }

  static void expectRefused(const std::string& path, const std::string& reason) {
    EXPECT_EQ(complaint([&] { readText(path); }), path + ": " + reason);
  }

  TemporaryDirectory directory_;
};

TEST_F(TextFile, IsReadUpToItsBound) {
  const std::string text(100000, 'x');
  std::ofstream(path("file")) << text;
  EXPECT_EQ(readText(path("file")), text);
  EXPECT_EQ(readText(path("file"), text.size()), text);
  EXPECT_THROW(readText(path("file"), text.size() - 1), ParameterError);
  std::ofstream(path("empty")).flush();
  EXPECT_EQ(readText(path("empty")), "");
}

TEST_F(TextFile, LargeOneIsRefusedUnread) {
  std::ofstream(path("large")).flush();
  std::filesystem::resize_file(path("large"), std::uintmax_t{1} << 40);  // without any bytes on the disk
  expectRefused(path("large"), "more than 1 MiB of text");
}

TEST_F(TextFile, WhatIsNoFileIsRefused) {
  expectRefused(path("none"), "cannot be read");
  expectRefused(directory_.path(), "is a directory");
  std::filesystem::create_symlink("/dev/zero", path("zero"));
  expectRefused(path("zero"), "is a device or a socket, not a file");
  expectRefused("/dev/null", "is a device or a socket, not a file");
}

TEST_F(TextFile, PipeIsReadToItsEnd) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const std::string text(150000, 'y');  // more than a pipe holds
  std::thread writer([&] {
    ASSERT_EQ(write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
    close(ends[1]);
  });
  EXPECT_EQ(readText("/dev/fd/" + std::to_string(ends[0])), text);
  writer.join();
  close(ends[0]);
}

/// Floating-point numbers of YAML 1.1 as rosparam's reader knows them; those of YAML 1.2 include them.
bool isNumber(const std::string& text) { return std::regex_match(text, std::regex("-?[0-9]+\\.[0-9]+(e[-+][0-9]+)?")); }

TEST(YamlQuoted, StaysTheSameTextForEveryReader) {
  for (const std::string text : {"our Jackal", "1e5", "true", "a: \"b\" # c", "back\\slash", ""}) {
    ParameterMap map;
    addYamlText("robot: " + yamlQuoted(text) + "\n", "text", map);
    EXPECT_EQ(std::get<std::string>(*map.take("robot")), text);
  }
  EXPECT_EQ(yamlQuoted("two\nlines"), "\"two lines\"");
}

TEST(YamlNumber, IsReadBackAsItWas) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> exponent(-300.0, 300.0), mantissa(-1.0, 1.0);
  for (int i = 0; i < 10000; ++i) {
    const double value = mantissa(generator) * std::pow(10.0, exponent(generator));
    const std::string text = yamlNumber(value);
    ASSERT_TRUE(isNumber(text)) << text;
    ASSERT_EQ(std::strtod(text.c_str(), nullptr), value) << text;
    ASSERT_TRUE(isNumber(yamlNumber(value, 3))) << yamlNumber(value, 3);
  }
  for (const double bad : {HUGE_VAL, std::nan("")}) EXPECT_THROW(yamlNumber(bad), ParameterError);
}

TEST(YamlBlock, HasEveryFieldWithItsUnit) {
  ControllerParameters gains;
  gains.tau = 0.02;
  gains.state_variances = {1.0, 1e8};
  const std::string text = yamlBlock("controller", gains);
  expectSays(text, {"controller:\n  belief_rate: 50.0  # Hz\n", "\n  integrator: exact\n  orders: 3\n",
                    "\n  state_variances: [1.0, 1.0e+08]\n"});
  ParameterMap map;
  addYamlText(text, "text", map);
  EXPECT_EQ(readParameters<ControllerParameters>(map, "controller").tau, 0.02);
  EXPECT_NO_THROW(map.refuseUnknown());
}

TEST(OnOneLine, EscapesWhatATerminalObeys) {
  EXPECT_EQ(onOneLine("two\nlines\tand\r\n"), "two lines and  ");
  EXPECT_EQ(onOneLine("\x1b[31m\x07\x7f"), "\\x1b[31m\\x07\\x7f");
  EXPECT_EQ(onOneLine(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(onOneLine("J\u00f6rg"), "J\u00f6rg");
}

TEST(Shortened, CutsBetweenCharacters) {
  const std::string before(79, 'a');
  EXPECT_EQ(shortened(before + "b"), before + "b");
  EXPECT_EQ(shortened(before + "\u00e9\u00e9"), before + "...");
  EXPECT_EQ(shortened(before.substr(1) + "\u00e9\u00e9"), before.substr(1) + "\u00e9...");
  EXPECT_EQ(shortened("abcdef", 3), "abc...");
}

}  // namespace
}  // namespace jackal_aic
