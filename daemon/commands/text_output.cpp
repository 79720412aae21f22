#include "daemon/commands/text_output.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <sstream>
#include <vector>

#include "config/job_settings.h"
#include "daemon/commands/terminal.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kLabelWidth = 15;

/// "  label:      value\n".
std::string line(const std::string& label, const std::string& value) {
  std::ostringstream out;
  out << "  " << std::left << std::setw(kLabelWidth - 1) << printable(label) + ":" << ' ' << printable(value)
      << '\n';
  return out.str();
}

std::string fixed(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  std::ostringstream out;
  out << std::fixed << std::setprecision(digits) << value;
  return out.str();
}

bool has_number(const Json& object, const char* key) {
  return member(object, key).is_number();
}

/// A value of any type in one line.
std::string value_text(const Json& value) {
  if (value.is_string()) return printable(value.get<std::string>());
  return printable(value.dump(-1, ' ', false, Json::error_handler_t::replace));
}

std::string reason_text(const std::string& reason) {
  std::string text = reason;
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

/// "12 occluded, 3 joint limit", from an object of counts or a bare count.
std::string skipped_text(const Json& skipped) {
  if (skipped.is_number()) return format_count(skipped.get<double>()) + " skipped";
  double sum = 0;
  std::string reasons;
  if (skipped.is_object()) {
    for (const auto& [reason, count] : skipped.items()) {
      if (!count.is_number() || count.get<double>() == 0) continue;
      sum += count.get<double>();
      reasons +=
          (reasons.empty() ? "" : ", ") + format_count(count.get<double>()) + " " + reason_text(reason);
    }
  }
  return format_count(sum) + " skipped" + (reasons.empty() ? "" : " (" + reasons + ")");
}

std::string dots_text(const Json& dots) {
  const double placed = number_field(dots, "placed");
  const double exposed = number_field(dots, "exposed");
  std::string text = format_count(placed) + " placed, " + format_count(exposed) + " exposed";
  if (placed > 0) text += " (" + fixed(std::floor(1e4 * exposed / placed) / 100, 2) + " %)";
  text += ", " + skipped_text(member(dots, "skipped"));
  if (number_field(dots, "remaining") > 0)
    text += ", " + format_count(number_field(dots, "remaining")) + " remaining";
  if (number_field(dots, "in_doubt") > 0)
    text += ", " + format_count(number_field(dots, "in_doubt")) + " in doubt";
  return text;
}

std::string mesh_text(const Json& mesh) {
  std::string text = format_count(number_field(mesh, "faces")) + " faces in " +
                     format_count(number_field(mesh, "components")) +
                     (number_field(mesh, "components") == 1 ? " component" : " components");
  if (has_number(mesh, "area_mm2")) text += ", " + format_count(number_field(mesh, "area_mm2")) + " mm2";
  return text;
}

/// Three numbers, or nothing.
std::optional<std::array<double, 3>> vector_field(const Json& object, const char* key) {
  const Json& value = member(object, key);
  if (!value.is_array() || value.size() != 3) return std::nullopt;
  std::array<double, 3> numbers{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!value[i].is_number()) return std::nullopt;
    numbers[i] = value[i].get<double>();
  }
  return numbers;
}

/// How large the object is and where it stands, from `size_mm`, `min_mm` and `max_mm`: a wrong unit or offset
/// is to be seen before anything is painted.
std::string extent_lines(const Json& object) {
  constexpr int kDigits = 2;
  std::string text;
  if (const auto size = vector_field(object, "size_mm"))
    text += line("size", fixed((*size)[0], kDigits) + " x " + fixed((*size)[1], kDigits) + " x " +
                             fixed((*size)[2], kDigits) + " mm");
  const auto min = vector_field(object, "min_mm");
  const auto max = vector_field(object, "max_mm");
  if (!min || !max) return text;
  std::string place;
  for (std::size_t i = 0; i < 3; ++i)
    place += std::string(i == 0 ? "" : ", ") + "xyz"[i] + " " + fixed((*min)[i], kDigits) + " to " +
             fixed((*max)[i], kDigits);
  return text + line("place", place + " mm from the top of the post");
}

