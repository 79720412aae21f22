#include "daemon/pipeline/wedge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "config/cell_file.h"
#include "sampling/base/input_error.h"
#include "sampling/images/image_file.h"
#include "sampling/model/model_file.h"
#include "sampling/tone/tone_field.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

class WedgeForm : public testing::Test {
 protected:
  WedgeForm()
      : cell_(load_cell(find_cell("default"))),
        settings_(wedge_settings(job_settings_from_json(R"({"dpi":100})"))),
        card_(wedge_card(.254e-3, cell_.paint.asked_max, std::vector<double>{1})),
        form_(Json::parse(wedge_form(card_, settings_))) {}

  std::filesystem::path write(const char* name, const std::string& text) const {
    const auto file = std::filesystem::path(testing::TempDir()) / name;
    std::ofstream(file) << text;
    return file;
  }
  std::string error_of(const Json& form) const {
    try {
      read_wedge_form(write("form.json", form.dump()), settings_, cell_);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  /// As an operator would, of paint that covers 1 - exp(-2 asked).
  void fill_in() {
    for (Json& step : form_["steps"]) step["painted"] = 1 - std::exp(-2 * step["asked"].get<double>());
  }

  CellDescription cell_;
  JobSettings settings_;
  WedgeCard card_;
  Json form_;
};

TEST_F(WedgeForm, ReadingsBecomeTheCurveThatUndoesThem) {
  fill_in();
  const auto steps = read_wedge_form(write("form.json", form_.dump()), settings_, cell_);
  ASSERT_EQ(steps.size(), card_.asked.size());
  const ToneCurve curve = tone_curve_of(steps, cell_.paint.asked_max, std::vector<double>{1});
  for (double wanted = .05; wanted < .96; wanted += .05)
    EXPECT_NEAR(1 - std::exp(-2 * curve(wanted)), wanted, .01) << wanted;
}

TEST_F(WedgeForm, ReflectancesAreReadByThePaint) {
  fill_in();
  cell_.paint.reflectance_white = .8;
  cell_.paint.reflectance_black = .1;
  form_["steps"][4].erase("painted");
  form_["steps"][4]["reflectance"] = .45;
  EXPECT_NEAR(read_wedge_form(write("form.json", form_.dump()), settings_, cell_)[4].painted, .5, 1e-12);
  form_["steps"][4]["reflectance"] = .95;
  EXPECT_NE(error_of(form_).find("$.steps[4].reflectance: is lighter than the paint's"), std::string::npos);
}

TEST_F(WedgeForm, MistakesAreRefusedWithTheirPath) {
  EXPECT_NE(error_of(form_).find("$.steps[0].painted: has no reading yet"), std::string::npos)
      << error_of(form_);
  fill_in();
  EXPECT_EQ(error_of(form_), "accepted");
  Json other = form_;
  other["sampler"] = "even";
  EXPECT_NE(error_of(other).find("$.sampler: the wedge was painted with even"), std::string::npos)
      << error_of(other);
  other = form_;
  other["dpi"] = 200;
  EXPECT_NE(error_of(other).find("$.dpi: the settings have another"), std::string::npos) << error_of(other);
  other = form_;
  other["steps"][2]["x"] = 1;
  EXPECT_NE(error_of(other).find("$.steps[2].x: unknown key"), std::string::npos) << error_of(other);
  other = form_;
  other["steps"][2]["painted"] = 1.5;
  EXPECT_NE(error_of(other).find("$.steps[2].painted: expected a number from 0 to 1"), std::string::npos);
}

TEST_F(WedgeForm, SaysWhatToMeasure) {
  const std::string text = form_["measure"];
  EXPECT_NE(text.find("painted is the part of the field that the paint covers"), std::string::npos) << text;
}

TEST_F(WedgeForm, OneWrongReadingIsRefusedAndNamed) {
  fill_in();
  Json wrong = form_;
  wrong["steps"][6]["painted"] = wrong["steps"][6]["painted"].get<double>() - .2;  // row 2, column 3
  EXPECT_NE(error_of(wrong).find("$.steps: row 2, column 3 reads"), std::string::npos) << error_of(wrong);
  wrong = form_;
  wrong["steps"][6]["painted"] = .99;
  EXPECT_NE(error_of(wrong).find("but row 2, column 3, which was asked for less, reads 0.99"),
            std::string::npos)
      << error_of(wrong);
  wrong = form_;
  for (const int i : {14, 15}) wrong["steps"][i]["painted"] = .99 - .001 * i;
  EXPECT_EQ(error_of(wrong), "accepted") << "a saturated paint, within what readings scatter";
}

TEST_F(WedgeForm, EqualReadingsAndMissingFieldsAreRefused) {
  fill_in();
  Json wrong = form_;
  for (Json& step : wrong["steps"]) step["painted"] = .5;
  EXPECT_NE(error_of(wrong).find("$.steps: all fields read nearly the same"), std::string::npos)
      << error_of(wrong);
  wrong = form_;
  wrong["steps"].erase(4);
  EXPECT_NE(error_of(wrong).find("$.steps: the field in row 2, column 1 is missing"), std::string::npos)
      << error_of(wrong);
  wrong = form_;
  wrong["steps"][5]["column"] = 1;
  EXPECT_NE(error_of(wrong).find("row 2, column 1 stands there twice"), std::string::npos) << error_of(wrong);
}

TEST_F(WedgeForm, TheModelAsksForItsSteps) {
  const auto file = write("wedge.wrl", wedge_model(card_, cell_.paint));
  const Model model = load_model(file, load_image_file);
  const ToneField tone(model.mesh, ToneOptions{.untextured = Untextured::kMaterial,
                                               .curve = {{0, 1}, {0, cell_.paint.asked_max}}});
  std::vector<double> asked;
  for (std::uint32_t t = 0; t < model.mesh.triangle_count(); ++t)
    asked.push_back(tone.asked({.triangle = t}));
  for (const double step : card_.asked)
    EXPECT_GE(std::ranges::count_if(asked, [&](double a) { return std::abs(a - step) < 1e-4; }), 2) << step;
  EXPECT_GT(model.mesh.area_vector(0).y(), 0);  // facing up
}

}  // namespace
}  // namespace hilbrush
