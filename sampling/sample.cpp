#include "sampling/sample.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "sampling/blue.h"
#include "sampling/check.h"
#include "sampling/curve/put_on_surface.h"
#include "sampling/curve/sequence.h"
#include "sampling/input_error.h"

namespace hilbrush {
namespace {

/// Groups of base quads are what threads share out; there are always as many, so that the result does not depend on the
/// threads.
constexpr std::size_t kGroupCount = 128;
/// After so many groups the caller hears how far the work has come.
constexpr std::size_t kGroupsAtOnce = 16;

struct QuadIndex {
  std::uint32_t sheet = 0, quad = 0;
};

/// All base quads in order of the curve, with the mass up to each: mass_before[i] .. mass_before[i + 1] is quad i's
/// stretch.
struct CurveMass {
  std::vector<QuadIndex> quads;
  std::vector<double> mass_before;

  double total() const { return mass_before.back(); }
};

CurveMass measure_curve(const SurfaceCurve::Implementation& curve, const ToneField& tone) {
  CurveMass result;
  for (std::uint32_t s = 0; s < curve.sheets.size(); ++s)
    for (std::uint32_t q = 0; q < curve.sheets[s].base_quads.size(); ++q) result.quads.push_back({s, q});
  result.mass_before.assign(result.quads.size() + 1, 0);
  tbb::parallel_for(std::size_t{0}, result.quads.size(), [&](std::size_t i) {
    const Sheet& sheet = curve.sheets[result.quads[i].sheet];
    result.mass_before[i + 1] = mass_of(sheet, sheet.base_quads[result.quads[i].quad], tone);
  });
  std::partial_sum(result.mass_before.begin(), result.mass_before.end(), result.mass_before.begin());
  return result;
}

/// What one group of base quads leaves behind for the serial end.
struct GroupResult {
  std::vector<std::pair<std::uint64_t, Stratum>> open_strata;  ///< those that may go on in another group
  std::size_t patch_count = 0;
  double painted_area_m2 = 0;
};

class Placement {
 public:
  Placement(const SurfaceCurve::Implementation& curve, const ToneField& tone, const SampleOptions& options,
            const CurveMass& mass, std::uint64_t count)
      : curve_(curve),
        tone_(tone),
        mass_(mass),
        count_(count),
        rule_{mass.total() / static_cast<double>(count), options.omega} {
    if (options.sampler != Sampler::kCentroid) places_.emplace(options.sampler, count, options.seed);
    dots_.resize(count);
  }

  std::vector<Dot> place(SampleReport& report, const Progress& progress) {
    std::vector<GroupResult> results(kGroupCount);
    for (std::size_t begin = 0; begin < kGroupCount; begin += kGroupsAtOnce) {
      tbb::parallel_for(begin, begin + kGroupsAtOnce, [&](std::size_t g) { results[g] = place_group(g); });
      if (progress) progress(static_cast<double>(begin + kGroupsAtOnce) / kGroupCount);
    }
    close_open_strata(results);
    for (const GroupResult& result : results) {
      report.patch_count += result.patch_count;
      painted_area_m2_ += result.painted_area_m2;
    }
    CHECK_EQ(placed_count(), count_);
    return std::move(dots_);
  }

  double painted_area_m2() const { return painted_area_m2_; }

 private:
  /// Mass along the curve where stratum k begins.
  double begin_of(std::uint64_t k) const {
    return k >= count_ ? mass_.total() : mass_.total() * (static_cast<double>(k) / static_cast<double>(count_));
  }
  std::uint64_t stratum_at(double mass) const {
    auto k = static_cast<std::uint64_t>(std::clamp(mass / mass_.total(), 0., 1.) * static_cast<double>(count_));
    k = std::min(k, count_ - 1);
    while (k > 0 && begin_of(k) > mass) --k;
    while (k + 1 < count_ && begin_of(k + 1) <= mass) ++k;
    return k;
  }