std::string repairs_text(const Json& repairs) {
  std::string text;
  if (!repairs.is_array()) return text;
  for (const Json& repair : repairs) {
    const std::string one =
        repair.is_object() ? format_count(number_field(repair, "count")) + " " + text_field(repair, "what")
                           : value_text(repair);
    text += (text.empty() ? "" : ", ") + one;
  }
  return text;
}

std::string time_text(const Json& time) {
  std::string text = format_duration(number_field(time, "total"));
  std::string parts;
  for (const char* part : {"move", "settle", "expose", "retract"})
    if (has_number(time, part))
      parts +=
          (parts.empty() ? "" : ", ") + std::string(part) + " " + format_duration(number_field(time, part));
  return text + (parts.empty() ? "" : " (" + parts + ")");
}

std::string fidelity_text(const Json& fidelity) {
  std::string text = "F1 " + fixed(number_field(fidelity, "f1_db", NAN), 1) + " dB, F2 " +
                     fixed(number_field(fidelity, "f2_db", NAN), 1) + " dB, S2 " +
                     fixed(number_field(fidelity, "s2", NAN), 3) + ", tone rms " +
                     fixed(number_field(fidelity, "tone_rms", NAN), 4);
  if (has_number(fidelity, "unreachable_share"))
    text += "; " + fixed(100 * number_field(fidelity, "unreachable_share"), 2) +
            " % of the surface is out of reach";
  return text;
}

std::string id_text(const Json& job) {
  const Json& id = member(job, "id");
  return id.is_null() ? "?" : value_text(id);
}

std::string percent_text(const Json& job) {
  return std::to_string(
             static_cast<int>(std::floor(100 * std::clamp(number_field(job, "progress"), 0., 1.)))) +
         " %";
}

std::string joints_text(const Json& joints) {
  std::string text;
  if (!joints.is_object()) return value_text(joints);
  for (const auto& [axis, value] : joints.items())
    text += (text.empty() ? "" : "  ") + axis + " " +
            (value.is_number() ? fixed(value.get<double>(), 2) : value_text(value));
  return text;
}

/// "robot ready, table ready, laser fault (interlock open)".
std::string devices_text(const Json& devices) {
  std::string text;
  for (const auto& [device, value] : devices.items()) {
    text += (text.empty() ? "" : ", ") + device + " " +
            (value.is_object() ? text_field(value, "state", "?") : value_text(value));
    if (const Json& fault = member(value, "fault"); !fault.is_null()) text += " (" + value_text(fault) + ")";
  }
  return text;
}

/// "size_mm 80, dpi 300": what differs from the defaults.
std::string settings_text(const Json& settings) {
  const Json defaults = Json::parse(job_settings_to_json(JobSettings{}), nullptr, false);
  std::string text;
  for (const auto& [key, value] : settings.items())
    if (!value.is_null() && member(defaults, key.c_str()) != value)
      text += (text.empty() ? "" : ", ") + key + " " + value_text(value);
  return text.empty() ? "all as by default" : text;
}

std::string own_time_text(const Json& timing) {
  const Json& own = member(timing, "own_ms");
  return "median " + fixed(number_field(own, "median", NAN), 2) + " ms a dot, 99 % under " +
         fixed(number_field(own, "p99", NAN), 2) + " ms";
}

/// Of skipped dots: "1,234 x tilt past its limit".
std::string cause_lines(const Json& causes) {
  std::string text;
  if (!causes.is_array()) return text;
  for (const Json& cause : causes)
    text += line("skipped", format_count(number_field(cause, "count")) + " x " + text_field(cause, "text"));
  return text;
}

void add_fields(const Json& object, const std::string& prefix, std::string& text) {
  for (const auto& [key, value] : object.items()) {
    if (value.is_object() && !value.empty())
      add_fields(value, prefix + key + ".", text);
    else
      text += printable(prefix + key) + ": " + value_text(value) + "\n";
  }
}

}  // namespace

