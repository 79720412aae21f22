#include "config/json_reader.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "sampling/base/angles.h"

namespace hilbrush {
namespace {

using Json = nlohmann::json;

struct Unit {
  std::string_view suffix;
  double si;  ///< SI units of one
};

/// Longest suffix first: _deg_s2 ends in neither _deg nor _s.
constexpr std::array<Unit, 10> kUnits{{{"_deg_s2", kDegree},
                                       {"_mm_s2", 1e-3},
                                       {"_deg_s", kDegree},
                                       {"_mm_s", 1e-3},
                                       {"_j_m2", 1},
                                       {"_deg", kDegree},
                                       {"_mm", 1e-3},
                                       {"_ms", 1e-3},
                                       {"_mw", 1e-3},
                                       {"_s", 1}}};

double unit_of(const std::string& key) {
  for (const Unit& unit : kUnits)
    if (key.ends_with(unit.suffix)) return unit.si;
  throw std::logic_error("key without a unit: " + key);  // an error of the reading code, not of the file
}

/// Thousandths are divided by 1000 rather than multiplied by .001, so that 0.1 mm and 1e-4 m are the same
/// double.
double to_si(double value, double unit) {
  return unit == 1e-3 ? value / 1e3 : value * unit;
}

/// An origin that is itself a path ("$.settings") is continued: "$.settings.dpi".
std::string join(const std::string& origin, const std::string& path) {
  if (origin.starts_with("$")) return origin + path.substr(1);
  return origin.empty() ? path : origin + ": " + path;
}

std::string format_number(double value) {
  std::ostringstream out;
  out.precision(12);
  out << value;
  return out.str();
}

/// What was found, short enough for a sentence.
std::string describe(const Json& value) {
  if (value.is_object()) return "an object";
  if (value.is_array()) return "a list of " + std::to_string(value.size());
  if (value.is_number_float()) return format_number(value.get<double>());
  constexpr std::size_t kShown = 60;
  std::string text = value.dump(-1, ' ', true);
  if (text.size() > kShown) text = text.substr(0, kShown) + "...";
  return text;
}

std::string describe(JsonRange range) {
  if (std::isinf(range.min) && std::isinf(range.max)) return "a number";
  if (std::isinf(range.max)) return "a number of at least " + format_number(range.min);
  return "a number from " + format_number(range.min) + " to " + format_number(range.max);
}

/// Keys with other characters than letters, digits, _ and - are quoted, so that a path stays readable and on
/// one line.
std::string path_step(const std::string& key) {
  const bool is_plain =
      !key.empty() && key.size() <= 60 && std::all_of(key.begin(), key.end(), [](unsigned char c) {
        return std::isalnum(c) != 0 || c == '_' || c == '-';
      });
  return is_plain ? "." + key : "[" + describe(Json(key)) + "]";
}

/// Follows the parser through the document and refuses what the finished tree no longer shows: duplicate keys
/// and depth.
class StructureCheck {
 public:
  StructureCheck(const std::string& origin, const JsonLimits& limits) : origin_(origin), limits_(limits) {}

  bool operator()(int depth, Json::parse_event_t event, Json& parsed) {
    switch (event) {
      case Json::parse_event_t::object_start:
      case Json::parse_event_t::array_start:
        if (depth >= limits_.depth)
          throw InputError(join(origin_, path()),
                           "nested more than " + std::to_string(limits_.depth) + " levels deep");
        levels_.emplace_back();
        break;
      case Json::parse_event_t::object_end:
      case Json::parse_event_t::array_end:
        levels_.pop_back();
        break;
      case Json::parse_event_t::key: {
        Level& level = levels_.back();
        level.key = parsed.get<std::string>();
        if (!level.keys.insert(level.key).second)
          throw InputError(join(origin_, path()), "this key appears twice");
        break;
      }
      case Json::parse_event_t::value:
        break;
    }
    return true;
  }

