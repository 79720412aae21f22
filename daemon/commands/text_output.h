#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

/// Answers of the daemon and reports of the pipeline as text for people. Fields may be missing or of another
/// type, if the other program is newer or older: they are left out and cause no failure. The only control
/// characters in a text are line ends.
namespace hilbrush {

/// 3725.4 -> "1:02:05".
std::string format_duration(double seconds);
/// 1234567 -> "1,234,567".
std::string format_count(double count);

/// The report of a dry run, plan or develop: dots, incidence, time, fidelity, repairs, warnings. Several
/// lines.
std::string format_report(const nlohmann::ordered_json& report);
/// A tone curve as a table of wanted and asked coverage.
std::string format_tone_curve(const nlohmann::ordered_json& curve);

/// One line: state, stage or counts, ETA.
std::string format_job_line(const nlohmann::ordered_json& job);
/// The same for beside a progress bar: what matters most comes first.
std::string format_job_brief(const nlohmann::ordered_json& job);
/// For a job that waits for its operator, the command that it waits for; or nothing.
std::string format_job_wait(const nlohmann::ordered_json& job);
/// "cup.wrl:12: no geometry", or nothing.
std::string format_job_error(const nlohmann::ordered_json& job);
/// What is to be seen of a planned job before it is painted: size and place of the object, the causes of
/// skipped dots, the suggestion. Several lines, or nothing.
std::string format_plan(const nlohmann::ordered_json& job);
/// The warnings of a job, each in a line.
std::string format_warnings(const nlohmann::ordered_json& job);
/// Everything about one job.
std::string format_job(const nlohmann::ordered_json& job);
/// A table, one job a line, under a heading.
std::string format_job_table(const nlohmann::ordered_json& jobs);

/// One line: state, laser, reason.
std::string format_cell_line(const nlohmann::ordered_json& cell);
/// State of the cell, its laser, devices, joints and fault.
std::string format_cell(const nlohmann::ordered_json& cell);

/// "key: value" lines of any object; nested keys with dots.
std::string format_fields(const nlohmann::ordered_json& object);

/// Fields, or the defaults if absent or of another type.
std::string text_field(const nlohmann::ordered_json& object, const char* key,
                       const std::string& otherwise = {});
double number_field(const nlohmann::ordered_json& object, const char* key, double otherwise = 0);
/// The member, or null.
const nlohmann::ordered_json& member(const nlohmann::ordered_json& object, const char* key);

}  // namespace hilbrush