const Json& member(const Json& object, const char* key) {
  static const Json kNull;
  if (!object.is_object()) return kNull;
  const auto found = object.find(key);
  return found == object.end() ? kNull : *found;
}

std::string text_field(const Json& object, const char* key, const std::string& otherwise) {
  const Json& value = member(object, key);
  return value.is_string() ? printable(value.get<std::string>()) : otherwise;
}

double number_field(const Json& object, const char* key, double otherwise) {
  const Json& value = member(object, key);
  return value.is_number() ? value.get<double>() : otherwise;
}

std::string format_duration(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0 || seconds > 1e10) return "-";
  const auto whole = static_cast<long long>(std::floor(seconds + .5));
  std::ostringstream out;
  out << whole / 3600 << ':' << std::setfill('0') << std::setw(2) << whole / 60 % 60 << ':' << std::setw(2)
      << whole % 60;
  return out.str();
}

std::string format_count(double count) {
  if (!std::isfinite(count) || std::abs(count) > 1e15) return "-";
  std::string digits = std::to_string(static_cast<long long>(std::llround(std::abs(count))));
  for (std::size_t i = digits.size(); i > 3; i -= 3) digits.insert(i - 3, ",");
  return (count <= -.5 ? "-" : "") + digits;
}

std::string format_report(const Json& report) {
  std::string text;
  const Json& mesh = member(report, "mesh");
  if (mesh.is_object()) {
    text += line("model", text_field(mesh, "file"));
    if (has_number(mesh, "faces")) text += line("mesh", mesh_text(mesh));
    text += extent_lines(mesh);
    if (const std::string repairs = repairs_text(member(mesh, "repairs")); !repairs.empty())
      text += line("repaired", repairs);
  }
  if (const Json& dots = member(report, "dots"); dots.is_object()) text += line("dots", dots_text(dots));
  text += cause_lines(member(report, "skipped"));
  if (const Json& suggestion = member(report, "suggestion"); suggestion.is_object())
    text += line("suggestion", text_field(suggestion, "text"));
  if (has_number(report, "pitch_mm"))
    text += line("pitch", fixed(number_field(report, "pitch_mm"), 3) + " mm");
  if (const Json& incidence = member(report, "incidence_deg"); incidence.is_object())
    text += line("incidence", "mean " + fixed(number_field(incidence, "mean"), 1) + ", 95 % below " +
                                  fixed(number_field(incidence, "p95"), 1) + ", at most " +
                                  fixed(number_field(incidence, "max"), 1) + " degrees");
  if (const Json& time = member(report, "time_s"); time.is_object())
    text += line("painting time", time_text(time));
  if (const Json& fidelity = member(report, "fidelity"); fidelity.is_object())
    text += line("fidelity", fidelity_text(fidelity));
  if (const Json& stages = member(report, "stages_s"); stages.is_object() && has_number(stages, "total"))
    text += line("computed in", fixed(number_field(stages, "total"), 1) + " s, " +
                                    format_count(number_field(report, "peak_rss_mb")) + " MB");
  if (const Json& warnings = member(mesh, "warnings"); warnings.is_array())
    for (const Json& warning : warnings) text += line("warning", value_text(warning));
  return text;
}

std::string format_tone_curve(const Json& curve) {
  const Json& wanted = member(curve, "wanted");
  const Json& asked = member(curve, "asked");
  std::string text;
  if (!wanted.is_array() || !asked.is_array()) return format_fields(curve);
  if (const std::string sampler = text_field(curve, "sampler"); !sampler.empty())
    text += line("sampler", sampler);
  text += "  wanted  asked\n";
  for (std::size_t i = 0; i < std::min(wanted.size(), asked.size()); ++i)
    if (wanted[i].is_number() && asked[i].is_number())
      text += "  " + fixed(wanted[i].get<double>(), 2) + "    " + fixed(asked[i].get<double>(), 4) + "\n";
  return text;
}

