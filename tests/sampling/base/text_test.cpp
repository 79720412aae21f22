#include "sampling/base/text.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <limits>

namespace hilbrush {
namespace {

TEST(Text, TrimsBlanksOnBothSidesOnly) {
  EXPECT_EQ(trimmed(" \t two words\r\n\v\f"), "two words");
  EXPECT_EQ(trimmed("word"), "word");
  EXPECT_EQ(trimmed(" \n "), "");
  EXPECT_EQ(trimmed(""), "");
}

TEST(Text, LowersAsciiLettersOnly) {
  EXPECT_EQ(lower_case("SOLID Cup_1"), "solid cup_1");
  EXPECT_EQ(lower_case("\xc3\x84"), "\xc3\x84") << "bytes of UTF-8 stay as they are";
}

TEST(Text, NumbersAreWrittenAsPrintfWritesThem) {
  constexpr double kValues[] = {0,      -0.,     .1,      1. / 3, 1e-5,
                                123456, 1234567, 1e100,   -2.5,   99999.95,
                                1e-310, 1e22,    0.00025, 15,     std::numeric_limits<double>::infinity()};
  for (const double value : kValues)
    for (const int digits : {1, 4, 6, 12, 17}) {
      char expected[64];
      std::snprintf(expected, sizeof expected, "%.*g", digits, value);
      EXPECT_EQ(number(value, digits), expected);
    }
}

TEST(Text, AmountsKeepTwoDigitsAndEveryDigitBeforeThePoint) {
  EXPECT_EQ(amount(.2549), "0.25");
  EXPECT_EQ(amount(1.5), "1.5");
  EXPECT_EQ(amount(9.99), "10");
  EXPECT_EQ(amount(1234.4), "1234");
}

}  // namespace
}  // namespace hilbrush
