#include "jackal_aic/config/text_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "../temporary_directory.hpp"
#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {
namespace {

class TextFile : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return directory_.path(name); }

  /// What reading is refused with, after the path; empty if it is read.
  static std::string refusal(const std::string& path, std::size_t most = 1 << 20) {
    try {
      readText(path, most);
    } catch (const ParameterError& error) {
      const std::string what = error.what();
      EXPECT_EQ(what.find(path + ": "), 0U) << what;
      return what.substr(path.size() + 2);
    }
    return "";
  }

  TemporaryDirectory directory_;
};

TEST_F(TextFile, IsReadUpToItsBound) {
  const std::string text(100000, 'x');
  std::ofstream(path("file")) << text;
  EXPECT_EQ(readText(path("file")), text);
  EXPECT_EQ(readText(path("file"), text.size()), text);
  EXPECT_NE(refusal(path("file"), text.size() - 1), "");
  std::ofstream(path("empty")).flush();
  EXPECT_EQ(readText(path("empty")), "");
}

TEST_F(TextFile, LargeOneIsRefusedUnread) {
  std::ofstream(path("large")).flush();
  std::filesystem::resize_file(path("large"), std::uintmax_t{1} << 40);  // without any bytes on the disk
  EXPECT_EQ(refusal(path("large")), "more than 1 MiB of text");
}

TEST_F(TextFile, WhatIsNoFileIsRefused) {
  EXPECT_EQ(refusal(path("none")), "cannot be read");
  EXPECT_EQ(refusal(directory_.path()), "is a directory");
  std::filesystem::create_symlink("/dev/zero", path("zero"));
  EXPECT_EQ(refusal(path("zero")), "is a device or a socket, not a file");
  EXPECT_EQ(refusal("/dev/null"), "is a device or a socket, not a file");
}

TEST_F(TextFile, PipeIsReadToItsEnd) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  std::thread writer([&ends] {  // more than a pipe holds, in pieces with a pause between them
    const std::string piece(50000, 'y');
    for (int i = 0; i < 3; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      ASSERT_EQ(write(ends[1], piece.data(), piece.size()), static_cast<ssize_t>(piece.size()));
    }
    close(ends[1]);
  });
  EXPECT_EQ(readText("/dev/fd/" + std::to_string(ends[0])), std::string(150000, 'y'));
  writer.join();
  close(ends[0]);
}

}  // namespace
}  // namespace jackal_aic
