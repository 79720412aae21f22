#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/pipeline/report_expectations.h"
#include "tests/support/shell.h"
#include "tests/support/temporary_folder.h"

/// Models that other people made, through the command. They are not part of the project: HILBRUSH_TEST_MODELS
/// says where they are.
namespace hilbrush::testing_pipeline {
namespace {

namespace fs = std::filesystem;
using testing_support::CommandResult;
using testing_support::quoted;
using testing_support::run_command;
using testing_support::TemporaryFolder;

const char* models_folder() {
  return std::getenv("HILBRUSH_TEST_MODELS");
}
bool is_long() {
  return std::getenv("HILBRUSH_LONG") != nullptr;
}

CommandResult dry_run(const fs::path& model, int dpi, const fs::path& out) {
  return run_command("timeout 240 " + quoted(std::string(HILBRUSH_BUILD_DIR) + "/hilbrush") + " dry-run " +
                     quoted(model.string()) + " --size-mm 80 --dpi " + std::to_string(dpi) + " -o " +
                     quoted(out.string()) + " </dev/null");
}

void expect_painted(const fs::path& model, int dpi) {
  const TemporaryFolder folder;
  const CommandResult result = dry_run(model, dpi, folder.path());
  ASSERT_EQ(result.exit_code, 0) << model << "\n" << result.output;
  std::ifstream stream(folder.path() / "report.json");
  expect_sound_dry_run({std::istreambuf_iterator<char>(stream), {}}, folder.path());
}

class RealModel : public testing::TestWithParam<const char*> {};

TEST_P(RealModel, IsPaintedAndItsCountsAddUp) {
  if (!models_folder()) GTEST_SKIP() << "SKIPPED: HILBRUSH_TEST_MODELS is not set";
  fs::path model;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(models_folder())) {
    if (entry.path().generic_string().ends_with(std::string("/") + GetParam())) model = entry.path();
  }
  if (model.empty()) GTEST_SKIP() << "SKIPPED: " << GetParam() << " is not in " << models_folder();
  expect_painted(model, is_long() ? 100 : 20);
}

INSTANTIATE_TEST_SUITE_P(Files, RealModel,
                         testing::Values("cow_mesh/cow.obj", "head.wrl", "chest.wrl", "rfoot.wrl",
                                         "house/house.wrl", "MAIN_BELT.wrl", "tank.wrl", "comet-tempel.wrl",
                                         "meshWithTexture.wrl", "pixelTexture.wrl", "elevationGrid2.wrl",
                                         "extrusion3.wrl", "fuze.obj", "capsule.obj", "featuretype.STL",
                                         "nefertiti-lowres.obj", "plane_holes.obj"),
                         [](const auto& each) {
                           std::string name = each.param;
                           std::replace_if(
                               name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; },
                               '_');
                           return name;
                         });

TEST(RealModels, EveryVrmlFileIsPaintedOrRefusedWithAReason) {
  if (!models_folder()) GTEST_SKIP() << "SKIPPED: HILBRUSH_TEST_MODELS is not set";
  if (!is_long()) GTEST_SKIP() << "SKIPPED: a hundred models take minutes; tests/run --long runs them";
  std::size_t painted = 0;
  std::size_t refused = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(models_folder())) {
    std::string ending = entry.path().extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(), ::tolower);
    if (ending != ".wrl") continue;
    const TemporaryFolder folder;
    const CommandResult result = dry_run(entry.path(), 20, folder.path());
    EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 3) << entry.path() << "\n" << result.output;
    if (result.exit_code == 0) {
      std::ifstream stream(folder.path() / "report.json");
      expect_sound_dry_run({std::istreambuf_iterator<char>(stream), {}}, folder.path());
      ++painted;
    } else {
      EXPECT_NE(result.output.find(entry.path().filename().string()), std::string::npos)
          << "the reason names the file:\n"
          << result.output;
      ++refused;
    }
  }
  EXPECT_GT(painted, 0u);
  RecordProperty("painted", static_cast<int>(painted));
  RecordProperty("refused", static_cast<int>(refused));
}

}  // namespace
}  // namespace hilbrush::testing_pipeline
