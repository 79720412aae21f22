#include "sampling/base/result.h"

#include <gtest/gtest.h>

#include <memory>

namespace hilbrush {
namespace {

Result<std::string> file_of(int number) {
  if (number < 0) return Failure{"there is no such file"};
  return std::to_string(number) + ".wrl";
}

TEST(Result, HoldsAValueOrTheReasonWhyThereIsNone) {
  const Result<std::string> found = file_of(7);
  ASSERT_TRUE(found);
  EXPECT_EQ(*found, "7.wrl");
  EXPECT_EQ(found->size(), 5u);
  EXPECT_EQ(found.reason(), "");

  const Result<std::string> missing = file_of(-1);
  EXPECT_FALSE(missing);
  EXPECT_EQ(missing.reason(), "there is no such file");
}

TEST(Result, HandsOverWhatCannotBeCopied) {
  Result<std::unique_ptr<int>> result = std::make_unique<int>(3);
  const std::unique_ptr<int> taken = std::move(*result);
  EXPECT_EQ(*taken, 3);
}

TEST(ResultDeathTest, TheValueOfAFailureIsABrokenInvariant) {
  EXPECT_DEATH((void)*file_of(-1), "broken invariant");
}

}  // namespace
}  // namespace hilbrush
