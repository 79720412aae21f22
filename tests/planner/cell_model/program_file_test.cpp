#include "planner/cell_model/program_file.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <random>

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

class ProgramFile : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("program_file_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    file_ = folder_ / "program.ply";
  }
  void TearDown() override { fs::remove_all(folder_); }

  static ExposureProgram some_program(std::size_t exposures, std::size_t vias) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    ExposureProgram program;
    program.provenance = {std::string(64, 'a'), std::string(64, 'b'), std::string(64, 'c'), "0.1.0"};
    program.pitch_m = .0254 / 300;
    for (std::size_t i = 0; i < exposures; ++i) {
      Exposure e;
      e.position_O = {uniform(random), uniform(random), uniform(random)};
      e.normal_O = Eigen::Vector3f(0.6F, 0, .8F);
      e.tone = static_cast<float>(uniform(random));
      e.energy_j = 1e-5F;
      for (double& joint : e.joints) joint = uniform(random);
      e.power_w = .01F;
      e.pulse_s = .005F;
      e.incidence = .3F;
      e.dot_index = static_cast<std::uint32_t>(random());
      program.exposures.push_back(e);
    }
    for (std::size_t i = 0; i < vias; ++i) {
      Via via;
      via.before_exposure = static_cast<std::uint32_t>(exposures * i / std::max<std::size_t>(1, vias - 1));
      for (double& joint : via.joints) joint = uniform(random);
      program.vias.push_back(via);
    }
    return program;
  }
  static void expect_same(const ExposureProgram& a, const ExposureProgram& b) {
    EXPECT_EQ(a.provenance.model_sha256, b.provenance.model_sha256);
    EXPECT_EQ(a.provenance.settings_sha256, b.provenance.settings_sha256);
    EXPECT_EQ(a.provenance.cell_sha256, b.provenance.cell_sha256);
    EXPECT_EQ(a.provenance.version, b.provenance.version);
    EXPECT_EQ(a.pitch_m, b.pitch_m);
    ASSERT_EQ(a.exposures.size(), b.exposures.size());
    ASSERT_EQ(a.vias.size(), b.vias.size());
    for (std::size_t i = 0; i < a.exposures.size(); ++i) {
      const Exposure &x = a.exposures[i], &y = b.exposures[i];
      EXPECT_TRUE(x.position_O == y.position_O && x.normal_O == y.normal_O && x.tone == y.tone &&
                  x.energy_j == y.energy_j && x.joints == y.joints && x.power_w == y.power_w &&
                  x.pulse_s == y.pulse_s && x.incidence == y.incidence && x.dot_index == y.dot_index)
          << "exposure " << i;
    }
    for (std::size_t i = 0; i < a.vias.size(); ++i)
      EXPECT_TRUE(a.vias[i].before_exposure == b.vias[i].before_exposure &&
                  a.vias[i].joints == b.vias[i].joints);
  }
  std::string bytes() const {
    std::ifstream in(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void put_bytes(const std::string& bytes) const {
    std::ofstream(file_, std::ios::binary | std::ios::trunc)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }

  fs::path folder_, file_;
};

TEST_F(ProgramFile, RoundTrip) {
  for (const auto& [exposures, vias] : {std::pair{0, 0}, {1, 0}, {0, 2}, {7, 3}, {9000, 5000}}) {
    const ExposureProgram program =
        some_program(static_cast<std::size_t>(exposures), static_cast<std::size_t>(vias));
    write_program(program, file_);
    expect_same(read_program(file_), program);
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1) << "no temporary file is left";
}

TEST_F(ProgramFile, SameProgramSameBytes) {
  write_program(some_program(50, 9), file_);
  const std::string first = bytes();
  write_program(some_program(50, 9), file_);
  EXPECT_EQ(first, bytes());
}

TEST_F(ProgramFile, HeaderIsThePlyThatOthersRead) {
  write_program(some_program(2, 1), file_);
  const std::string text = bytes();
  EXPECT_EQ(text.rfind("ply\nformat binary_little_endian 1.0\n", 0), 0U);
  const std::size_t body = text.find("end_header\n") + std::strlen("end_header\n");
  EXPECT_NE(text.find("\nelement vertex 2\nproperty double x\n"), text.npos);
  EXPECT_NE(text.find("\nelement via 1\nproperty uint before\n"), text.npos);
  EXPECT_EQ(text.size() - body, 2 * (3 * 8 + 3 * 4 + 2 * 4 + 6 * 8 + 3 * 4 + 4) + 1 * (4 + 6 * 8));
  double x = 0;
  std::memcpy(&x, text.data() + body, sizeof x);
  EXPECT_EQ(x, some_program(2, 1).exposures[0].position_O.x());
}

TEST_F(ProgramFile, CutsAreRefused) {
  write_program(some_program(3, 2), file_);
  const std::string whole = bytes();
  std::mt19937 random(8);
  for (std::size_t length = 0; length < whole.size(); length += 1 + random() % 5) {
    put_bytes(whole.substr(0, length));
    EXPECT_THROW(read_program(file_), ProgramFileError) << "cut to " << length << " bytes";
  }
  put_bytes(whole + '\0');
  EXPECT_THROW(read_program(file_), ProgramFileError);
}

TEST_F(ProgramFile, FlippedBitsAreRefused) {
  write_program(some_program(3, 2), file_);
  const std::string whole = bytes();
  std::mt19937 random(9);
  for (std::size_t at = 0; at < whole.size(); at += 1 + random() % 5) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << random() % 8));
    put_bytes(damaged);
    EXPECT_THROW(read_program(file_), ProgramFileError) << "byte " << at;
  }
}

TEST_F(ProgramFile, HugeCountsAreRefusedBeforeAllocation) {
  write_program(some_program(3, 2), file_);
  std::string text = bytes();
  for (const char* count : {"4000000000", "18446744073709551615", "170000000000000000"}) {
    std::string damaged = text;
    damaged.replace(damaged.find("element vertex 3"), 16, std::string("element vertex ") + count);
    put_bytes(damaged);
    EXPECT_THROW(read_program(file_), ProgramFileError) << count;
  }
}

TEST_F(ProgramFile, WhatIsNoProgram) {
  EXPECT_THROW(read_program(folder_ / "absent.ply"), ProgramFileError);
  EXPECT_THROW(read_program(folder_), ProgramFileError);
  put_bytes("ply\nformat ascii 1.0\nelement vertex 0\nend_header\n");
  EXPECT_THROW(read_program(file_), ProgramFileError);
}

TEST_F(ProgramFile, WayPointsOutOfOrderAreRefused) {
  ExposureProgram program = some_program(5, 3);
  program.vias[1].before_exposure = 6;
  write_program(program, file_);
  EXPECT_THROW(read_program(file_), ProgramFileError);
}

TEST_F(ProgramFile, AFailedWriteLeavesTheOldFile) {
  const ExposureProgram program = some_program(4, 1);
  write_program(program, file_);
  ExposureProgram bad = program;
  bad.provenance.version = "two\nlines";
  EXPECT_THROW(write_program(bad, file_), ProgramFileError);
  EXPECT_THROW(write_program(program, folder_ / "absent" / "program.ply"), ProgramFileError);
  expect_same(read_program(file_), program);
}

}  // namespace
}  // namespace hilbrush
