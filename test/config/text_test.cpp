#include "jackal_aic/config/text.hpp"

#include <gtest/gtest.h>

namespace jackal_aic {
namespace {

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
