#include "sim/devices/emission_record.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/support/temporary_folder.h"

namespace hilbrush {
namespace {

class EmissionRecord : public ::testing::Test {
 protected:
  static Emission emission(int i) {
    Emission e;
    for (std::size_t k = 0; k < kAxisCount; ++k) e.joints[k] = i + .1 * static_cast<double>(k);
    e.start_s = 10. * i, e.length_s = .004, e.commanded_s = .005, e.power_w = 1.5 + i,
    e.is_moving = i % 2 == 1;
    return e;
  }
  void append(int first, int end) const {
    EmissionRecordFile record(file_);
    for (int i = first; i < end; ++i) record.append(emission(i));
  }
  std::string bytes() const {
    std::ifstream in(file_, std::ios::binary);
    std::stringstream all;
    all << in.rdbuf();
    return all.str();
  }
  void write(const std::string& bytes) const {
    std::ofstream(file_, std::ios::binary | std::ios::trunc) << bytes;
  }
  void expect_whole(std::size_t count) const {
    const std::vector<Emission> read = read_emission_record(file_);
    ASSERT_EQ(read.size(), count);
    for (std::size_t i = 0; i < count; ++i) {
      const Emission wanted = emission(static_cast<int>(i));
      EXPECT_EQ(read[i].joints, wanted.joints);
      EXPECT_EQ(read[i].start_s, wanted.start_s);
      EXPECT_EQ(read[i].length_s, wanted.length_s);
      EXPECT_EQ(read[i].commanded_s, wanted.commanded_s);
      EXPECT_EQ(read[i].power_w, wanted.power_w);
      EXPECT_EQ(read[i].is_moving, wanted.is_moving);
    }
  }

  testing_support::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "emissions.rec";
};

TEST_F(EmissionRecord, ReadsBackWhatWasAppendedOverSeveralOpenings) {
  append(0, 0);
  expect_whole(0);
  append(0, 2);
  append(2, 5);
  expect_whole(5);
}

TEST_F(EmissionRecord, TornAtAnyByteKeepsAllWholeRecordsAndGrowsOn) {
  append(0, 0);
  const std::size_t header = bytes().size();
  append(0, 3);
  const std::string whole = bytes();
  const std::size_t record = (whole.size() - header) / 3;
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    const std::size_t count = size < header ? 0 : (size - header) / record;
    write(whole.substr(0, size));
    expect_whole(count);
    append(static_cast<int>(count), 4);
    expect_whole(4);
  }
}

TEST_F(EmissionRecord, ALastRecordOfWrongBytesIsDropped) {
  append(0, 3);
  std::string damaged = bytes();
  damaged[damaged.size() - 20] = static_cast<char>(damaged[damaged.size() - 20] ^ 1);
  write(damaged);
  expect_whole(2);
}

TEST_F(EmissionRecord, DamageInTheMiddleIsRefusedByName) {
  append(0, 0);
  const std::size_t header = bytes().size();
  append(0, 3);
  std::string damaged = bytes();
  damaged[header + 5] = static_cast<char>(damaged[header + 5] ^ 1);
  write(damaged);
  try {
    read_emission_record(file_);
    FAIL() << "read a damaged record";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()), file_.string() + ": emission 1 is damaged");
  }
}

TEST_F(EmissionRecord, OtherFilesAndAbsentOnesAreRefusedByName) {
  EXPECT_THROW(read_emission_record(file_), std::runtime_error);
  write("ply\nformat ascii 1.0\n");
  EXPECT_THROW(read_emission_record(file_), std::runtime_error);
  EXPECT_THROW(EmissionRecordFile record(file_), std::runtime_error);
  EXPECT_EQ(bytes(), "ply\nformat ascii 1.0\n");  // and left as they are
  EXPECT_THROW(EmissionRecordFile record(folder_ / "absent/record"), std::runtime_error);
}

}  // namespace
}  // namespace hilbrush
