#include "jackal_aic/config/text.hpp"

#include <gtest/gtest.h>

#include <random>

namespace jackal_aic {
namespace {

TEST(OnOneLine, EscapesWhatATerminalObeys) {
  EXPECT_EQ(onOneLine("two\nlines\tand\r\n"), "two lines and  ");
  EXPECT_EQ(onOneLine("\x1b[31m\x07\x7f"), "\\x1b[31m\\x07\\x7f");
  EXPECT_EQ(onOneLine(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(onOneLine("\u009b31m\u0085"), "\\xc2\\x9b31m\\xc2\\x85");
  EXPECT_EQ(onOneLine("\u202egnp.\u2066\u2028\u200f\u061c"),
            "\\xe2\\x80\\xaegnp.\\xe2\\x81\\xa6\\xe2\\x80\\xa8\\xe2\\x80\\x8f\\xd8\\x9c");
}

TEST(OnOneLine, EscapesWhatIsNoUtf8) {
  EXPECT_EQ(onOneLine("a \xe9\xff"), "a \\xe9\\xff");
  EXPECT_EQ(onOneLine("\xc0\xaf \xe0\x80\xaf"), "\\xc0\\xaf \\xe0\\x80\\xaf") << "overlong";
  EXPECT_EQ(onOneLine("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "a surrogate";
  EXPECT_EQ(onOneLine("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "beyond the last character";
  EXPECT_EQ(onOneLine("\x80 \xe2\x82"), "\\x80 \\xe2\\x82") << "a part of a character";
  EXPECT_EQ(onOneLine("\xef\xbf\xbf"), "\\xef\\xbf\\xbf") << "no character, and none for YAML";
}

TEST(Shortened, CutsBetweenCharacters) {
  const std::string before(79, 'a');
  EXPECT_EQ(shortened(before + "b"), before + "b");
  EXPECT_EQ(shortened(before + "\u00e9\u00e9"), before + "...");
  EXPECT_EQ(shortened(before.substr(1) + "\u00e9\u00e9"), before.substr(1) + "\u00e9...");
  EXPECT_EQ(shortened("abcdef", 3), "abc...");
  EXPECT_EQ(shortened(std::string(5, '\x80'), 2), "\\x80\\x80...") << "no character to keep whole";
}

}  // namespace
}  // namespace jackal_aic
