#include "daemon/pipeline/painted_dots.h"

#include <gtest/gtest.h>

#include <random>

namespace hilbrush {
namespace {

constexpr unsigned kSeed = 11;

/// A program of distinct random poses, and the record of a cell that made all of them perfectly.
struct PaintedProgram {
  explicit PaintedProgram(std::size_t count) {
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<double> angle(-1, 1);
    for (std::size_t i = 0; i < count; ++i) {
      Exposure exposure;
      for (double& joint : exposure.joints) joint = angle(random);
      exposure.position_O = Eigen::Vector3d(angle(random), angle(random), angle(random)) * .04;
      exposure.pulse_s = .005F;
      program.exposures.push_back(exposure);
      Emission emission;
      emission.joints = exposure.joints;
      emission.length_s = emission.commanded_s = .005;
      emissions.push_back(emission);
      Hit hit;
      hit.is_hit = true;
      hit.position_O = exposure.position_O;
      hits.push_back(hit);
    }
  }
  ExposureProgram program;
  std::vector<Emission> emissions;
  std::vector<Hit> hits;
};

TEST(PaintedDots, CountsAPerfectRecord) {
  const PaintedProgram painted(500);
  const PaintedDots dots = match_emissions(painted.program, painted.emissions, painted.hits);
  EXPECT_EQ(dots.exposed, 500U);
  EXPECT_EQ(dots.in_doubt, 0U);
  EXPECT_EQ(dots.repeated, 0U);
  EXPECT_EQ(dots.foreign, 0U);
  EXPECT_EQ(dots.hits.off_target, 0U);
  EXPECT_EQ(dots.hits.max_error_um, 0);
}

TEST(PaintedDots, OrderOfEmissionsDoesNotMatter) {
  PaintedProgram painted(500);
  std::reverse(painted.emissions.begin(), painted.emissions.end());
  std::reverse(painted.hits.begin(), painted.hits.end());
  const PaintedDots dots = match_emissions(painted.program, painted.emissions, painted.hits);
  EXPECT_EQ(dots.exposed, 500U);
  EXPECT_EQ(dots.hits.off_target, 0U);
}

TEST(PaintedDots, AxesRestBesideTheirTargets) {
  PaintedProgram painted(500);
  // A second exposure a millimeter aside of each: the nearest one is meant.
  for (std::size_t i = 0; i < 500; ++i) {
    Exposure neighbor = painted.program.exposures[i];
    neighbor.joints[kRotation] += 4e-4;
    painted.program.exposures.push_back(neighbor);
  }
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> share(-1, 1);
  for (Emission& emission : painted.emissions)
    for (std::size_t i = 0; i < emission.joints.size(); ++i)
      emission.joints[i] += share(random) * (i == kJ3 ? 2e-5 : 1e-4);
  const PaintedDots dots = match_emissions(painted.program, painted.emissions, painted.hits);
  EXPECT_EQ(dots.exposed, 500U);
  EXPECT_EQ(dots.foreign, 0U);
  EXPECT_EQ(dots.repeated, 0U);
  EXPECT_EQ(dots.hits.off_target, 0U);
}

TEST(PaintedDots, ACutPulseIsInDoubtUntilItIsMadeInFull) {
  PaintedProgram painted(10);
  painted.emissions[4].length_s = .002;
  EXPECT_EQ(match_emissions(painted.program, painted.emissions, painted.hits).in_doubt, 1U);
  EXPECT_EQ(match_emissions(painted.program, painted.emissions, painted.hits).exposed, 9U);

  Emission again = painted.emissions[4];
  again.length_s = again.commanded_s;
  painted.emissions.push_back(again);
  painted.hits.push_back(painted.hits[4]);
  const PaintedDots dots = match_emissions(painted.program, painted.emissions, painted.hits);
  EXPECT_EQ(dots.in_doubt, 0U);
  EXPECT_EQ(dots.exposed, 10U);
  EXPECT_EQ(dots.repeated, 0U);
}

TEST(PaintedDots, RepeatedForeignAndMissingEmissionsAreCounted) {
  PaintedProgram painted(10);
  painted.emissions[0] = painted.emissions[1];  // 1 twice, 0 never
  painted.emissions[2].joints[kTilt] += 1e-3;   // belongs to no exposure
  const PaintedDots dots = match_emissions(painted.program, painted.emissions, painted.hits);
  EXPECT_EQ(dots.exposed, 8U);
  EXPECT_EQ(dots.repeated, 1U);
  EXPECT_EQ(dots.foreign, 1U);
}

TEST(PaintedDots, HitsThatLandElsewhereAreCounted) {
  PaintedProgram painted(10);
  painted.hits[3].position_O.x() += 25e-6;
  painted.hits[5].is_hit = false;
  painted.hits[7].is_shadowed = true;
  painted.hits[7].position_O.z() += 5e-6;
  const PaintedDots dots = match_emissions(painted.program, painted.emissions, painted.hits);
  EXPECT_EQ(dots.hits.off_target, 2U);
  EXPECT_EQ(dots.hits.shadowed, 1U);
  EXPECT_NEAR(dots.hits.max_error_um, 25, 1e-6);
}

}  // namespace
}  // namespace hilbrush
