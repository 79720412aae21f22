#include "config/register_map_file.h"

#include <algorithm>
#include <charconv>
#include <system_error>

#include "config/config_folders.h"
#include "config/json_reader.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMapBytesMax = 256u << 10;
constexpr std::size_t kRegistersMax = 100;
constexpr std::size_t kStepsMax = 50;

/// Addresses, masks and codes as the drive's manual writes them: a whole number, or "0x6040".
std::uint32_t code(JsonObject& json, const std::string& key, std::uint32_t max = 0xFFFFFFFF) {
  if (!json.is_text(key)) return static_cast<std::uint32_t>(json.integer(key, 0, max));
  const std::string text = json.text(key, 12);
  std::uint32_t value = 0;
  const char* end = text.data() + text.size();
  const bool is_hex = text.starts_with("0x");
  const auto [rest, error] = std::from_chars(text.data() + (is_hex ? 2 : 0), end, value, is_hex ? 16 : 10);
  if (error != std::errc() || rest != end || text.size() < 3 || value > max)
    json.refuse(key, "\"" + text + "\" is not a number of the form 0x6040, or too large");
  return value;
}

bool share_words(const MappedRegister& one, const MappedRegister& other) {
  return one.address < other.address + other.words && other.address < one.address + one.words;
}

class MapReader {
 public:
  RegisterMap read(JsonObject& json) {
    map_.name = json.text("name", 100);
    const bool is_high_first = json.choice("word_order", {"high_first", "low_first"}) == 0;
    json.object("registers", [&](JsonObject& registers) {
      const std::vector<std::string> names = registers.keys();
      if (names.size() > kRegistersMax) json.refuse("registers", "too many");
      for (const std::string& name : names)
        registers.object(name, [&](JsonObject& entry) { read_register(entry, name, is_high_first); });
    });
    map_.position = named(json, "position");
    if (json.has("setpoint")) map_.setpoint = named(json, "setpoint");
    if (json.has("identity")) map_.identity = named(json, "identity");
    if (json.has("alarm")) map_.alarm = named(json, "alarm");
    map_.fault = read_tests(json, "fault");
    map_.enabled = read_tests(json, "enabled");
    map_.arrived = read_tests(json, "arrived");
    map_.homed = read_tests(json, "homed");
    map_.enable = read_steps(json, "enable");
    map_.disable = read_steps(json, "disable");
    map_.home = read_steps(json, "home");
    map_.prepare = read_steps(json, "prepare");
    map_.move = read_steps(json, "move");
    map_.stop = read_steps(json, "stop");
    map_.resume = read_steps(json, "resume");
    map_.clear_fault = read_steps(json, "clear_fault");
    const auto takes_target = [](const RegisterStep& step) {
      return step.source == RegisterStep::Source::kTarget;
    };
    if (std::none_of(map_.move.begin(), map_.move.end(), takes_target) &&
        std::none_of(map_.prepare.begin(), map_.prepare.end(), takes_target))
      json.refuse("move", "neither move nor prepare writes the target");
    check_prepare(json);
    if (map_.stop.empty()) json.refuse("stop", "has no step: an axis that cannot be stopped is not driven");
    if (map_.arrived.empty() && !map_.setpoint)
      json.refuse("arrived", "is empty, and there is no setpoint: the end of a move could not be detected");
    return std::move(map_);
  }

 private:
  void read_register(JsonObject& json, const std::string& name, bool is_high_first) {
    MappedRegister entry;
    entry.name = name;
    entry.address = static_cast<int>(code(json, "address", 0xFFFF));
    entry.words = static_cast<int>(json.optional_integer("words", 1, 2).value_or(1));
    entry.is_high_word_first = is_high_first;
    entry.is_signed = json.optional_boolean("signed").value_or(false);
    entry.is_single_write = json.optional_boolean("single_write").value_or(false);
    entry.per_step = json.optional_number("per_step", {-1e9, 1e9}).value_or(1);
    entry.inverse_of = json.optional_number("inverse_of", {1e-9, 1e12});
    if (entry.per_step == 0) json.refuse("per_step", "is 0");
    if (entry.is_single_write && entry.words != 1) json.refuse("single_write", "is for one word");
    map_.registers.push_back(std::move(entry));
  }

