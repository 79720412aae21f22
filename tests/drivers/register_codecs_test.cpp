#include <gtest/gtest.h>

#include <random>

#include "drivers/axes/mapped_drive.h"
#include "drivers/axes/oriental_az.h"

namespace hilbrush {
namespace {

TEST(OrientalAz, DirectDataIsSixteenWordsHighWordFirst) {
  using oriental_az::Trigger;
  auto words = oriental_az::encode_move({-25000, 100000, 1500000}, Trigger::kAllData);
  oriental_az::DirectData wanted{0,    0,      0,    1,      0xFFFF, 0x9E58, 1, 0x86A0,
                                 0x16, 0xE360, 0x16, 0xE360, 0,      1000,   0, 1};
  EXPECT_EQ(words, wanted);
  EXPECT_EQ(oriental_az::kDirectDataAt, 0x58);
  EXPECT_EQ(oriental_az::kTriggerAt, 0x66);
  EXPECT_EQ(oriental_az::encode_trigger(Trigger::kAllData), (std::array<std::uint16_t, 2>{0, 1}));
  wanted.back() = 0;
  words = oriental_az::encode_move({-25000, 100000, 1500000}, Trigger::kNone);
  EXPECT_EQ(words, wanted) << "the data of a move that nothing starts yet";
}

TEST(OrientalAz, ReadingsFollowTheDriversOutputBits) {
  const std::array<std::uint16_t, 4> position{0xFFFF, 0xFFFE, 0, 7};
  auto reading = oriental_az::decode_reading(1 << 14 | 1 << 5, position);
  EXPECT_EQ(reading.position, -2);
  EXPECT_EQ(reading.setpoint, 7);
  EXPECT_TRUE(reading.has_arrived);
  EXPECT_TRUE(reading.is_enabled);
  reading = oriental_az::decode_reading(1 << 14 | 1 << 13, position);
  EXPECT_FALSE(reading.has_arrived) << "IN-POS of the last move, while MOVE is on";
  reading = oriental_az::decode_reading(1 << 7, position);
  EXPECT_TRUE(reading.has_fault);
  EXPECT_FALSE(reading.is_enabled);
  EXPECT_EQ(oriental_az::alarm_text(0x30), "alarm 0x30 (see the drive's manual)");
  EXPECT_EQ(oriental_az::alarm_text(0xABC), "alarm 0xABC (see the drive's manual)");
}

TEST(RegisterMap, WordsKeepTheirOrderAndSign) {
  MappedRegister reg;
  reg.words = 2;
  reg.is_signed = true;
  EXPECT_EQ(register_map::encode(reg, 0x12345678), (std::vector<std::uint16_t>{0x1234, 0x5678}));
  reg.is_high_word_first = false;
  EXPECT_EQ(register_map::encode(reg, 0x12345678), (std::vector<std::uint16_t>{0x5678, 0x1234}));
  reg.words = 1;
  EXPECT_EQ(register_map::encode(reg, 0xFFFF8000), std::vector<std::uint16_t>{0x8000});
  EXPECT_EQ(register_map::decode(reg, std::array<std::uint16_t, 1>{0x8000}), -32768);
}

TEST(RegisterMap, ValuesComeBackAsTheyWere) {
  std::mt19937 random(20261122);
  for (int i = 0; i < 2000; ++i) {
    MappedRegister reg;
    reg.words = 1 + static_cast<int>(random() % 2);
    reg.is_signed = random() % 2 == 0;
    reg.is_high_word_first = random() % 2 == 0;
    const auto bits = static_cast<std::uint32_t>(random());
    const auto value = reg.words == 2
                           ? (reg.is_signed ? std::int64_t{static_cast<std::int32_t>(bits)} : bits)
                           : (reg.is_signed ? std::int64_t{static_cast<std::int16_t>(bits)} : bits & 0xFFFF);
    const std::uint32_t code = register_map::to_register(reg, static_cast<double>(value));
    EXPECT_EQ(register_map::decode(reg, register_map::encode(reg, code)), value)
        << "seed 20261122, case " << i;
  }
}

TEST(RegisterMap, ScalesAndLimits) {
  MappedRegister reg;
  reg.per_step = 60. / 10000;  // rpm of a motor with 10,000 steps a turn
  EXPECT_EQ(register_map::to_register(reg, 100000), 600u);
  EXPECT_EQ(register_map::to_register(reg, 1e12), 0xFFFFu);
  EXPECT_EQ(register_map::to_register(reg, -5), 0u);
  EXPECT_EQ(register_map::to_register(reg, std::numeric_limits<double>::quiet_NaN()), 0u);
  reg.inverse_of = 1e6;  // ms per 1000 rpm
  EXPECT_EQ(register_map::to_register(reg, 1e6), 167u);
  EXPECT_EQ(register_map::to_register(reg, 0), 0xFFFFu);
}

}  // namespace
}  // namespace hilbrush