 private:
  struct Level {
    std::string key;
    std::set<std::string> keys;
  };
  std::string path() const {
    std::string path = "$";
    for (const Level& level : levels_) path += level.keys.empty() ? "[]" : path_step(level.key);
    return path;
  }

  std::string origin_;
  JsonLimits limits_;
  std::vector<Level> levels_;
};

/// Names "file:line" for files; "$", line and column for text without a file.
[[noreturn]] void refuse_syntax(const std::string& text, const std::string& origin, std::size_t byte,
                                std::string reason) {
  const std::size_t end = std::min(text.size(), byte > 0 ? byte - 1 : 0);
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(end), '\n');
  const std::size_t line_start = end == 0 ? std::string::npos : text.rfind('\n', end - 1);
  const std::size_t column = line_start == std::string::npos ? end + 1 : end - line_start;
  // The library's sentence follows "...column N: "; the text before it repeats the position.
  if (const std::size_t start = reason.find(": "); start != std::string::npos)
    reason = reason.substr(start + 2);
  if (origin.empty())
    throw InputError("$", "not JSON at line " + std::to_string(line) + ", column " + std::to_string(column) +
                              ": " + reason);
  throw InputError(origin + ":" + std::to_string(line),
                   "not JSON at column " + std::to_string(column) + ": " + reason);
}

Json parse_strictly(const std::string& text, const std::string& origin, const JsonLimits& limits) {
  if (text.size() > limits.bytes)
    throw InputError(join(origin, "$"), "longer than " + std::to_string(limits.bytes) + " bytes");
  try {
    return Json::parse(text, StructureCheck(origin, limits));
  } catch (const Json::parse_error& error) {
    refuse_syntax(text, origin, error.byte, error.what());
  } catch (const Json::exception& error) {  // a number that no double can hold
    const std::string reason = error.what();
    throw InputError(join(origin, "$"), reason.substr(std::min(reason.size(), reason.find("] ") + 2)));
  }
}

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

/// The key without its unit: max_deg, max_rad and max are the same quantity.
std::string stem(const std::string& key) {
  constexpr std::array<std::string_view, 21> kEndings{
      "_deg_s2", "_rad_s2", "_deg_s", "_rad_s", "_mm_s2", "_m_s2", "_mm_s", "_m_s", "_j_m2", "_deg", "_rad",
      "_inch",   "_mm",     "_cm",    "_um",    "_ms",    "_us",   "_mw",   "_m",   "_s",    "_w"};
  for (const std::string_view ending : kEndings)
    if (key.ends_with(ending)) return key.substr(0, key.size() - ending.size());
  return key;
}

}  // namespace

