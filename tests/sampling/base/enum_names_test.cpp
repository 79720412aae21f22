#include "sampling/base/enum_names.h"

#include <gtest/gtest.h>

namespace hilbrush {
namespace {

enum class Season { kWinter, kSummer, kAutumn };

constexpr EnumName<Season> kSeasonNames[] = {{Season::kSummer, "summer"}, {Season::kWinter, "winter"}};

TEST(EnumNames, AreFoundByValueInWhateverOrderTheTableHas) {
  EXPECT_STREQ(name_of(kSeasonNames, Season::kWinter), "winter");
  EXPECT_STREQ(name_of(kSeasonNames, Season::kSummer), "summer");
  EXPECT_EQ(all_names(kSeasonNames), (std::vector<std::string>{"summer", "winter"}));
}

TEST(EnumNamesDeathTest, AnEnumeratorWithoutANameIsABrokenInvariant) {
  EXPECT_DEATH(name_of(kSeasonNames, Season::kAutumn), "enumerator without a name: 2");
}

}  // namespace
}  // namespace hilbrush
