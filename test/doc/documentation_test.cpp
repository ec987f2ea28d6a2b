// The documentation against the repository: links lead somewhere, programs and equations are where it says, the
// commands of the pages for reference run. Those that a user goes through are in user_pages_test.cpp.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <regex>
#include <string>
#include <vector>

#include "../repository.hpp"
#include "pages.hpp"

namespace jackal_aic {
namespace {

namespace fs = std::filesystem;

/// Calls visit(match) for every match in a text; returns their number.
template <class Visit>
int forEachMatch(const std::string& text, const std::regex& pattern, const Visit& visit) {
  int count = 0;
  for (std::sregex_iterator i(text.begin(), text.end(), pattern), end; i != end; ++i, ++count) visit(*i);
  return count;
}

/// The name of a heading as links write it.
std::string anchor(std::string heading) {
  std::string name;
  for (const char c : heading) {
    if (c == ' ') name += '-';
    if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_') {
      name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return name;
}

bool hasHeading(const fs::path& page, const std::string& wanted) {
  bool found = false;
  forEachMatch(textOf(page), std::regex("(^|\n)#+ ([^\n]+)"),
               [&](const std::smatch& m) { found = found || anchor(m[2]) == wanted; });
  return found;
}

TEST(Documentation, EveryLinkLeadsSomewhere) {
  int links = 0;
  for (const fs::path& page : allPages()) {
    links += forEachMatch(textOf(page), std::regex(R"(\]\(([^)#]*)(#([^)]*))?\))"), [&](const std::smatch& m) {
      const std::string path = m[1], heading = m[3];
      if (path.rfind("http", 0) == 0) return;
      const fs::path target = path.empty() ? page : page.parent_path() / path;
      EXPECT_TRUE(fs::exists(target)) << page << ": " << path;
      EXPECT_TRUE(heading.empty() || hasHeading(target, heading)) << page << ": " << m[0];
    });
  }
  EXPECT_GT(links, 20);
}

TEST(Documentation, EveryFileThatItNamesIsThere) {
  int files = 0;
  const std::regex named("`((?:include|src|sim|config|launch|test|scripts)/[A-Za-z0-9_./]+\\.[a-z]+)`");
  for (const fs::path& page : allPages()) {
    files += forEachMatch(textOf(page), named,
                          [&](const std::smatch& m) { EXPECT_TRUE(fs::exists(kRoot / m[1].str())) << page << m[0]; });
  }
  EXPECT_GT(files, 10);
}

TEST(Documentation, EveryEquationIsWhereItSays) {
  const std::regex row(R"(\| ([a-z_/]+\.(?:hpp|py)) \| (\w+) \|)");
  const int rows = forEachMatch(textOf(kRoot / "doc/reference/equations.md"), row, [](const std::smatch& m) {
    const fs::path path = m[1].str();
    const std::string header = textOf(*path.begin() == "sim" ? kRoot / path : kRoot / "include/jackal_aic" / path);
    EXPECT_TRUE(std::regex_search(header, std::regex("\\b" + m[2].str() + "\\b"))) << m[0];
  });
  EXPECT_GT(rows, 20);
}

TEST(Documentation, EveryProgramAndLaunchFileThatItStartsIsBuiltHere) {
  std::string build;
  for (const char* directory : {"src", "sim", "test"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / directory)) {
      if (entry.path().filename() == "CMakeLists.txt") build += textOf(entry.path());
    }
  }
  int commands = 0;
  for (const fs::path& page : allPages()) {
    const std::string text = textOf(page);
    commands += forEachMatch(text, std::regex("rosrun jackal_aic (\\w+)"), [&](const std::smatch& m) {
      const bool built = std::regex_search(
          build, std::regex("(add_executable\\(|foreach\\(example[^)]*|install(?:_python)?\\(PROGRAMS [^)]*/)" +
                            m[1].str() + "\\b"));
      EXPECT_TRUE(built) << page << ": " << m[0];
    });
    commands += forEachMatch(text, std::regex("roslaunch jackal_aic ([\\w.]+)"), [&](const std::smatch& m) {
      EXPECT_TRUE(fs::exists(kRoot / "launch" / m[1].str())) << page << ": " << m[0];
    });
    commands += forEachMatch(text, std::regex("\\./(scripts/\\w+)"), [&](const std::smatch& m) {
      EXPECT_TRUE(fs::exists(kRoot / m[1].str())) << page << ": " << m[0];
    });
  }
  EXPECT_GT(commands, 20);
}

TEST(Documentation, PagesArePlainAndWrapped) {
  const std::string command = "/usr/bin/python3 " + (kRoot / "test/doc/readability").string() + " " + kRoot.string();
  EXPECT_EQ(std::system(command.c_str()), 0);
}

TEST(Documentation, TheReadmeFitsOneScreenAndSaysThatNoRobotHasDrivenWithIt) {
  const std::string readme = textOf(kRoot / "README.md");
  EXPECT_LE(std::count(readme.begin(), readme.end(), '\n'), 110);
  std::size_t end = 0;
  for (int line = 0; line < 5; ++line) end = readme.find('\n', end) + 1;
  EXPECT_NE(readme.substr(0, end).find("simulation only so far, never on a robot"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Pages, Commands, testing::ValuesIn(pages(false)), nameOf);

}  // namespace
}  // namespace jackal_aic
