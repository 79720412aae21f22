#include "config/job_settings.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

std::string settings_error_of(const std::string& text, const std::string& origin = {}) {
  try {
    job_settings_from_json(text, origin);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(JobSettings, NothingGivenMeansTheDefaults) {
  const JobSettings settings = job_settings_from_json("{}");
  EXPECT_EQ(settings.dpi, 100);
  EXPECT_EQ(job_settings_to_json(settings), job_settings_to_json(JobSettings{}));
  EXPECT_EQ(
      job_settings_to_json(settings),
      R"({"dpi":100.0,"dots":null,"size_mm":null,"units_mm":null,"up":null,"untextured":"auto","sampler":"centroid",)"
      R"("curve":"hilbert","density":"texture","seed":1,"levels":1,"predictive_rounds":0,"largest_gap_pitches":null,)"
      R"("fine_passes":24,"tone_curve":"calibrated","max_incidence_deg":45.0,"preferred_incidence_deg":20.0,)"
      R"("planning":"balanced","order":"improved","policy":"search",)"
      R"("fixture":{"post_height_mm":null,"post_radius_mm":null,"plate_radius_mm":null},)"
      R"("mounting":{"offset_mm":[0.0,0.0,0.0],"turn_deg":0.0},"cell":"default","dry_run":false})");
}

TEST(JobSettings, OrderAndFormOfWhatWasGivenDoNotChangeTheCanonicalText) {
  EXPECT_EQ(
      job_settings_to_json(job_settings_from_json(R"({"seed":3,"dpi":300,"size_mm":80.0})")),
      job_settings_to_json(job_settings_from_json(R"({"size_mm":8e1,"dots":null,"dpi":300.00,"seed":3})")));
}

TEST(JobSettings, RoundTripOfRandomSettings) {
  constexpr unsigned kSeed = 5;
  std::mt19937_64 random(kSeed);
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  for (int round = 0; round < 2000; ++round) {
    JobSettings settings;
    if (random() % 2)
      settings.dpi = uniform(10, 1200);
    else
      settings.dots = 1 + random() % 1'000'000'000;
    if (random() % 2)
      settings.size_mm = uniform(1, 1000);
    else if (random() % 2)
      settings.units_mm = uniform(.001, 1000);
    if (random() % 2) settings.up = random() % 2 ? "y" : "z";
    settings.untextured = static_cast<Untextured>(random() % 3);
    settings.sampler = static_cast<Sampler>(random() % 10);
    settings.curve = static_cast<CurveKind>(random() % 2);
    settings.density = static_cast<DensitySource>(random() % 3);
    settings.levels = 1 + static_cast<int>(random() % 4);
    settings.predictive_rounds = static_cast<int>(random() % 5);
    if (!settings.dots && random() % 2) settings.largest_gap_pitches = uniform(.7, 100);
    settings.fine_passes = 1 + static_cast<int>(random() % 1000);
    settings.tone_curve = static_cast<ToneMapping>(random() % 2);
    settings.seed = random();
    settings.max_incidence_deg = uniform(10, 45);
    settings.preferred_incidence_deg = uniform(0, settings.max_incidence_deg);
    settings.planning = static_cast<Planning>(random() % 3);
    settings.order = static_cast<DotOrder>(random() % 2);
    settings.policy = static_cast<PosePolicy>(random() % 2);
    if (random() % 2) settings.fixture.post_height_mm = uniform(0, 1000);
    if (random() % 2) settings.fixture.plate_radius_mm = uniform(1, 2000);
    settings.mounting = {{uniform(-9, 9), uniform(-9, 9), uniform(0, 9)}, uniform(-360, 360)};
    settings.cell = random() % 2 ? "default" : "/a b/\"c\"\xc3\xa4.json";
    settings.dry_run = random() % 2;

    const std::string text = job_settings_to_json(settings);
    const JobSettings back = job_settings_from_json(text);
    EXPECT_EQ(job_settings_to_json(back), text) << "seed " << kSeed << ", round " << round;
    EXPECT_EQ(back.dpi, settings.dpi);
    EXPECT_EQ(back.dots, settings.dots);
    EXPECT_EQ(back.size_mm, settings.size_mm);
    EXPECT_EQ(back.units_mm, settings.units_mm);
    EXPECT_EQ(back.up, settings.up);
    EXPECT_EQ(back.untextured, settings.untextured);
    EXPECT_EQ(back.sampler, settings.sampler);
    EXPECT_EQ(back.curve, settings.curve);
    EXPECT_EQ(back.density, settings.density);
    EXPECT_EQ(back.levels, settings.levels);
    EXPECT_EQ(back.predictive_rounds, settings.predictive_rounds);
    EXPECT_EQ(back.largest_gap_pitches, settings.largest_gap_pitches);
    EXPECT_EQ(back.fine_passes, settings.fine_passes);
    EXPECT_EQ(back.tone_curve, settings.tone_curve);
    EXPECT_EQ(back.seed, settings.seed);
    EXPECT_EQ(back.max_incidence_deg, settings.max_incidence_deg);
    EXPECT_EQ(back.cell, settings.cell);
    EXPECT_EQ(back.dry_run, settings.dry_run);
  }
}

TEST(JobSettings, MistakesAreRefusedWithTheirPath) {
  struct Case {
    const char *text, *error;
  };
  const Case cases[] = {
      {R"({"dpi":9})", "$.dpi: expected a number from 10 to 1200, found 9"},
      {R"({"dpi":1201})", "$.dpi: expected a number from 10 to 1200, found 1201"},
      {R"({"dpi":"100"})", "$.dpi: expected a number from 10 to 1200, found \"100\""},
      {R"({"dots":0})", "$.dots: expected a whole number from 1 to 1000000000, found 0"},
      {R"({"dots":1000000001})", "$.dots: expected a whole number from 1 to 1000000000, found 1000000001"},
      {R"({"dots":10.5})", "$.dots: expected a whole number from 1 to 1000000000, found 10.5"},
      {R"({"dpi":100,"dots":1000})", "$.dots: contradicts dpi: give dpi or dots, not both"},
      {R"({"size_mm":0.5})", "$.size_mm: expected a number from 1 to 1000, found 0.5"},
      {R"({"size_mm":1001})", "$.size_mm: expected a number from 1 to 1000, found 1001"},
      {R"({"size_mm":80,"units_mm":1})",
       "$.units_mm: contradicts size_mm: give size_mm or units_mm, not both"},
      {R"({"up":"x"})", "$.up: expected \"y\" or \"z\", found \"x\""},
      {R"({"untextured":"maybe"})",
       "$.untextured: expected \"auto\", \"blank\" or \"material\", found \"maybe\""},
      {R"({"sampler":"green"})",
       "$.sampler: expected \"centroid\", \"jittered\", \"even\", \"random\", \"halton\", \"hammersley\", "
       "\"sobol\", "
       "\"niederreiter\", \"blue\" or \"fine\", found \"green\""},
      {R"({"curve":"moore"})", "$.curve: expected \"hilbert\", \"peano2\" or \"laminar\", found \"moore\""},
      {R"({"curve":"laminar","sampler":"even"})",
       "$.sampler: laminar slices have only one way to place dots: leave sampler out"},
      {R"({"curve":"laminar","largest_gap_pitches":1})",
       "$.largest_gap_pitches: laminar slices have no strata to fill"},
      {R"({"dots":9,"largest_gap_pitches":1})",
       "$.largest_gap_pitches: contradicts dots: filling holes adds to their number"},
      {R"({"largest_gap_pitches":0.5})",
       "$.largest_gap_pitches: expected a number from 0.7 to 100, found 0.5"},
      {R"({"density":"color"})",
       "$.density: expected \"texture\", \"mean_curvature\" or \"gaussian_curvature\", found \"color\""},
      {R"({"levels":5})", "$.levels: expected a whole number from 1 to 4, found 5"},
      {R"({"levels":1.5})", "$.levels: expected a whole number from 1 to 4, found 1.5"},
      {R"({"predictive_rounds":-1})", "$.predictive_rounds: expected a whole number from 0 to 4, found -1"},
      {R"({"fine_passes":0})", "$.fine_passes: expected a whole number from 1 to 1000, found 0"},
      {R"({"tone_curve":"none"})", "$.tone_curve: expected \"calibrated\" or \"linear\", found \"none\""},
      {R"({"seed":-1})", "$.seed: expected a whole number from 0 to 18446744073709551615, found -1"},
      {R"({"max_incidence_deg":46})", "$.max_incidence_deg: expected a number from 1 to 45, found 46"},
      {R"({"max_incidence_deg":30,"preferred_incidence_deg":31})",
       "$.preferred_incidence_deg: above max_incidence_deg"},
      {R"({"planning":"slow"})",
       "$.planning: expected \"quality\", \"balanced\" or \"fast\", found \"slow\""},
      {R"({"order":"random"})", "$.order: expected \"improved\" or \"curve\", found \"random\""},
      {R"({"policy":"none"})", "$.policy: expected \"search\" or \"follow_normal\", found \"none\""},
      {R"({"fixture":{"post_height_mm":-1}})",
       "$.fixture.post_height_mm: expected a number from 0 to 1000, found -1"},
      {R"({"fixture":{"post":3}})", "$.fixture.post: unknown key"},
      {R"({"mounting":{"offset_mm":[1,2]}})",
       "$.mounting.offset_mm: expected a list of 3 numbers, found a list of 2"},
      {R"({"mounting":{"offset_mm":[0,0,-1]}})",
       "$.mounting.offset_mm: the object would stand below the post's top"},
      {R"({"mounting":{"turn_deg":361}})",
       "$.mounting.turn_deg: expected a number from -360 to 360, found 361"},
      {R"({"cell":""})", "$.cell: expected a text of 1 to 4096 bytes, found 0"},
      {R"({"dry_run":"yes"})", "$.dry_run: expected true or false, found \"yes\""},
      {R"({"size_cm":8})", "$.size_cm: unknown key; did you mean \"size_mm\"?"},
      {R"({"size":80})", "$.size: unknown key; did you mean \"size_mm\"?"},
      {R"({"color":1})", "$.color: unknown key"},
      {R"([])", "$: expected an object, found a list of 0"},
  };
  for (const Case& c : cases) EXPECT_EQ(settings_error_of(c.text), c.error);
  EXPECT_EQ(settings_error_of(R"({"dpi":9})", "job.json"),
            "job.json: $.dpi: expected a number from 10 to 1200, found 9");
}

TEST(JobSettings, PreferredIncidenceFollowsALowerMaximum) {
  EXPECT_EQ(job_settings_from_json(R"({"max_incidence_deg":15})").preferred_incidence_deg, 15);
  EXPECT_EQ(job_settings_from_json(R"({"max_incidence_deg":30})").preferred_incidence_deg, 20);
}

TEST(JobSettings, OptionsOfTheStages) {
  const SampleOptions by_dpi =
      sample_options(job_settings_from_json(R"({"dpi":254,"sampler":"even","seed":9})"));
  EXPECT_DOUBLE_EQ(by_dpi.pitch_m.value(), 1e-4);
  EXPECT_FALSE(by_dpi.dot_count);
  EXPECT_EQ(by_dpi.sampler, Sampler::kEven);
  EXPECT_EQ(by_dpi.seed, 9u);
  const SampleOptions by_count = sample_options(job_settings_from_json(R"({"dots":5000})"));
  EXPECT_EQ(by_count.dot_count, 5000u);
  EXPECT_FALSE(by_count.pitch_m);
  EXPECT_DOUBLE_EQ(sample_options(JobSettings{}).pitch_m.value(), 2.54e-4);

  const PlanOptions plan =
      plan_options(job_settings_from_json(R"({"max_incidence_deg":30,"preferred_incidence_deg":10})"));
  EXPECT_DOUBLE_EQ(plan.max_incidence, std::numbers::pi / 6);
  EXPECT_DOUBLE_EQ(plan.preferred_incidence, std::numbers::pi / 18);

  const MountingOptions as_the_cell = mounting_options(JobSettings{});
  EXPECT_FALSE(as_the_cell.post_height_m || as_the_cell.post_radius_m || as_the_cell.plate_radius_m);
  const MountingOptions mounting = mounting_options(job_settings_from_json(
      R"({"fixture":{"post_height_mm":80},"mounting":{"offset_mm":[1,-2,3],"turn_deg":90}})"));
  EXPECT_DOUBLE_EQ(mounting.post_height_m.value(), .08);
  EXPECT_DOUBLE_EQ(mounting.offset_m[1], -.002);
  EXPECT_DOUBLE_EQ(mounting.turn, std::numbers::pi / 2);
}

TEST(JobSettings, NamesOfChoicesAreThoseOfTheFile) {
  EXPECT_STREQ(sampler_name(Sampler::kCentroid), "centroid");
  EXPECT_STREQ(sampler_name(Sampler::kJittered), "jittered");
  EXPECT_STREQ(sampler_name(Sampler::kEven), "even");
  EXPECT_STREQ(sampler_name(Sampler::kRandom), "random");
  EXPECT_STREQ(sampler_name(Sampler::kFine), "fine");
  EXPECT_STREQ(curve_name(CurveKind::kLaminar), "laminar");
  EXPECT_STREQ(density_name(DensitySource::kGaussianCurvature), "gaussian_curvature");
  EXPECT_STREQ(tone_mapping_name(ToneMapping::kLinear), "linear");
  EXPECT_STREQ(untextured_name(Untextured::kAuto), "auto");
  EXPECT_STREQ(untextured_name(Untextured::kBlank), "blank");
  EXPECT_STREQ(untextured_name(Untextured::kMaterial), "material");
}

}  // namespace
}  // namespace hilbrush