  std::size_t named(JsonObject& json, const std::string& key) {
    const std::string name = json.text(key, 100);
    for (std::size_t i = 0; i < map_.registers.size(); ++i)
      if (map_.registers[i].name == name) return i;
    json.refuse(key, "no register is called \"" + name + "\"");
  }

  std::vector<RegisterTest> read_tests(JsonObject& json, const std::string& key) {
    std::vector<RegisterTest> tests;
    if (!json.has(key)) return tests;
    json.objects(key, kStepsMax, [&](JsonObject& entry) {
      RegisterTest test{named(entry, "register"), code(entry, "mask"), code(entry, "equals")};
      if ((test.equals & ~test.mask) != 0) entry.refuse("equals", "has bits outside the mask");
      tests.push_back(test);
    });
    return tests;
  }

  std::vector<RegisterStep> read_steps(JsonObject& json, const std::string& key) {
    std::vector<RegisterStep> steps;
    if (!json.has(key)) return steps;
    json.objects(key, kStepsMax, [&](JsonObject& entry) { steps.push_back(read_step(entry)); });
    return steps;
  }

  /// `prepare` is written while the beam is on, so it must have no effect: only numbers in registers that no
  /// handshake uses.
  void check_prepare(JsonObject& json) {
    for (const RegisterStep& step : map_.prepare) {
      if (step.kind != RegisterStep::Kind::kWrite || step.source == RegisterStep::Source::kConstant)
        json.refuse("prepare", "may only write target, speed and acceleration");
      for (const auto* steps :
           {&map_.enable, &map_.disable, &map_.home, &map_.move, &map_.stop, &map_.resume, &map_.clear_fault})
        for (const RegisterStep& other : *steps)
          if (other.kind != RegisterStep::Kind::kPause &&
              share_words(map_.registers[other.reg], map_.registers[step.reg]))
            json.refuse("prepare",
                        "writes " + map_.registers[step.reg].name +
                            ", which another list uses: registers of a handshake cannot be written ahead");
    }
  }

  RegisterStep read_step(JsonObject& json) {
    RegisterStep step;
    if (json.has("pause_ms")) {
      step.kind = RegisterStep::Kind::kPause;
      step.timeout_s = json.quantity("pause_ms", {0, 10000});
    } else if (json.has("wait")) {
      step.kind = RegisterStep::Kind::kWait;
      step.reg = named(json, "wait");
      step.mask = code(json, "mask");
      step.value = code(json, "equals");
      step.timeout_s = json.quantity("timeout_ms", {1, 600000});
      if ((step.value & ~step.mask) != 0) json.refuse("equals", "has bits outside the mask");
    } else {
      step.reg = named(json, "write");
      if (json.has("from"))
        step.source =
            static_cast<RegisterStep::Source>(1 + json.choice("from", {"target", "speed", "acceleration"}));
      else
        step.value = code(json, "value");
    }
    return step;
  }

  RegisterMap map_;
};

}  // namespace

RegisterMap register_map_from_json(const std::string& text, const std::string& origin) {
  RegisterMap map;
  read_json_object(text, origin, [&](JsonObject& json) { map = MapReader().read(json); },
                   {.bytes = kMapBytesMax});
  return map;
}

RegisterMap load_register_map(const fs::path& file) {
  return register_map_from_json(read_text_file(file.string(), kMapBytesMax), file.string());
}

fs::path find_register_map(const std::string& name, const fs::path& cell_folder, const std::string& at) {
  std::error_code error;
  const bool is_path = name.find('/') != std::string::npos || name.ends_with(".json");
  const fs::path folder = shipped_folder("axes");
  fs::path file = is_path ? cell_folder / name : folder / (name + ".json");
  if (fs::is_regular_file(file, error)) return file;
  std::string known;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    known += (known.empty() ? "" : ", ") + entry->path().stem().string();
  throw InputError(at,
                   "no register map at " + file.string() + "; shipped: " + (known.empty() ? "none" : known));
}

}  // namespace hilbrush