  /// First base quad of a group: groups have about equal mass.
  std::size_t group_begin(std::size_t group) const {
    if (group == kGroupCount) return mass_.quads.size();
    const double target = mass_.total() * static_cast<double>(group) / kGroupCount;
    if (group == 0) return 0;
    const auto at = std::lower_bound(mass_.mass_before.begin(), mass_.mass_before.end() - 1, target);
    return static_cast<std::size_t>(at - mass_.mass_before.begin());
  }

  GroupResult place_group(std::size_t group) {
    GroupResult result;
    const std::size_t begin = group_begin(group), end = group_begin(group + 1);
    if (begin >= end) return result;
    Run run{*this, result, mass_.mass_before[begin]};
    for (std::size_t i = begin; i < end; ++i) {
      const double mass = mass_.mass_before[i + 1] - mass_.mass_before[i];
      if (!(mass > 0)) continue;
      run.at = mass_.mass_before[i];
      run.quad_end = mass_.mass_before[i + 1];
      const QuadIndex index = mass_.quads[i];
      const Sheet& sheet = curve_.sheets[index.sheet];
      walk_patches(sheet, index.sheet, sheet.base_quads[index.quad], tone_, rule_, mass,
                   [&](const Patch& patch) { run.take(patch); });
    }
    run.finish(mass_.mass_before[end]);
    return result;
  }

  /// The walk of one group: cuts the patches into strata, or finds the places of a sequence in them.
  struct Run {
    Placement& owner;
    GroupResult& result;
    double at;            ///< mass along the curve
    double quad_end = 0;  ///< the patches of a base quad never reach beyond, whatever rounding says
    std::uint64_t index = owner.first_index(at);
    bool is_first = true;  ///< the stratum may have begun in the group before
    Stratum stratum{};

    void take(const Patch& patch) {
      ++result.patch_count;
      for (const ToneIntegral& integral : patch.integrals) result.painted_area_m2 += integral.area_m2;
      const double end = std::min(at + patch.mass, quad_end);
      if (owner.places_)
        take_places(patch, end);
      else
        cut_strata(patch, end);
      at = end;
    }

    void cut_strata(const Patch& patch, double end) {
      double share = 0;
      while (index + 1 < owner.count_ && owner.begin_of(index + 1) < end) {
        const double next = std::clamp((owner.begin_of(index + 1) - at) / patch.mass, share, 1.);
        add_stretch(stratum, owner.curve_.mesh, patch, share, next);
        share = next;
        close();
      }
      add_stretch(stratum, owner.curve_.mesh, patch, share, 1);
    }

    void close() {
      if (is_first)
        result.open_strata.emplace_back(index, std::move(stratum));
      else
        owner.put_centre(index, stratum);
      is_first = false;
      stratum.clear();
      ++index;
    }

    void take_places(const Patch& patch, double end) {
      for (; index < owner.count_ && owner.place_of(index) < end; ++index) {
        const double share = std::clamp((owner.place_of(index) - at) / patch.mass, 0., 1.);
        owner.put(index, point_at(owner.tone_, patch, share), patch.sheet);
      }
      last_point = point_in_heaviest(owner.tone_, patch);
      last_sheet = patch.sheet;
    }
    SurfacePoint last_point{};
    std::uint32_t last_sheet = 0;

    void finish(double end) {
      if (!owner.places_) {
        result.open_strata.emplace_back(index, std::move(stratum));
        return;
      }
      // Places in the last digits between the last patch and the next group.
      for (; index < owner.count_ && owner.place_of(index) < end; ++index) owner.put(index, last_point, last_sheet);
    }
  };

  double place_of(std::uint64_t index) const { return mass_.total() * places_->at(index); }

  std::uint64_t first_index(double mass) const {
    if (!places_) return stratum_at(mass);
    std::uint64_t low = 0, high = count_;
    while (low < high) {
      const std::uint64_t middle = low + (high - low) / 2;
      if (place_of(middle) < mass)
        low = middle + 1;
      else
        high = middle;
    }
    return low;
  }

