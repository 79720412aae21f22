#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "daemon/commands/progress_display.h"
#include "daemon/commands/terminal.h"
#include "daemon/commands/text_output.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

const Json kReport = Json::parse(R"({
  "mesh":{"file":"eggcup.wrl","faces":12345,"components":1,"area_mm2":18234.56,
          "size_mm":[48.14,48.2,60],"min_mm":[-24.07,-24.1,0],"max_mm":[24.07,24.1,60],
          "repairs":[{"what":"vertices welded","count":3},{"what":"degenerate triangles dropped","count":1200}],
          "warnings":["texture a.png is missing"]},
  "dots":{"requested":1000,"placed":1000,"exposed":990,"in_doubt":1,"remaining":2,"skipped":{"occluded":4,"joint_limit":3,"energy":0}},
  "pitch_mm":0.254,
  "incidence_deg":{"mean":10.04,"p95":21.96,"max":44.9},
  "time_s":{"move":3000,"settle":600.4,"expose":59.6,"retract":0,"total":3660},
  "fidelity":{"f1_db":26.04,"f2_db":36.96,"s2":0.9501,"tone_rms":0.0041,"unreachable_share":0.0012},
  "stages_s":{"load":0.1,"total":7.25},"peak_rss_mb":412.3})");

TEST(TextOutput, DurationsAndCounts) {
  EXPECT_EQ(format_duration(0), "0:00:00");
  EXPECT_EQ(format_duration(59.6), "0:01:00");
  EXPECT_EQ(format_duration(3725.4), "1:02:05");
  EXPECT_EQ(format_duration(360000), "100:00:00");
  EXPECT_EQ(format_duration(-1), "-");
  EXPECT_EQ(format_duration(std::numeric_limits<double>::infinity()), "-");
  EXPECT_EQ(format_count(0), "0");
  EXPECT_EQ(format_count(999), "999");
  EXPECT_EQ(format_count(1000), "1,000");
  EXPECT_EQ(format_count(1234567), "1,234,567");
  EXPECT_EQ(format_count(-1234), "-1,234");
  EXPECT_EQ(format_count(std::numeric_limits<double>::quiet_NaN()), "-");
}

TEST(TextOutput, ReportSaysWhatAPersonNeeds) {
  EXPECT_EQ(
      format_report(kReport),
      "  model:         eggcup.wrl\n"
      "  mesh:          12,345 faces in 1 component, 18,235 mm2\n"
      "  size:          48.14 x 48.20 x 60.00 mm\n"
      "  place:         x -24.07 to 24.07, y -24.10 to 24.10, z 0.00 to 60.00 mm from the top of the post\n"
      "  repaired:      3 vertices welded, 1,200 degenerate triangles dropped\n"
      "  dots:          1,000 placed, 990 exposed (99.00 %), 7 skipped (4 occluded, 3 joint limit), 2 "
      "remaining, 1 in "
      "doubt\n"
      "  pitch:         0.254 mm\n"
      "  incidence:     mean 10.0, 95 % below 22.0, at most 44.9 degrees\n"
      "  painting time: 1:01:00 (move 0:50:00, settle 0:10:00, expose 0:01:00, retract 0:00:00)\n"
      "  fidelity:      F1 26.0 dB, F2 37.0 dB, S2 0.950, tone rms 0.0041; 0.12 % of the surface is out of "
      "reach\n"
      "  computed in:   7.2 s, 412 MB\n"
      "  warning:       texture a.png is missing\n");
}

TEST(TextOutput, SkippedDotsHaveAmountsAndASuggestion) {
  Json report = kReport;
  report["skipped"] =
      Json::parse(R"([{"reason":"incidence","count":1234,"text":"tilt past its limit, typically by 2.1"},
                                      {"reason":"occluded","count":4,"text":"beam blocked"}])");
  report["suggestion"] = Json::parse(R"({"text":"a post of 90 mm would reach more"})");
  const std::string text = format_report(report);
  EXPECT_NE(text.find("  skipped:       1,234 x tilt past its limit, typically by 2.1\n"), std::string::npos)
      << text;
  EXPECT_NE(text.find("  skipped:       4 x beam blocked\n"), std::string::npos) << text;
  EXPECT_NE(text.find("  suggestion:    a post of 90 mm would reach more\n"), std::string::npos) << text;
  report["suggestion"] = nullptr;
  EXPECT_EQ(format_report(report).find("suggestion"), std::string::npos);
}

TEST(TextOutput, SharesAreNeverRoundedUpToAll) {
  Json report = kReport;
  report["dots"]["placed"] = 1'000'000;
  report["dots"]["exposed"] = 999'999;
  EXPECT_NE(format_report(report).find("(99.99 %)"), std::string::npos);
}

