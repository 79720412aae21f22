#include "sim/film/calibrate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sampling/base/input_error.h"
#include "tests/sim/test_objects.h"

namespace hilbrush {
namespace {

Wedge closed_form(double (*response)(double)) {
  return [response](const std::vector<double>& asked) {
    std::vector<WedgeStep> steps;
    for (const double a : asked) steps.push_back({a, response(a)});
    return steps;
  };
}

TEST(Calibrate, InvertsAClosedForm) {
  const ToneCurve curve = calibrate_tone(closed_form([](double a) { return 1 - std::exp(-3 * a); }), 1.5);
  EXPECT_EQ(curve(0), 0);
  for (std::size_t i = 1; i + 1 < curve.wanted.size(); ++i)
    EXPECT_NEAR(1 - std::exp(-3 * curve.asked[i]), curve.wanted[i], .003) << curve.wanted[i];
  EXPECT_EQ(curve.asked.back(), 1.5);  // full black would take endless energy
  EXPECT_TRUE(std::is_sorted(curve.asked.begin(), curve.asked.end()));
}

TEST(Calibrate, AnIdealPaintNeedsNoCurve) {
  const ToneCurve curve = calibrate_tone(closed_form([](double a) { return std::min(a, 1.); }), 1);
  for (std::size_t i = 0; i < curve.wanted.size(); ++i) EXPECT_NEAR(curve.asked[i], curve.wanted[i], .003);
}

TEST(Calibrate, GrainThatMakesReadingsFallDoesNotMakeTheCurveFall) {
  const ToneCurve curve =
      calibrate_tone(closed_form([](double a) { return std::min(1., a + .02 * std::sin(40 * a)); }), 1);
  EXPECT_TRUE(std::is_sorted(curve.asked.begin(), curve.asked.end()));
  for (std::size_t i = 0; i < curve.wanted.size(); ++i) EXPECT_NEAR(curve.asked[i], curve.wanted[i], .05);
}

TEST(Calibrate, PaintThatShowsNothingIsAnError) {
  EXPECT_THROW(calibrate_tone(closed_form([](double) { return 0.; }), 1), InputError);
  EXPECT_THROW(calibrate_tone([](const std::vector<double>&) { return std::vector<WedgeStep>{}; }, 1),
               InputError);
}

TEST(Calibrate, TheSimulatedWedgeReadsWhatIsWanted) {
  const CellDescription cell = test::handmade_cell();
  for (const Sampler sampler : {Sampler::kCentroid, Sampler::kRandom}) {
    PictureOptions options;
    options.sample.sampler = sampler;
    const double pitch = .254e-3;
    const ToneCurve curve = calibrate_tone(wedge_on_film(cell, pitch, options), cell.paint.asked_max);
    // Tones between the curve's own, placed with other seeds.
    options.sample.seed = 99;
    const std::vector<double> wanted{.15, .35, .55, .75, .85};
    std::vector<double> asked;
    for (const double tone : wanted) asked.push_back(curve(tone));
    const std::vector<WedgeStep> read = wedge_on_film(cell, pitch, options)(asked);
    for (std::size_t i = 0; i < wanted.size(); ++i)
      EXPECT_NEAR(read[i].painted, wanted[i], .01) << "sampler " << static_cast<int>(sampler);
  }
}

}  // namespace
}  // namespace hilbrush