std::optional<std::string> nearest_word(const std::string& word, const std::vector<std::string>& words) {
  constexpr std::size_t kMax = 64;
  if (word.size() > kMax) return std::nullopt;
  std::optional<std::string> nearest;
  // One change in a word of up to 3 letters, at most two in a longer one: more would be guessing.
  std::size_t least = 1 + std::min<std::size_t>(2, (word.size() + 1) / 3);
  for (const std::string& candidate : words) {
    if (stem(candidate) == stem(word)) return candidate;
    if (const std::size_t distance = edit_distance(word, candidate); distance < least) {
      least = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

JsonObject::JsonObject(const Json& value, std::string origin, std::string path)
    : value_(value), origin_(std::move(origin)), path_(std::move(path)) {
  if (!value.is_object())
    throw InputError(join(origin_, path_), "expected an object, found " + describe(value));
}

bool JsonObject::is_text(const std::string& key) const {
  const auto found = value_.find(key);
  return found != value_.end() && found->is_string();
}

std::vector<std::string> JsonObject::keys() const {
  std::vector<std::string> names;
  for (const auto& [key, ignored] : value_.items()) names.push_back(key);
  return names;
}

std::string JsonObject::path_of(const std::string& key) const {
  return join(origin_, path_ + path_step(key));
}

void JsonObject::refuse(const std::string& key, const std::string& sentence) const {
  throw InputError(path_of(key), sentence);
}

bool JsonObject::has(const std::string& key) const {
  const auto found = value_.find(key);
  return found != value_.end() && !found->is_null();
}

const Json& JsonObject::value(const std::string& key, const char* expected) {
  read_keys_.insert(key);
  if (const auto found = value_.find(key); found != value_.end()) return *found;
  std::vector<std::string> unread;
  for (const auto& item : value_.items())
    if (!read_keys_.contains(item.key())) unread.push_back(item.key());
  const std::optional<std::string> instead = nearest_word(key, unread);
  refuse(key, std::string("missing: expected ") + expected +
                  (instead ? ", found the key \"" + *instead + "\" instead" : ""));
}

double JsonObject::checked_number(const Json& found, const std::string& key, JsonRange range) const {
  const double number = found.is_number() ? found.get<double>() : NAN;
  if (!(number >= range.min && number <= range.max))
    refuse(key, "expected " + describe(range) + ", found " + describe(found));
  return number;
}

double JsonObject::quantity(const std::string& key, JsonRange range) {
  return to_si(number(key, range), unit_of(key));
}

double JsonObject::number(const std::string& key, JsonRange range) {
  const std::string expected = describe(range);
  return checked_number(value(key, expected.c_str()), key, range);
}

std::uint64_t JsonObject::integer(const std::string& key, std::uint64_t min, std::uint64_t max) {
  const std::string expected = "a whole number from " + std::to_string(min) + " to " + std::to_string(max);
  const Json& found = value(key, expected.c_str());
  if (found.is_number_unsigned() && found.get<std::uint64_t>() >= min && found.get<std::uint64_t>() <= max)
    return found.get<std::uint64_t>();
  // 5e4 is a whole number too, as long as a double holds it exactly.
  if (found.is_number_float()) {
    constexpr double kExact = 9007199254740992;  // 2^53
    const double number = found.get<double>();
    if (number >= static_cast<double>(min) && number <= std::min(kExact, static_cast<double>(max)) &&
        number == std::floor(number))
      return static_cast<std::uint64_t>(number);
  }
  refuse(key, "expected " + expected + ", found " + describe(found));
}

bool JsonObject::boolean(const std::string& key) {
  const Json& found = value(key, "true or false");
  if (!found.is_boolean()) refuse(key, "expected true or false, found " + describe(found));
  return found.get<bool>();
}

std::string JsonObject::text(const std::string& key, std::size_t length_max) {
  const Json& found = value(key, "a text");
  if (!found.is_string()) refuse(key, "expected a text, found " + describe(found));
  auto text = found.get<std::string>();
  if (text.empty() || text.size() > length_max)
    refuse(key, "expected a text of 1 to " + std::to_string(length_max) + " bytes, found " +
                    std::to_string(text.size()));
  if (std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
    refuse(key, "expected a text without control characters, found " + describe(found));
  return text;
}

std::size_t JsonObject::choice(const std::string& key, const std::vector<std::string>& choices) {
  std::string expected;
  for (std::size_t i = 0; i < choices.size(); ++i)
    expected += (i == 0 ? "\"" : i + 1 == choices.size() ? " or \"" : ", \"") + choices[i] + "\"";
  const Json& found = value(key, expected.c_str());
  for (std::size_t i = 0; i < choices.size(); ++i)
    if (found == choices[i]) return i;
  refuse(key, "expected " + expected + ", found " + describe(found));
}

std::vector<double> JsonObject::numbers(const std::string& key, std::size_t count_min, std::size_t count_max,
                                        JsonRange range) {
  const std::string count = count_min == count_max
                                ? std::to_string(count_min)
                                : std::to_string(count_min) + " to " + std::to_string(count_max);
  const std::string expected = "a list of " + count + " numbers";
  const Json& found = value(key, expected.c_str());
  if (!found.is_array() || found.size() < count_min || found.size() > count_max)
    refuse(key, "expected " + expected + ", found " + describe(found));
  std::vector<double> numbers;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double number = found[i].is_number() ? found[i].get<double>() : NAN;
    if (!(number >= range.min && number <= range.max))
      throw InputError(path_of(key) + "[" + std::to_string(i) + "]",
                       "expected " + describe(range) + ", found " + describe(found[i]));
    numbers.push_back(number);
  }
  return numbers;
}

std::vector<double> JsonObject::quantities(const std::string& key, std::size_t count, JsonRange range) {
  std::vector<double> values = numbers(key, count, count, range);
  for (double& value : values) value = to_si(value, unit_of(key));
  return values;
}

void JsonObject::object(const std::string& key, const Visit& visit) {
  JsonObject inner(value(key, "an object"), origin_, path_ + path_step(key));
  visit(inner);
  inner.refuse_unread();
}

void JsonObject::objects(const std::string& key, std::size_t count_max, const Visit& visit) {
  const Json& found = value(key, "a list of objects");
  if (!found.is_array() || found.size() > count_max)
    refuse(key,
           "expected a list of at most " + std::to_string(count_max) + " objects, found " + describe(found));
  for (std::size_t i = 0; i < found.size(); ++i) {
    JsonObject inner(found[i], origin_, path_ + path_step(key) + "[" + std::to_string(i) + "]");
    visit(inner);
    inner.refuse_unread();
  }
}

std::optional<double> JsonObject::optional_number(const std::string& key, JsonRange range) {
  read_keys_.insert(key);
  return has(key) ? std::optional(number(key, range)) : std::nullopt;
}

std::optional<std::uint64_t> JsonObject::optional_integer(const std::string& key, std::uint64_t min,
                                                          std::uint64_t max) {
  read_keys_.insert(key);
  return has(key) ? std::optional(integer(key, min, max)) : std::nullopt;
}

std::optional<std::size_t> JsonObject::optional_choice(const std::string& key,
                                                       const std::vector<std::string>& choices) {
  read_keys_.insert(key);
  return has(key) ? std::optional(choice(key, choices)) : std::nullopt;
}

std::optional<std::string> JsonObject::optional_text(const std::string& key, std::size_t length_max) {
  read_keys_.insert(key);
  return has(key) ? std::optional(text(key, length_max)) : std::nullopt;
}

std::optional<bool> JsonObject::optional_boolean(const std::string& key) {
  read_keys_.insert(key);
  return has(key) ? std::optional(boolean(key)) : std::nullopt;
}

void JsonObject::refuse_unread() const {
  for (const auto& item : value_.items()) {
    if (read_keys_.contains(item.key())) continue;
    std::vector<std::string> free_keys;  // a key that is present cannot be the one that was meant
    for (const std::string& key : read_keys_)
      if (!value_.contains(key)) free_keys.push_back(key);
    const std::optional<std::string> meant = nearest_word(item.key(), free_keys);
    refuse(item.key(), meant ? "unknown key; did you mean \"" + *meant + "\"?" : "unknown key");
  }
}

void read_json_object(const std::string& text, const std::string& origin, const JsonObject::Visit& visit,
                      const JsonLimits& limits) {
  const Json document = parse_strictly(text, origin, limits);
  JsonObject root(document, origin, "$");
  visit(root);
  root.refuse_unread();
}

std::string read_text_file(const std::string& file, std::size_t bytes_max) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) throw InputError(file, "is a folder, not a file");
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(file, "cannot be opened: " + std::generic_category().message(errno));
  std::string text;
  std::array<char, 65536> block;
  while (in.read(block.data(), block.size()) || in.gcount() > 0) {
    text.append(block.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > bytes_max)
      throw InputError(file, "longer than " + std::to_string(bytes_max) + " bytes");
  }
  return text;
}

}  // namespace hilbrush
