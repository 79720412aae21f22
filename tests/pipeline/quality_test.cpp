#include "daemon/pipeline/quality/quality.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "config/cell_file.h"
#include "config/job_settings.h"
#include "config/json_reader.h"
#include "sampling/base/input_error.h"
#include "sampling/dots/dots_file.h"
#include "tests/pipeline/painting.h"
#include "tests/support/temporary_folder.h"

/// What `hilbrush-pipeline quality` does, from a request to figures and plots.
namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

class Quality : public testing::Test {
 protected:
  Json run(const std::string& request) const {
    return Json::parse(run_quality(quality_request_from_json(request), output_, {}));
  }
  /// Where and what the request is refused for.
  std::string refusal(const std::string& request) const {
    try {
      run(request);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no refusal";
  }
  void expect_files(const Json& json) const {
    for (const auto& file : json["files"]) {
      const fs::path path = output_ / file.get<std::string>();
      ASSERT_TRUE(fs::exists(path)) << path;
      if (path.extension() == ".svg") {
        const std::string svg = read_text_file(path.string(), 16u << 20);
        EXPECT_TRUE(svg.starts_with("<svg ") && svg.ends_with("</svg>\n")) << path;
        EXPECT_EQ(svg.find("nan"), std::string::npos) << path;
      }
    }
    EXPECT_EQ(Json::parse(read_text_file((output_ / "quality.json").string(), 16u << 20)), json);
  }
  static double figure(const Json& json, const char* pointer) { return json.at(Json::json_pointer(pointer)); }

  testing_support::TemporaryFolder folder_;
  const fs::path output_ = folder_ / "out";
};

/// A closed box with a picture of two tones, 40 x 40 x 40.
constexpr const char* kBox =
    "#VRML V2.0 utf8\nShape { appearance Appearance { material Material { diffuseColor 0 0 0 } } "
    "geometry Box { size .04 .04 .04 } }\n";

TEST_F(Quality, ThePlaneHasAllItsFigures) {
  const Json json = run(R"({"set":"plane","sampler":"jittered","count":[1000,4500,20000],"seed":3})");
  EXPECT_NEAR(figure(json, "/slopes/quarter_circles/rms"), -.75, .08);
  EXPECT_EQ(figure(json, "/sizes/2/count"), 20000);
  EXPECT_NEAR(figure(json, "/sizes/2/path_constant"), 1.077, .03);
  EXPECT_NEAR(figure(json, "/sizes/2/spectrum/below_half"), .40, .05);
  EXPECT_LE(figure(json, "/coherence/hilbert/hoelder"), 6);
  EXPECT_EQ(json["sizes"][0]["spectrum"].contains("rings"), false);
  EXPECT_GT(json["sizes"][2]["spectrum"]["rings"].size(), 20u);
  expect_files(json);
  EXPECT_TRUE(fs::exists(output_ / "discrepancy.svg"));
}

TEST_F(Quality, SetsOfOthersAreMeasuredLikeOurs) {
  const Json json = run(R"({"set":"plane","points":"sobol","count":[4096]})");
  EXPECT_LT(figure(json, "/sizes/0/discrepancy/rectangles/rms"), 1e-3);
  const Json sphere = run(R"({"set":"sphere","points":"random","count":[4096]})");
  EXPECT_NEAR(figure(sphere, "/sizes/0/discrepancy/spherical_triangles/rms") * 64, .31, .08);
  EXPECT_NEAR(figure(sphere, "/sizes/0/spectrum/below_half"), 1, .2);
}

TEST_F(Quality, FormulasAreMeasuredOnTheirTriangles) {
  const Json json = run(R"({"set":"monkey_saddle","count":[3000]})");
  EXPECT_LE(figure(json, "/sizes/0/largest_hole"), 1.8);
  EXPECT_LE(figure(json, "/sizes/0/discrepancy/balls/rms"), 2e-3);
  expect_files(json);
  const Json varied = run(R"({"set":"monkey_saddle","count":[3000],"density":"gaussian_curvature"})");
  EXPECT_TRUE(varied["sizes"][0]["discrepancy"].empty());
  EXPECT_EQ(varied["notes"].size(), 1u);
  expect_files(varied);
}

TEST_F(Quality, AModelGetsDotsAndFigures) {
  const Json json = run(R"({"set":")" + folder_.write("box.wrl", kBox) + R"(","count":[6000]})");
  EXPECT_EQ(json["set"]["kind"], "model");
  EXPECT_LE(figure(json, "/sizes/0/largest_hole"), 1.8);
  EXPECT_GE(figure(json, "/sizes/0/spacing/smallest"), .1);
  expect_files(json);
}

TEST_F(Quality, DotsOfAFileAreHeldAgainstTheirModel) {
  const std::string model = folder_.write("box.wrl", kBox);
  DotSequence sequence;  // a grid of 10 x 10 on each face of the box, which stands on z = 0
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-.02, .02})
      for (int j = 0; j < 10; ++j)
        for (int i = 0; i < 10; ++i) {
          Dot dot;
          dot.normal_O = dot.smooth_normal_O = Eigen::Vector3f::Zero();
          dot.position_O[axis] = side;
          dot.position_O[(axis + 1) % 3] = .004 * (i - 4.5);
          dot.position_O[(axis + 2) % 3] = .004 * (j - 4.5);
          dot.position_O.z() += .02;
          sequence.dots.push_back(dot);
        }
  const std::vector<std::uint8_t> reasons(sequence.dots.size(), 0);
  const std::vector<std::string> names{"exposed"};
  const std::string file = (folder_ / "dots.ply").string();
  write_dots(sequence, reasons, names, file);

  const auto request = [&](const std::string& more) {
    return R"({"set":")" + file + R"(","model":")" + model + R"(","settings":"{\"size_mm\":40}")" + more +
           "}";
  };
  const Json json = run(request(""));
  EXPECT_EQ(figure(json, "/sizes/0/count"), 600);
  EXPECT_NEAR(figure(json, "/sizes/0/largest_hole"), std::sqrt(.5),
              .13);  // to an eighth of a pitch under a tone
  // 36 of a face's dots lie nearest to those around the edge, half a spacing from it on either side.
  EXPECT_NEAR(figure(json, "/sizes/0/spacing/mean"), .9306 * (.64 + .36 * std::sqrt(.5)), 1e-3);
  expect_files(json);

  EXPECT_EQ(refusal(request(R"(,"count":[5])")).rfind("$.count: has no effect", 0), 0u);
  EXPECT_EQ(refusal(request(R"(,"sampler":"even")")).rfind("$.sampler: has no effect", 0), 0u);
  for (Dot& dot : sequence.dots) dot.position_O.x() += .01;
  write_dots(sequence, reasons, names, file);
  EXPECT_NE(refusal(request("")).find("dots do not lie on it"), std::string::npos);
}

