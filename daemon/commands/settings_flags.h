#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/job_settings.h"

namespace CLI {
class App;
}

/// The settings of a job as flags: --size-mm is the key size_mm, --post-height-mm the key
/// fixture.post_height_mm. Flags override the file that --settings names.
namespace hilbrush {

struct SettingsFlags {
  std::string file;  ///< of --settings; empty: none
  std::optional<double> dpi, size_mm, units_mm, max_incidence_deg, preferred_incidence_deg,
      largest_gap_pitches;
  std::optional<double> post_height_mm, post_radius_mm, plate_radius_mm, turn_deg;
  std::vector<double> offset_mm;  ///< three, or none
  std::optional<std::uint64_t> dots, seed, levels, predictive_rounds, fine_passes;
  std::optional<std::string> up, untextured, sampler, curve, density, tone_curve, planning, order, policy,
      cell;

  /// Declares all flags on `command`; this object must outlive the parsing.
  void add_to(CLI::App& command);
  /// Only the flags that calibrate needs, which paints wedges instead of models.
  void add_paint_flags_to(CLI::App& command);

  bool any() const;  ///< whether any flag was given

  /// The settings given, flags over file, as one JSON object; the path of a cell file becomes absolute.
  /// `base` is JSON to use instead of the file if none was given.
  /// @throws InputError naming the file, or the flag as "--size-mm".
  std::string to_json(const std::string& base = {}, const std::string& base_origin = {}) const;
};

}  // namespace hilbrush
