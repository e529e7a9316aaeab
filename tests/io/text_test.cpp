#include "io/text.hpp"

#include <gtest/gtest.h>

namespace flappy::io::text_test {
namespace {

TEST(Text, IsPrintable) {
  EXPECT_EQ(printable("log.csv: \xC3\xA9\xE2\x82\xAC\xF0\x9F\x90\xA6 x"),
            "log.csv: \xC3\xA9\xE2\x82\xAC\xF0\x9F\x90\xA6 x");
  EXPECT_EQ(printable(std::string("a\x1b[2J\n\x7f\0b", 9)), "a\\x1b[2J\\x0a\\x7f\\x00b");
  // Latin-1, a character that was cut off, an overlong one, a surrogate, one beyond Unicode
  EXPECT_EQ(printable("\xE9t\xC3"), "\\xe9t\\xc3");
  EXPECT_EQ(printable("\xC0\x80|\xED\xA0\x80|\xF4\x90\x80\x80"), "\\xc0\\x80|\\xed\\xa0\\x80|\\xf4\\x90\\x80\\x80");
}

TEST(Text, IsShortened) {
  EXPECT_EQ(shortened("abc", 3), "abc");
  EXPECT_EQ(shortened("abcd", 3), "abc...");
  EXPECT_EQ(shortened("\x01\x02\x03", 2), "\\x01\\x02...");
}

}  // namespace
}  // namespace flappy::io::text_test
