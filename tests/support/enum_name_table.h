#pragma once
#include <gtest/gtest.h>

#include <cstddef>
#include <set>
#include <string>
#include <string_view>

#include "sampling/base/enum_names.h"

namespace hilbrush {

/// Whether `kValue` is one of its enum's enumerators, by the text that the compiler gives it: "...::kBlue" or
/// a cast such as "(Sampler)10".
template <auto kValue>
constexpr bool is_enumerator() {
  const std::string_view function = __PRETTY_FUNCTION__;
  const std::string_view value = function.substr(function.rfind("kValue = ") + 9);
  return value.front() != '(';
}

/// Checks a table of names both ways: each enumerator has one entry, and each name is one value's. For enums
/// that are numbered from 0 without gaps.
template <const auto& kNames>
void expect_names_both_ways() {
  constexpr std::size_t kCount = std::size(kNames);
  using Enum = decltype(kNames[0].value);
  std::set<int> values;
  std::set<std::string> names;
  for (const auto& [value, name] : kNames) {
    EXPECT_TRUE(values.insert(static_cast<int>(value)).second) << name << " is the second name of its value";
    EXPECT_TRUE(names.insert(name).second) << name << " stands for two values";
    EXPECT_STREQ(name_of(kNames, value), name);
  }
  EXPECT_EQ(*values.begin(), 0);
  EXPECT_EQ(*values.rbegin(), static_cast<int>(kCount) - 1);
  EXPECT_TRUE(is_enumerator<static_cast<Enum>(kCount - 1)>());
  EXPECT_FALSE(is_enumerator<static_cast<Enum>(kCount)>())
      << "an enumerator after the last named one has no name";
}

}  // namespace hilbrush