namespace {

/// ", copy 1 of 2" while a part of a job of several copies is painted or waited for.
std::string copy_text(const Json& job) {
  const double copies = number_field(job, "copies");
  const std::string state = text_field(job, "state");
  if (copies <= 1 || (state != "ready" && state != "painting" && state != "paused")) return {};
  return ", copy " + format_count(std::min(number_field(job, "copies_done") + 1, copies)) + " of " +
         format_count(copies);
}

}  // namespace

std::string format_job_line(const Json& job) {
  const Json& dots = member(job, "dots");
  const std::string state = text_field(job, "state", "?");
  const std::string stage = text_field(job, "stage");
  std::string text = "job " + id_text(job) + ": " + state + copy_text(job);
  if (state == "planning") return text + (stage.empty() ? "" : ", " + stage) + " " + percent_text(job);
  if (const double placed = number_field(dots, "placed"); placed > 0)
    text +=
        ", " + format_count(number_field(dots, "exposed")) + " of " + format_count(placed) + " dots exposed";
  if (state == "painting" || state == "paused") text += ", " + percent_text(job);
  if (has_number(job, "eta_s")) text += ", about " + format_duration(number_field(job, "eta_s")) + " left";
  if (const std::string why = format_job_error(job); state == "paused" && !why.empty()) text += ": " + why;
  return text;
}

std::string format_job_brief(const Json& job) {
  const std::string state = text_field(job, "state", "?");
  if (state != "painting" && state != "paused") return format_job_line(job);
  std::string text = "job " + id_text(job) + ": " + state + copy_text(job) + ", " + percent_text(job);
  if (has_number(job, "eta_s")) text += ", " + format_duration(number_field(job, "eta_s")) + " left";
  const Json& dots = member(job, "dots");
  return text + ", " + format_count(number_field(dots, "exposed")) + " of " +
         format_count(number_field(dots, "placed")) + " dots";
}

std::string format_job_wait(const Json& job) {
  const std::string state = text_field(job, "state");
  const std::string what = state == "ready" ? "start" : state == "paused" ? "resume" : "";
  if (what.empty()) return {};
  return "job " + id_text(job) + " waits for `hilbrush " + what + " " + id_text(job) +
         "`; the cell must be armed (`hilbrush clear`, `hilbrush arm`)";
}

std::string format_job_error(const Json& job) {
  const Json& error = member(job, "error");
  if (!error.is_object()) return error.is_null() ? std::string() : value_text(error);
  const std::string at = text_field(error, "at");
  const std::string message = text_field(error, "message");
  return at.empty() ? message : at + ": " + message;
}

std::string format_plan(const Json& job) {
  const Json& plan = member(job, "plan");
  if (!plan.is_object()) return {};
  std::string text = extent_lines(plan) + cause_lines(member(plan, "skipped"));
  if (const std::string suggestion = text_field(plan, "suggestion"); !suggestion.empty())
    text += line("suggestion", suggestion);
  return text;
}

std::string format_warnings(const Json& job) {
  std::string text;
  if (const Json& warnings = member(job, "warnings"); warnings.is_array())
    for (const Json& warning : warnings) text += "warning: " + value_text(warning) + "\n";
  return text;
}

