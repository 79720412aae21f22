#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "config/cell_file.h"
#include "daemon/pipeline/pipeline.h"
#include "sampling/base/input_error.h"
#include "tests/pipeline/painting.h"
#include "tests/pipeline/report_expectations.h"
#include "tests/support/shell.h"
#include "tests/support/temporary_folder.h"

/// Model in, pictures out, through the functions that the programs call.
namespace hilbrush::testing_pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using testing_support::TemporaryFolder;

JobSettings settings_of(double size_mm, double dpi) {
  JobSettings settings;
  settings.size_mm = size_mm;
  settings.dpi = dpi;
  return settings;
}

Json dry_run(const std::string& model, const JobSettings& settings, const fs::path& folder) {
  const std::string report = run_dry_run({test_data(model), settings, find_cell("default"), folder}, {});
  expect_sound_dry_run(report, folder);
  return Json::parse(report);
}

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class SmallModel : public testing::TestWithParam<const char*> {};

TEST_P(SmallModel, IsPaintedAndItsCountsAddUp) {
  const TemporaryFolder folder;
  const Json report = dry_run(GetParam(), settings_of(20, 80), folder.path());
  EXPECT_EQ(report.at("mesh").at("file"), GetParam());
  EXPECT_EQ(report.at("mesh").at("warnings").dump().find("texture"), std::string::npos)
      << report.at("mesh").at("warnings");
}

INSTANTIATE_TEST_SUITE_P(Files, SmallModel,
                         testing::Values("letter_cube.wrl", "letter_cube.obj", "letter_cube.ply",
                                         "face_colors.wrl", "vertex_colors.wrl", "vertex_colors.ply"));

TEST(EggCup, IsPaintedWhole) {
  const TemporaryFolder folder;
  const Json report = dry_run("eggcup.wrl", settings_of(60, 50), folder.path());
  EXPECT_EQ(report.at("mesh").at("genus"), 0);
  EXPECT_EQ(report.at("mesh").at("components"), 1);
  EXPECT_EQ(report.at("mesh").at("boundary_loops"), 0);
  const Json& component = report.at("components").at(0);
  EXPECT_EQ(component.at("pieces"), 1);
  EXPECT_GT(component.at("cut_length_mm"), 60) << "a closed surface is cut from top to bottom";
  EXPECT_GE(component.at("map_shear"), 1);
  const Json& mesh = report.at("mesh");
  EXPECT_NEAR(mesh.at("size_mm").at(2).get<double>(), 60, 1e-3) << "its longest side";
  EXPECT_NEAR(mesh.at("min_mm").at(2).get<double>(), 0, 1e-3) << "it stands on the post";
  EXPECT_NEAR(mesh.at("min_mm").at(0).get<double>(), -mesh.at("max_mm").at(0).get<double>(), 1e-3)
      << "centered";
  EXPECT_GE(report.at("dots").at("exposed").get<double>(),
            .99 * report.at("dots").at("placed").get<double>());
}

TEST(EggCup, NeedlesPaintTheSamePicture) {
  // The dots follow the surface and its picture, not the triangulation: the count is the same within what the
  // coarser outline takes away.
  const TemporaryFolder even_folder, needle_folder;
  const Json even = dry_run("eggcup.wrl", settings_of(60, 50), even_folder.path());
  const Json needles = dry_run("eggcup_needles.wrl", settings_of(60, 50), needle_folder.path());
  const double placed = even.at("dots").at("placed");
  EXPECT_NEAR(needles.at("dots").at("placed").get<double>(), placed, .02 * placed);
  EXPECT_NEAR(needles.at("fidelity").at("f2_db").get<double>(), even.at("fidelity").at("f2_db").get<double>(),
              3);
}

TEST(WholePath, TheSameBytesAgain) {
  const TemporaryFolder first, second;
  const auto plan = [](const fs::path& folder) {
    run_plan({test_data("letter_cube.wrl"), settings_of(20, 80), find_cell("default"), folder}, {});
  };
  plan(first.path());
  plan(second.path());
  for (const char* file : {"program.ply", "dots.ply"}) {
    EXPECT_FALSE(bytes_of(first.path() / file).empty());
    EXPECT_EQ(bytes_of(first.path() / file), bytes_of(second.path() / file)) << file;
  }
}

TEST(WholePath, SamplersAndExactCountsReachTheProgram) {
  for (const Sampler sampler : {Sampler::kCentroid, Sampler::kJittered, Sampler::kEven, Sampler::kRandom}) {
    JobSettings settings = settings_of(20, 80);
    settings.dpi.reset();
    settings.dots = 1234;
    settings.sampler = sampler;
    const TemporaryFolder folder;
    const Json report = Json::parse(
        run_plan({test_data("letter_cube.obj"), settings, find_cell("default"), folder.path()}, {}));
    EXPECT_EQ(report.at("dots").at("requested"), 1234) << sampler_name(sampler);
    EXPECT_EQ(report.at("dots").at("placed"), 1234) << sampler_name(sampler);
  }
}

TEST(WholePath, ProgressNeverGoesBackAndNamesEveryStage) {
  const TemporaryFolder folder;
  std::vector<std::string> stages;
  double last = 0;
  PipelineListener listener;
  listener.on_progress = [&](const char* stage, double fraction) {
    if (stages.empty() || stages.back() != stage) {
      stages.push_back(stage);
      last = 0;
    }
    EXPECT_GE(fraction, last - 1e-9) << stage;
    EXPECT_LE(fraction, 1 + 1e-9) << stage;
    last = fraction;
  };
  run_dry_run({test_data("letter_cube.wrl"), settings_of(20, 50), find_cell("default"), folder.path()},
              listener);
  for (const char* stage : {"load", "disk", "curve", "dots", "plan", "check", "paint", "images"})
    EXPECT_EQ(std::count(stages.begin(), stages.end(), stage), 1) << stage;
}

TEST(WholePath, RefusalsNameWhatToChange) {
  const TemporaryFolder folder;
  const fs::path cell = find_cell("default");
  const auto refusal = [&](const PipelineRequest& request) -> std::string {
    try {
      run_plan(request, {});
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  };
  JobSettings no_size;
  no_size.dpi = 80;
  const std::string size = refusal({test_data("letter_cube.obj"), no_size, cell, folder.path()});
  EXPECT_NE(size.find("size"), std::string::npos) << size;
  EXPECT_NE(size.find("units"), std::string::npos) << size;
  EXPECT_EQ(refusal({test_data("letter_cube.wrl"), no_size, cell, folder.path()}), "")
      << "VRML files are in meters";
  EXPECT_NE(refusal({test_data("no_such_model.wrl"), settings_of(20, 80), cell, folder.path()})
                .find("no_such_model.wrl"),
            std::string::npos);

  std::ofstream(folder.path() / "a_file") << "not a folder";
  EXPECT_NE(refusal({test_data("letter_cube.wrl"), settings_of(20, 80), cell, folder.path() / "a_file/out"}),
            "");
}

}  // namespace
}  // namespace hilbrush::testing_pipeline
