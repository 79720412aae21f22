#include "daemon/pipeline/planning_pictures.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "config/cell_file.h"
#include "tests/support/temporary_folder.h"

namespace hilbrush {
namespace {

/// A plate of 40 mm, seen from the top, with 20 x 20 dots; `skipped` of them, the rest exposed along the
/// normal.
struct PlannedPlate {
  explicit PlannedPlate(std::size_t skipped_count, SkipReason reason) {
    mesh.vertices = {{-.02, -.02, 0}, {.02, -.02, 0}, {.02, .02, 0}, {-.02, .02, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    dots.pitch_m = .002;
    for (int y = 0; y < 20; ++y)
      for (int x = 0; x < 20; ++x)
        dots.dots.push_back({{-.019 + .002 * x, -.019 + .002 * y, 0}, {0, 0, 1}, {0, 0, 1}});
    plan.program.pitch_m = dots.pitch_m;
    for (std::uint32_t i = 0; i < dots.dots.size(); ++i) {
      if (i < skipped_count) {
        plan.skipped.emplace_back();
        plan.skipped.back().dot_index = i;
        plan.skipped.back().reason = reason;
        continue;
      }
      Exposure exposure;
      exposure.position_O = dots.dots[i].position_O;
      exposure.dot_index = i;
      exposure.pulse_s = .005F;
      plan.program.exposures.push_back(exposure);
    }
  }

  TexturedMesh mesh;
  DotSequence dots;
  Plan plan;
};

std::size_t count_of(const Picture& picture, const std::array<std::uint8_t, 3>& color) {
  std::size_t count = 0;
  for (std::size_t i = 0; i + 2 < picture.pixels.size(); i += 3)
    if (std::equal(color.begin(), color.end(), picture.pixels.begin() + static_cast<std::ptrdiff_t>(i)))
      ++count;
  return count;
}

TEST(PlanningPictures, SkippedDotsHaveTheColorOfTheirReason) {
  constexpr std::size_t kSkipped = 100;
  for (const SkipReason reason : {SkipReason::kOccluded, SkipReason::kJointLimit, SkipReason::kNoPath}) {
    const PlannedPlate some(kSkipped, reason), none(0, reason);
    const Picture marked = planning_sheet(some.mesh, some.dots, some.plan);
    // A quarter of a plate that is 400 pixels wide, marks touching; seen from the top only, and as a line on
    // its edge.
    EXPECT_GT(count_of(marked, skip_reason_color(reason)), 30'000U) << skip_reason_name(reason);
    EXPECT_EQ(count_of(planning_sheet(none.mesh, none.dots, none.plan), skip_reason_color(reason)), 0U);
  }
}

TEST(PlanningPictures, EmptyPlansHaveThemToo) {
  PlannedPlate plate(400, SkipReason::kOccluded);
  const testing_support::TemporaryFolder folder;
  const CellDescription cell = load_cell(find_cell("default"));
  const auto files = write_planning_pictures(plate.mesh, plate.dots, plate.plan, cell, folder.path());
  ASSERT_EQ(files.size(), 1U) << "no exposure takes no time";
  EXPECT_TRUE(std::filesystem::is_regular_file(folder / "planning.png"));
}

TEST(PlanningPictures, TimeIsPlottedToItsEnd) {
  const PlannedPlate plate(0, SkipReason::kOccluded);
  const CellDescription cell = load_cell(find_cell("default"));
  std::size_t calls = 0;
  TimeSplit last;
  const TimeSplit total =
      estimate_time(cell, plate.plan.program, [&](std::size_t exposure, const TimeSplit& so_far) {
        EXPECT_EQ(exposure, calls++);
        EXPECT_GE(so_far.total_s(), last.total_s());
        last = so_far;
      });
  EXPECT_EQ(calls, plate.plan.program.exposures.size());
  EXPECT_DOUBLE_EQ(last.total_s(), total.total_s()) << "the program has no path home";
}

TEST(PlanningPictures, TimeIsInHoursAndMinutesWithShares) {
  PlannedPlate plate(0, SkipReason::kOccluded);
  for (Exposure& exposure : plate.plan.program.exposures) exposure.pulse_s = 30;
  const CellDescription cell = load_cell(find_cell("default"));
  const TimeSplit total = estimate_time(cell, plate.plan.program);
  ASSERT_GT(total.total_s(), 400 * 30);
  const Plot plot = time_plot(cell, plate.plan.program);
  EXPECT_EQ(plot.y_label, "hours so far");
  EXPECT_NEAR(plot.series.at(0).points.back().y(), total.total_s() / 3600, 1e-9);
  EXPECT_TRUE(plot.series.at(0).name.starts_with("in all 3:2")) << plot.series.at(0).name;
  EXPECT_EQ(plot.series.at(3).name.substr(0, 14), "expose 3:20 h,") << plot.series.at(3).name;
  EXPECT_TRUE(plot.series.at(3).name.ends_with(" %"));
  for (Exposure& exposure : plate.plan.program.exposures) exposure.pulse_s = .001F;
  EXPECT_NE(time_plot(cell, plate.plan.program).y_label, "hours so far");
}

}  // namespace
}  // namespace hilbrush
