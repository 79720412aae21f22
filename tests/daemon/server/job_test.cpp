#include "daemon/server/job.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/daemon/server/daemon_fixture.h"

/// A job's record, and the plan that its reply shows.
namespace hilbrush {
namespace {

using test::Json;

TEST(JobRecordTest, SaysAllOfAJobAndReadsWhateverItIsGiven) {
  Job job;
  job.id = 12;
  job.key = "k\"\xff";
  job.state = JobState::kPaused;
  job.model = "/a b.wrl";
  job.copies = 3;
  job.copies_done = 1;
  job.is_begun = true;
  job.error = JobError{"x:1", "no"};
  job.warnings = {"one", "two"};
  job.measured = R"({"move_delay_ms":1.5})";
  job.plan = R"({"suggestion":"none"})";
  const auto back = job_from_record(job_to_record(job));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->id, 12);
  EXPECT_EQ(back->state, JobState::kPaused);
  EXPECT_EQ(back->copies_done, 1);
  EXPECT_TRUE(back->is_begun);
  EXPECT_EQ(back->error->message, "no");
  EXPECT_EQ(back->warnings, job.warnings);
  EXPECT_EQ(back->measured, job.measured);
  EXPECT_EQ(back->plan, job.plan);
  for (const char* text :
       {"", "[]", "{", "{}", R"({"id":-1,"state":"done"})", R"({"id":1,"state":"asleep"})"})
    EXPECT_FALSE(job_from_record(text)) << text;
  const auto odd =
      job_from_record(R"({"id":1,"state":"done","copies":"many","warnings":7,"error_message":[]})");
  ASSERT_TRUE(odd);
  EXPECT_EQ(odd->copies, 1);
}

TEST(JobRecordTest, ThePlanIsBoundedWhateverTheReportHolds) {
  for (const Json& odd :
       {Json(nullptr), Json("text"), Json::array({1}), Json::parse(R"({"mesh":7,"skipped":{"a":1}})"),
        Json::parse(R"({"mesh":{"size_mm":[1,"x",3]},"skipped":[5,null,{"count":"n"}]})")}) {
    const Json plan = plan_of_report(odd);
    EXPECT_TRUE(plan.at("size_mm").is_null());
    EXPECT_TRUE(plan.at("skipped").empty());
    EXPECT_TRUE(plan.at("suggestion").is_null());
  }
  Json large;
  for (int i = 0; i < 1000; ++i)
    large["skipped"].push_back({{"count", i}, {"text", std::string(100000, 'x')}});
  large["suggestion"] = {{"text", std::string(100000, 'x')}};
  EXPECT_LT(plan_of_report(large).dump().size(), 4000u);
}

}  // namespace
}  // namespace hilbrush