std::string format_job(const Json& job) {
  std::string text = line("job", id_text(job)) + line("state", text_field(job, "state", "?"));
  text += line("model", text_field(job, "model"));
  text += line("kind", member(job, "dry_run") == true ? "dry run" : "real");
  text += line("progress",
               percent_text(job) + (has_number(job, "eta_s")
                                        ? ", about " + format_duration(number_field(job, "eta_s")) + " left"
                                        : ""));
  if (const Json& dots = member(job, "dots"); dots.is_object()) text += line("dots", dots_text(dots));
  text += format_plan(job);
  if (const double copies = number_field(job, "copies"); copies > 1)
    text += line("copies",
                 format_count(number_field(job, "copies_done")) + " of " + format_count(copies) + " painted");
  if (member(job, "needs_part_in_place") == true)
    text += line("part", "must be confirmed to be in its place");
  if (const Json& timing = member(job, "timing"); timing.is_object()) {
    text += line("own time", own_time_text(timing));
    if (const Json& measured = member(timing, "measured"); measured.is_object()) {
      const bool is_too_little = member(timing, "measured_is_enough") == false;
      text +=
          line("measured", measured.dump() + (is_too_little ? ", from too few moves for a cell file: " +
                                                                  value_text(member(timing, "measured_moves"))
                                                            : ""));
    }
  }
  if (const std::string error = format_job_error(job); !error.empty()) text += line("error", error);
  if (const Json& settings = member(job, "settings"); settings.is_object())
    text += line("settings", settings_text(settings));
  if (const Json& warnings = member(job, "warnings"); warnings.is_array())
    for (const Json& warning : warnings) text += line("warning", value_text(warning));
  static constexpr std::array kShown{"id",       "state",    "model",       "dry_run",
                                     "progress", "eta_s",    "dots",        "error",
                                     "warnings", "copies",   "copies_done", "needs_part_in_place",
                                     "timing",   "settings", "plan"};
  for (const auto& [key, value] : job.items()) {
    const bool is_shown =
        std::any_of(kShown.begin(), kShown.end(), [&k = key](const char* shown) { return k == shown; });
    if (!is_shown && !value.is_null() && !(value.is_structured() && value.empty()))
      text += line(reason_text(key), value_text(value));
  }
  return text;
}

std::string format_job_table(const Json& jobs) {
  if (!jobs.is_array() || jobs.empty()) return "no jobs\n";
  std::vector<std::array<std::string, 6>> rows{{"ID", "STATE", "KIND", "DOTS", "DONE", "MODEL"}};
  for (const Json& job : jobs)
    rows.push_back({id_text(job), text_field(job, "state", "?"),
                    member(job, "dry_run") == true ? "dry" : "real",
                    format_count(number_field(member(job, "dots"), "placed")), percent_text(job),
                    text_field(job, "model")});
  std::array<std::size_t, 6> widths{};
  for (const auto& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  std::string text;
  for (const auto& row : rows) {
    for (std::size_t i = 0; i + 1 < row.size(); ++i) {
      const std::string padding(widths[i] - row[i].size(), ' ');
      const bool is_number = i == 3 || i == 4;
      text += (is_number ? padding + row[i] : row[i] + padding) + "  ";
    }
    text += row.back() + "\n";
  }
  return text;
}

std::string format_cell_line(const Json& cell) {
  std::string text = "cell: " + text_field(cell, "state", "?") + ", laser " + text_field(cell, "laser", "?");
  for (const char* key : {"reason", "fault"})
    if (const Json& why = member(cell, key); !why.is_null()) text += ", " + value_text(why);
  return text;
}

std::string format_cell(const Json& cell) {
  std::string text = line("cell", text_field(cell, "state", "?"));
  if (const Json& reason = member(cell, "reason"); !reason.is_null())
    text += line("reason", value_text(reason));
  if (const Json& fault = member(cell, "fault"); !fault.is_null()) text += line("fault", value_text(fault));
  text += line("laser", text_field(cell, "laser", "?"));
  if (const Json& interlock = member(cell, "interlock"); !interlock.is_null())
    text += line("interlock", value_text(interlock));
  if (const Json& job = member(cell, "job"); !job.is_null()) text += line("job", value_text(job));
  if (const Json& devices = member(cell, "devices"); devices.is_object())
    text += line("devices", devices_text(devices));
  if (const Json& joints = member(cell, "joints"); !joints.is_null())
    text += line("joints", joints_text(joints));
  static constexpr std::array kShown{"state",   "laser",  "fault",  "job",
                                     "devices", "joints", "reason", "interlock"};
  for (const auto& [key, value] : cell.items()) {
    const bool is_shown =
        std::any_of(kShown.begin(), kShown.end(), [&k = key](const char* shown) { return k == shown; });
    if (!is_shown && !value.is_null()) text += line(reason_text(key), value_text(value));
  }
  return text;
}

std::string format_fields(const Json& object) {
  if (!object.is_object()) return value_text(object) + "\n";
  std::string text;
  add_fields(object, "", text);
  return text;
}

}  // namespace hilbrush