TEST(TextOutput, JobLineDependsOnTheState) {
  const auto line = [](const char* json) { return format_job_line(Json::parse(json)); };
  EXPECT_EQ(line(R"({"id":"7","state":"queued","dots":{"placed":0},"progress":0.0,"eta_s":null})"),
            "job 7: queued");
  EXPECT_EQ(line(R"({"id":"7","state":"planning","stage":"disk","progress":0.425})"),
            "job 7: planning, disk 42 %");
  EXPECT_EQ(
      line(
          R"({"id":"7","state":"painting","dots":{"placed":2000,"exposed":500},"progress":0.25,"eta_s":65})"),
      "job 7: painting, 500 of 2,000 dots exposed, 25 %, about 0:01:05 left");
  EXPECT_EQ(line(R"({"id":7,"state":"done","dots":{"placed":2000,"exposed":1999},"progress":1})"),
            "job 7: done, 1,999 of 2,000 dots exposed");
  EXPECT_EQ(line("{}"), "job ?: ?");
}

TEST(TextOutput, JobShowsErrorWarningsAndWhatItDoesNotKnow) {
  const std::string text = format_job(Json::parse(
      R"({"id":"7","state":"failed","model":"/m/cup.wrl","dry_run":true,"progress":0,"eta_s":null,
          "error":{"at":"cup.wrl:12","message":"no geometry"},"warnings":["w1","w2"],"in_doubt":[3,17],"new_field":5,"empty":[]})"));
  EXPECT_NE(text.find("kind:          dry run\n"), std::string::npos) << text;
  EXPECT_NE(text.find("error:         cup.wrl:12: no geometry\n"), std::string::npos) << text;
  EXPECT_NE(text.find("warning:       w2\n"), std::string::npos) << text;
  EXPECT_NE(text.find("in doubt:      [3,17]\n"), std::string::npos) << text;
  EXPECT_NE(text.find("new field:     5\n"), std::string::npos) << text;
  EXPECT_EQ(text.find("empty"), std::string::npos) << text;
}

TEST(TextOutput, MotionFromTooFewMovesIsNotForACellFile) {
  Json job = Json::parse(R"({"id":"7","state":"done","timing":{"own_ms":{"median":1,"p99":2},
      "measured":{"move_delay_ms":1,"time_factor":{"j1":1.57}},"measured_moves":{"j1":232},"measured_is_enough":false}})");
  EXPECT_NE(format_job(job).find("\"j1\":1.57}}, from too few moves for a cell file: {\"j1\":232}\n"),
            std::string::npos)
      << format_job(job);
  job["timing"]["measured_is_enough"] = true;
  EXPECT_EQ(format_job(job).find("too few"), std::string::npos);
}

TEST(TextOutput, JobsAreATable) {
  EXPECT_EQ(format_job_table(Json::array()), "no jobs\n");
  EXPECT_EQ(
      format_job_table(Json::parse(
          R"([{"id":"7","state":"painting","dry_run":false,"dots":{"placed":12345},"progress":0.5,"model":"/a/cup.wrl"},
                    {"id":"12","state":"done","dry_run":true,"dots":{"placed":9},"progress":1,"model":"/b.obj"}])")),
      "ID  STATE     KIND    DOTS   DONE  MODEL\n"
      "7   painting  real  12,345   50 %  /a/cup.wrl\n"
      "12  done      dry        9  100 %  /b.obj\n");
}

TEST(TextOutput, CellShowsStateFaultDevicesAndJoints) {
  const Json cell = Json::parse(
      R"({"state":"stopped","laser":"off","interlock":"open","devices":{"robot":{"state":"ready","fault":null},"laser":{"state":"fault","fault":"interlock open"}},
          "joints":{"j1_deg":1.25,"j3_mm":290},"job":null,"fault":"interlock open","time_scale":0})");
  EXPECT_EQ(format_cell(cell),
            "  cell:          stopped\n"
            "  fault:         interlock open\n"
            "  laser:         off\n"
            "  interlock:     open\n"
            "  devices:       robot ready, laser fault (interlock open)\n"
            "  joints:        j1_deg 1.25  j3_mm 290.00\n"
            "  time scale:    0\n");
  EXPECT_EQ(format_cell_line(cell), "cell: stopped, laser off, interlock open");
}

TEST(TextOutput, NoTextCanSteerTheTerminal) {
  Json report = kReport;
  report["mesh"]["file"] =
      "\033[2Jx\r\n\xc2\x9b"
      "31m\x7f";
  const std::string text =
      format_report(report) + format_job(Json{{"id", "\033]0;x\a"}, {"model", "a\nb"}, {"k\033[1m", "v"}});
  for (const char c : text)
    EXPECT_TRUE(c == '\n' || static_cast<unsigned char>(c) >= 0x20) << static_cast<int>(c);
  EXPECT_EQ(text.find("\xc2\x9b"), std::string::npos);
  EXPECT_EQ(printable("Gr\xc3\xbc\xc3\x9f"
                      "e"),
            "Gr\xc3\xbc\xc3\x9f"
            "e");  // UTF-8 stays
}