  void put(std::uint64_t index, const SurfacePoint& point, std::uint32_t sheet) {
    dots_[index] = make_dot(curve_, tone_, point, curve_.sheets[sheet].component);
  }
  void put_centre(std::uint64_t index, const Stratum& stratum) {
    CHECK(!stratum.is_empty());
    put(index, centre_on_surface(curve_, tone_, stratum), stratum.heaviest().sheet);
  }

  void close_open_strata(std::vector<GroupResult>& results) {
    Stratum stratum;
    std::uint64_t index = 0;
    for (GroupResult& result : results)
      for (auto& [next_index, next] : result.open_strata) {
        if (next_index != index && !stratum.is_empty()) {
          put_centre(index, stratum);
          stratum.clear();
        }
        index = next_index;
        stratum.append(std::move(next));
      }
    if (!stratum.is_empty()) put_centre(index, stratum);
  }

  std::uint64_t placed_count() const {
    return static_cast<std::uint64_t>(
        std::ranges::count_if(dots_, [](const Dot& dot) { return !dot.normal_O.isZero(); }));
  }

  const SurfaceCurve::Implementation& curve_;
  const ToneField& tone_;
  const CurveMass& mass_;
  std::uint64_t count_;
  PatchRule rule_;
  std::optional<Sequence> places_;
  std::vector<Dot> dots_;
  double painted_area_m2_ = 0;
};

std::uint64_t count_of(const SampleOptions& options, double mass) {
  if (options.pitch_m.has_value() == options.dot_count.has_value())
    throw InputError("", "give either dpi or the number of dots, not both and not neither");
  if (!(mass > 0)) {
    if (options.dot_count)
      throw InputError("", "the surface asks for no dots at all: it is blank, white or transparent everywhere");
    return 0;
  }
  double count = 0;
  if (options.pitch_m) {
    if (!(*options.pitch_m > 0) || !std::isfinite(*options.pitch_m))
      throw InputError("", "the pitch must be more than 0 mm");
    count = std::max(1., std::round(mass / (*options.pitch_m * *options.pitch_m)));
  } else {
    count = static_cast<double>(*options.dot_count);
    if (count < 1) throw InputError("", "the number of dots must be at least 1");
  }
  if (count > static_cast<double>(options.dot_limit))
    throw InputError("", "the object would need " + std::to_string(static_cast<std::uint64_t>(std::min(count, 1e18))) +
                             " dots, more than the limit of " + std::to_string(options.dot_limit) +
                             ": lower the dpi or the size");
  return static_cast<std::uint64_t>(count);
}

double path_length(const std::vector<Dot>& dots) {
  double sum = 0;
  for (std::size_t i = 1; i < dots.size(); ++i) sum += (dots[i].position_O - dots[i - 1].position_O).norm();
  return sum;
}

}  // namespace

DotSequence place_dots(const SurfaceCurve& curve, const ToneField& tone, const SampleOptions& options,
                       SampleReport* report, const Progress& progress) {
  CHECK(&curve.mesh() == &tone.mesh());
  if (options.sampler == Sampler::kBlue) return place_blue(curve, tone, options, report, progress);
  const CurveMass mass = measure_curve(curve.implementation(), tone);
  const std::uint64_t count = count_of(options, mass.total());
  SampleReport figures;
  DotSequence sequence;
  sequence.pitch_m = options.pitch_m.value_or(std::sqrt(mass.total() / static_cast<double>(count)));
  if (count == 0) {
    if (report) *report = figures;
    return sequence;
  }
  Placement placement(curve.implementation(), tone, options, mass, count);
  sequence.dots = placement.place(figures, progress);
  figures.path_length_m = path_length(sequence.dots);
  figures.path_constant = figures.path_length_m / std::sqrt(static_cast<double>(count) * placement.painted_area_m2());
  if (report) *report = figures;
  return sequence;
}

}  // namespace hilbrush
