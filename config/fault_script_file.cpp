#include "config/fault_script_file.h"

#include <algorithm>
#include <vector>

#include "config/json_reader.h"
#include "planner/cell_model/cell_description.h"

namespace hilbrush {
namespace {

constexpr std::size_t kFaultsMax = 10'000;
constexpr std::size_t kScriptBytesMax = 4u << 20;
constexpr double kMaxS = 86'400;
constexpr std::uint64_t kCountMax = 1'000'000'000;

template <std::size_t N>
std::vector<std::string> names(const std::array<const char*, N>& table) {
  return {table.begin(), table.end()};
}

void read_trigger(JsonObject& json, WireFault& fault) {
  FaultTrigger& trigger = fault.trigger;
  if (json.has("at_s")) trigger.at_s = json.quantity("at_s", {0, kMaxS});
  if (is_of_exchange(fault.kind) || json.has("device"))
    trigger.at_message = json.optional_integer("at_message", 1, kCountMax);
  if (const auto phase = json.optional_choice("phase", names(kCellPhaseNames))) {
    trigger.phase = static_cast<CellPhase>(*phase);
    trigger.occurrence = json.optional_integer("occurrence", 1, kCountMax).value_or(1);
    if (json.has("delay_ms")) trigger.delay_s = json.quantity("delay_ms", {0, kMaxS * 1e3});
  }
  if (!trigger.at_s && !trigger.at_message && !trigger.phase)
    json.refuse("kind", "has no trigger: give at_s, at_message (with device) or phase");
}

bool has_axis(WireFaultKind kind) {
  return kind == WireFaultKind::kAxisStuck || kind == WireFaultKind::kAxisDrift;
}
bool has_device(WireFaultKind kind) {
  return is_of_exchange(kind) || kind == WireFaultKind::kStaleInPosition ||
         kind == WireFaultKind::kDeviceAlarm;
}
bool has_duration(WireFaultKind kind) {
  return kind == WireFaultKind::kLateAnswer || kind == WireFaultKind::kDroppedConnection ||
         (!is_of_exchange(kind) && kind != WireFaultKind::kDeviceAlarm);
}

WireFault read_fault(JsonObject& json) {
  WireFault fault;
  fault.kind = static_cast<WireFaultKind>(json.choice("kind", names(kWireFaultNames)));
  if (has_device(fault.kind) || json.has("device"))
    fault.device = static_cast<WireDevice>(json.choice("device", names(kWireDeviceNames)));
  if (fault.kind == WireFaultKind::kDeviceAlarm && fault.device == WireDevice::kLaser)
    json.refuse("device", "has no alarm of its own: use interlock_open");
  if (is_of_exchange(fault.kind))
    fault.messages = json.optional_integer("messages", 1, kCountMax).value_or(1);
  if (has_duration(fault.kind)) fault.duration_s = json.quantity("duration_ms", {0, kMaxS * 1e3});
  if (has_axis(fault.kind)) fault.axis = json.choice("axis", names(kAxisNames));
  if (fault.kind == WireFaultKind::kAxisDrift)
    fault.amount = json.quantity(fault.axis == kJ3 ? "speed_mm_s" : "speed_deg_s", {-1e5, 1e5});
  if (fault.kind == WireFaultKind::kPowerLimit) fault.amount = json.number("share", {0, 1});
  read_trigger(json, fault);
  return fault;
}

}  // namespace

FaultScript fault_script_from_json(const std::string& text, const std::string& origin) {
  FaultScript script;
  read_json_object(text, origin,
                   [&](JsonObject& json) {
                     json.objects("faults", kFaultsMax,
                                  [&](JsonObject& fault) { script.push_back(read_fault(fault)); });
                   },
                   {.bytes = kScriptBytesMax});
  return script;
}

FaultScript load_fault_script(const std::filesystem::path& file) {
  return fault_script_from_json(read_text_file(file.string(), kScriptBytesMax), file.string());
}

}  // namespace hilbrush