/// Replaces values at random places by others of any type.
void mutate(Json& json, std::mt19937& random) {
  const Json values[] = {
      nullptr, true, -1, 1e300, "text", Json::array({1, "x", nullptr}), Json::object({{"a", 1}})};
  if (json.is_structured() && !json.empty() && random() % 4 != 0) {
    auto member = json.begin();
    std::advance(member, random() % json.size());
    mutate(*member, random);
  } else {
    json = values[random() % std::size(values)];
  }
}

TEST(TextOutput, AnswersOfAnotherShapeNeverThrow) {
  constexpr unsigned kSeed = 3;
  std::mt19937 random(kSeed);
  for (int round = 0; round < 5000; ++round) {
    Json json = kReport;
    for (unsigned i = 0; i <= random() % 4; ++i) mutate(json, random);
    EXPECT_NO_THROW(format_report(json)) << "seed " << kSeed << ", round " << round;
    EXPECT_NO_THROW(format_tone_curve(json));
    EXPECT_NO_THROW(format_job(json));
    EXPECT_NO_THROW(format_job_line(json));
    EXPECT_NO_THROW(format_job_table(Json::array({json})));
    EXPECT_NO_THROW(format_cell(json));
    EXPECT_NO_THROW(format_cell_line(json));
    EXPECT_NO_THROW(format_fields(json));
  }
}

TEST(ProgressDisplay, APipeGetsALineForEachPhaseAndTenth) {
  std::ostringstream out, err;
  std::istringstream in;
  Terminal terminal{out, err, in};
  ProgressDisplay display(terminal, false);
  display.show("plan", .1, "plan");
  display.show("plan", .9, "plan again");
  display.show("check", 0, "check");
  for (int i = 0; i <= 100; ++i) display.show("painting", i / 100., std::to_string(i), true);
  display.finish();
  EXPECT_EQ(out.str(), "plan\ncheck\n0\n10\n20\n30\n40\n50\n60\n70\n80\n90\n100\n");
}

TEST(ProgressDisplay, ATerminalGetsABarThatFitsAndGoesAway) {
  std::ostringstream out, err;
  std::istringstream in;
  Terminal terminal{out, err, in, true, true, 40};
  ProgressDisplay display(terminal, false);
  display.show("plan", .5, "plan 50 %");
  EXPECT_EQ(out.str(), "[############............] plan 50 %");
  display.show("plan", .5, "plan 50 %");  // nothing new
  EXPECT_EQ(out.str(), "[############............] plan 50 %");
  out.str("");
  display.show("plan", 2, std::string(100, 'x'));
  EXPECT_EQ(out.str(), "\r\033[K[########] " + std::string(28, 'x'));
  out.str("");
  display.print_above("warning: w");
  EXPECT_EQ(err.str(), "warning: w\n");
  display.finish();
  EXPECT_TRUE(out.str().ends_with("\r\033[K"));
}

TEST(ProgressDisplay, TheTimeLeftIsNeverCutAtEightyColumns) {
  const Json job = Json::parse(
      R"({"id":"12345","state":"painting","copies":1000,"copies_done":99,"progress":0.25,"eta_s":36065,
          "dots":{"placed":2000000,"exposed":500000}})");
  std::ostringstream out, err;
  std::istringstream in;
  Terminal terminal{out, err, in, true, true, 80};
  {
    ProgressDisplay display(terminal, false);
    display.show("painting", .25, format_job_brief(job));
    EXPECT_EQ(out.str(), "[##......] job 12345: painting, copy 100 of 1,000, 25 %, 10:01:05 left");
    out.str("");
  }
  terminal.width = 200;
  ProgressDisplay wide(terminal, false);
  out.str("");
  wide.show("painting", .25, format_job_brief(job));
  EXPECT_TRUE(out.str().ends_with(" left, 500,000 of 2,000,000 dots")) << out.str();
}

TEST(ProgressDisplay, AWindowThatIsResizedKeepsOneBar) {
  std::ostringstream out, err;
  std::istringstream in;
  int columns = 80;
  Terminal terminal{out, err, in, true, true, 80, [&columns] { return columns; }};
  ProgressDisplay display(terminal, false);
  display.show("plan", .5, std::string(50, 'x'));  // 77 columns
  out.str("");
  columns = 30;  // wrapped into three rows by the terminal
  display.show("plan", .5, std::string(50, 'x'));
  EXPECT_EQ(out.str(), "\033[2A\r\033[J[####....] " + std::string(18, 'x'));
  out.str("");
  columns = 100;
  display.show("plan", .5, std::string(50, 'x'));
  EXPECT_EQ(out.str(), "\r\033[K[############............] " + std::string(50, 'x'));
}

TEST(ProgressDisplay, QuietShowsNothing) {
  std::ostringstream out, err;
  std::istringstream in;
  Terminal terminal{out, err, in, true};
  ProgressDisplay display(terminal, true);
  display.show("plan", .5, "plan");
  display.finish();
  EXPECT_EQ(out.str(), "");
}

}  // namespace
}  // namespace hilbrush
