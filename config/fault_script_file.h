#pragma once
#include <filesystem>
#include <string>

#include "sim/script/fault_script.h"

/// Fault scripts of the simulated cell on wires, from JSON, read strictly (see json_reader.h):
///
///   {"faults": [
///     {"kind": "late_answer", "device": "table", "at_message": 40, "duration_ms": 300},
///     {"kind": "interlock_open", "phase": "pulse", "occurrence": 12, "delay_ms": 2, "duration_ms": 500},
///     {"kind": "axis_drift", "at_s": 3.5, "axis": "j2", "speed_deg_s": 1.5, "duration_ms": 200},
///     {"kind": "power_limit", "at_s": 10, "share": 0.4, "duration_ms": 1000}]}
///
/// Triggers: `at_s`, `at_message` (number of the device's message, from 1), `phase` (settled, moving,
/// settling, pulse) with `occurrence` and `delay_ms`; at least one of the three. Keys that a kind of fault
/// does not use are errors.
namespace hilbrush {

/// @throws InputError
FaultScript load_fault_script(const std::filesystem::path& file);

/// The same from the file's text; `origin` names it in errors.
FaultScript fault_script_from_json(const std::string& text, const std::string& origin);

}  // namespace hilbrush