TEST_F(Quality, ATexturedModelIsMeasuredByItsTone) {
  // Balls of many dots have outlines of 64 corners and more, which a texture integrates in pieces.
  const std::string model = testing_pipeline::test_data("letter_cube.wrl").string();
  const Json json = run(R"({"set":")" + model + R"(","density":"texture","count":[4000]})");
  EXPECT_EQ(figure(json, "/sizes/0/count"), 4000);
  EXPECT_GT(figure(json, "/sizes/0/discrepancy/balls/rms"), 0);
  EXPECT_LT(figure(json, "/sizes/0/discrepancy/balls/rms"), 1.5e-3) << "5e-4; of random dots 5e-3";
  expect_files(json);

  run_dry_run({model, job_settings_from_json(R"({"size_mm":20,"dpi":50})"), find_cell("default"), output_},
              {});
  const std::string request = R"({"set":")" + (output_ / "dots.ply").string() + R"(","model":")" + model +
                              R"(","settings":"{\"size_mm\":20,\"dpi\":50}"})";
  EXPECT_LT(figure(run(request), "/sizes/0/discrepancy/balls/rms"), 2e-2);
}

TEST_F(Quality, RequestsThatMakeNoSenseAreRefused) {
  EXPECT_EQ(refusal(R"({"set":"spere"})").rfind("$.set: there is no file \"spere\"", 0), 0u);
  EXPECT_EQ(refusal(R"({"set":"plane","sampler":"bleu"})").rfind("$.sampler: expected \"centroid\", ", 0),
            0u);
  EXPECT_EQ(refusal(R"({"set":"plane","curve":"z"})").rfind("$.curve: expected \"hilbert\" or \"peano2\"", 0),
            0u);
  EXPECT_EQ(refusal(R"({"set":"plane","area":"circle"})").rfind("$.area: expected \"triangle\", ", 0), 0u);
  EXPECT_EQ(refusal(R"({"set":"plane","density":"v"})").rfind("$.density: expected ", 0), 0u);
  EXPECT_EQ(
      refusal(R"({"set":"plane","points":"sobol","sampler":"even"})").rfind("$.sampler: has no effect", 0),
      0u);
  EXPECT_EQ(refusal(R"({"set":"monkey_saddle","points":"sobol"})").rfind("$.points: is for the plane", 0),
            0u);
  EXPECT_EQ(refusal(R"({"set":"plane","count":[0]})").rfind("$.count[0]", 0), 0u);
  EXPECT_EQ(refusal(R"({"set":"plane","counts":[5]})").rfind("$.counts", 0), 0u);
  EXPECT_FALSE(fs::exists(output_));
}

TEST_F(Quality, TheSameRequestGivesTheSameText) {
  const std::string request = R"({"set":"monkey_saddle","count":[2000],"seed":5})";
  EXPECT_EQ(run(request).dump(), run(request).dump());
}

}  // namespace
}  // namespace hilbrush
