#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sampling/base/input_error.h"

/// Strict reading of JSON that people write. Every value is read by key, with its range. Keys that are not
/// read are errors, and so are duplicate keys, wrong types and documents that are too large or too deep. Each
/// error is an InputError whose at() is "<origin>: <JSON path>" (or the path alone), such as
/// "cells/default.json: $.axes.j1.max_deg". An origin that is a JSON path is continued by the path.
///
/// The unit is part of the key (max_deg, radius_mm, power_max_mw); values are returned in SI units.
namespace hilbrush {

struct JsonLimits {
  std::size_t bytes = 1u << 20;
  int depth = 16;
};

/// Inclusive, in the unit of the key.
struct JsonRange {
  double min, max;
};

/// One object of the document. Valid only during the visit that receives it; when the visit returns, every
/// key must have been read.
class JsonObject {
 public:
  JsonObject(const nlohmann::json& value, std::string origin, std::string path);

  bool has(const std::string& key) const;      ///< false also if the value is null
  bool is_text(const std::string& key) const;  ///< for keys that may hold a text or something else
  std::vector<std::string> keys() const;       ///< for objects whose keys are names

  /// A number whose key ends in a unit, returned in SI units. json_reader.cpp lists the units.
  double quantity(const std::string& key, JsonRange range);
  /// A number without a unit.
  double number(const std::string& key, JsonRange range);
  std::uint64_t integer(const std::string& key, std::uint64_t min, std::uint64_t max);
  bool boolean(const std::string& key);
  /// 1 to `length_max` bytes, without control characters.
  std::string text(const std::string& key, std::size_t length_max = 200);
  /// The index in `choices` of the text.
  std::size_t choice(const std::string& key, const std::vector<std::string>& choices);
  std::vector<double> numbers(const std::string& key, std::size_t count_min, std::size_t count_max,
                              JsonRange range);
  /// A list of numbers whose key ends in a unit, returned in SI units.
  std::vector<double> quantities(const std::string& key, std::size_t count, JsonRange range);

  using Visit = std::function<void(JsonObject&)>;
  void object(const std::string& key, const Visit& visit);
  void objects(const std::string& key, std::size_t count_max, const Visit& visit);

  /// The same as above if has(key), else nothing. An optional key may be null.
  std::optional<double> optional_number(const std::string& key, JsonRange range);
  std::optional<std::uint64_t> optional_integer(const std::string& key, std::uint64_t min, std::uint64_t max);
  std::optional<std::size_t> optional_choice(const std::string& key, const std::vector<std::string>& choices);
  std::optional<std::string> optional_text(const std::string& key, std::size_t length_max = 200);
  std::optional<bool> optional_boolean(const std::string& key);

  /// For errors that need more than one value: two keys that contradict each other.
  [[noreturn]] void refuse(const std::string& key, const std::string& sentence) const;
  /// Refuses keys that were not read. Called when a visit returns.
  void refuse_unread() const;

 private:
  std::string path_of(const std::string& key) const;
  const nlohmann::json& value(const std::string& key, const char* expected);
  double checked_number(const nlohmann::json& found, const std::string& key, JsonRange range) const;

  const nlohmann::json& value_;
  std::string origin_, path_;
  std::set<std::string> read_keys_;
};

/// Parses `text` and visits its top-level object. `origin` names the file in errors; it may be empty.
void read_json_object(const std::string& text, const std::string& origin, const JsonObject::Visit& visit,
                      const JsonLimits& limits = {});

/// Reads a whole file of limited size. @throws InputError naming the file.
std::string read_text_file(const std::string& file, std::size_t bytes_max);

/// The one of `words` that `word` is probably a misspelling of, or nothing.
std::optional<std::string> nearest_word(const std::string& word, const std::vector<std::string>& words);

}  // namespace hilbrush
