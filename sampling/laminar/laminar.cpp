#include "sampling/laminar/laminar.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "sampling/base/check.h"
#include "sampling/base/input_error.h"
#include "sampling/curve/dot_triangle.h"
#include "sampling/disk/components.h"
#include "sampling/laminar/contours.h"

namespace hilbrush {
namespace {

using Eigen::Vector3d;

/// Samples of the tone along a contour.
constexpr double kSamplesPerPitch = 8;
/// The search for the pitch that gives a count of dots ends after this many trials, or at this relative
/// error. Dots are then spread along the contours so that the count is exact.
constexpr int kMaxTrials = 8;
constexpr double kCountTolerance = .002;
/// A limit for nonsense settings: 1 m at this many slices is a pitch of 0.1 micrometers.
constexpr double kMaxSlices = 1e7;

SurfacePoint point_on(const ContourPiece& piece, double share) {
  return {piece.triangle, (1 - share) * piece.from_b + share * piece.to_b};
}

/// Walks along a piece in short steps: visit(share of the piece before the step, share after it, asked tone
/// times length).
template <class Visit>
void walk_piece(const ToneField& tone, const ContourPiece& piece, double pitch_m, Visit visit) {
  if (tone.is_blank(piece.triangle)) return;
  const double length = piece.length();
  const auto steps = static_cast<int>(std::clamp(std::ceil(length / pitch_m * kSamplesPerPitch), 1., 1e6));
  for (int i = 0; i < steps; ++i) {
    const double asked = tone.asked(point_on(piece, (i + .5) / steps));
    if (asked > 0) visit(static_cast<double>(i) / steps, (i + 1.) / steps, asked * length / steps);
  }
}

/// Asked tone times length, summed over all slices: what the dots share equally.
double toned_length(const Slices& slices, const ToneField& tone, double pitch_m) {
  std::vector<double> of_slice(slices.count(), 0);
  tbb::parallel_for(std::size_t{0}, slices.count(), [&](std::size_t k) {
    for (const ContourPiece& piece : slices.pieces(k))
      walk_piece(tone, piece, pitch_m, [&](double, double, double mass) { of_slice[k] += mass; });
  });
  double sum = 0;
  for (const double mass : of_slice) sum += mass;
  return sum;
}

/// An estimate of toned_length * pitch: the length of slices on a face is its area times the sine of its
/// slope, over the pitch.
double sliced_mass(const TexturedMesh& mesh, const ToneField& tone) {
  const std::array<Eigen::Vector2d, 3> whole{Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0),
                                             Eigen::Vector2d(0, 1)};
  double mass = 0;
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    const Vector3d normal = mesh.area_vector(t).normalized();
    if (!tone.is_blank(t)) mass += tone.integrate(t, whole).mass * std::hypot(normal.x(), normal.y());
  }
  return mass;
}

/// Also of white triangles, which the field does not know to be blank.
bool is_blank(const TexturedMesh& mesh, const ToneField& tone) {
  const std::array<Eigen::Vector2d, 3> whole{Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0),
                                             Eigen::Vector2d(0, 1)};
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t)
    if (!tone.is_blank(t) && tone.integrate(t, whole).mass > 0) return false;
  return true;
}

/// Slices that give no dot, because there is nothing to paint or because they do not meet it.
[[noreturn]] void throw_unmet(const TexturedMesh& mesh, const ToneField& tone) {
  if (is_blank(mesh, tone))
    throw InputError("", "the surface asks for no dots at all: it is blank, white or transparent everywhere");
  const auto [low, high] = bounds(mesh);
  throw InputError(
      "", fmt::format("horizontal slices (curve laminar) give no dot: the surface to be painted is level, "
                      "or too small for them (the object is {:.3g} mm high); choose the curve hilbert, or "
                      "set the object upright with --up",
                      1e3 * (high.z() - low.z())));
}

double pitch_for(const TexturedMesh& mesh, const ToneField& tone, double mass, std::uint64_t count) {
  const double wanted = static_cast<double>(count);
  double pitch = std::sqrt(mass / wanted);
  double best = 0;
  double best_error = 1e300;
  for (int round = 0; round < kMaxTrials && pitch > 0 && best_error > kCountTolerance; ++round) {
    const double found = toned_length(Slices(mesh, pitch), tone, pitch) / pitch;
    const double error = std::abs(found / wanted - 1);
    if (found > 0 && error < best_error) {
      best_error = error;
      best = pitch;
    }
    pitch = found > 0 ? pitch * std::sqrt(found / wanted) : pitch / 2;
  }
  if (!(best > 0)) throw_unmet(mesh, tone);
  return best;
}

/// Walks along the contours and places dots on the way.
class SliceWalk {
 public:
  SliceWalk(const Surface& surface, const std::vector<std::uint32_t>& component_of, const ToneField& tone,
            double pitch_m, double spacing_m)
      : surface_(surface), component_of_(component_of), tone_(tone), pitch_(pitch_m), spacing_(spacing_m) {}

  void walk_slice(std::vector<Contour> contours) {
    while (!contours.empty()) {
      const std::size_t next = nearest(contours);
      Contour contour = std::move(contours[next]);
      contours.erase(contours.begin() + static_cast<std::ptrdiff_t>(next));
      begin_nearby(contour);
      for (const ContourPiece& piece : contour.pieces) walk(piece);
      here_ = contour.pieces.back().to_O;
    }
  }

  std::vector<Dot> take_dots() { return std::move(dots_); }

 private:
  double distance_to(const Vector3d& place) const { return here_ ? (place - *here_).norm() : 0; }

  /// The contour with the nearest end.
  std::size_t nearest(const std::vector<Contour>& contours) const {
    std::size_t best = 0;
    double best_distance = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < contours.size(); ++i) {
      const auto& pieces = contours[i].pieces;
      const double distance = std::min(distance_to(pieces.front().from_O), distance_to(pieces.back().to_O));
      if (distance < best_distance) {
        best = i;
        best_distance = distance;
      }
    }
    return best;
  }

  /// Makes a closed contour begin at its nearest piece, an open one at its nearer end.
  void begin_nearby(Contour& contour) const {
    auto& pieces = contour.pieces;
    if (contour.is_closed) {
      const auto first = std::min_element(pieces.begin(), pieces.end(), [&](const auto& a, const auto& b) {
        return distance_to(a.from_O) < distance_to(b.from_O);
      });
      std::rotate(pieces.begin(), first, pieces.end());
    } else if (distance_to(pieces.back().to_O) < distance_to(pieces.front().from_O)) {
      std::reverse(pieces.begin(), pieces.end());
      for (ContourPiece& piece : pieces) piece.reverse();
    }
  }

  void walk(const ContourPiece& piece) {
    walk_piece(tone_, piece, pitch_, [&](double from, double to, double mass) {
      const double before = std::exchange(passed_, passed_ + mass);
      for (double next = next_dot(); passed_ >= next; next = next_dot()) {
        const double share = std::clamp((next - before) / mass, 0., 1.);
        dots_.push_back(make_dot(surface_, tone_, point_on(piece, from + share * (to - from)),
                                 component_of_[piece.triangle]));
      }
    });
  }

  /// The toned length at which the next dot is due.
  double next_dot() const { return (static_cast<double>(dots_.size()) + .5) * spacing_; }

  const Surface& surface_;
  const std::vector<std::uint32_t>& component_of_;
  const ToneField& tone_;
  double pitch_, spacing_;
  double passed_ = 0;             ///< toned length so far
  std::optional<Vector3d> here_;  ///< the end of the last contour
  std::vector<Dot> dots_;
};

std::vector<std::uint32_t> components_of(const TexturedMesh& mesh, const Neighbors& neighbors) {
  std::vector<std::uint32_t> component_of(mesh.triangle_count(), 0);
  std::uint32_t number = 0;
  for (const Component& component : find_components(mesh, neighbors)) {
    for (const std::uint32_t t : component.triangles) component_of[t] = number;
    ++number;
  }
  return component_of;
}

double painted_area(const TexturedMesh& mesh, const ToneField& tone) {
  double area = 0;
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t)
    if (!tone.is_blank(t)) area += mesh.area_vector(t).norm();
  return area;
}

}  // namespace

DotSequence place_laminar(const TexturedMesh& mesh, const ToneField& tone, const SampleOptions& options,
                          SampleReport* report, const Progress& progress) {
  check_pitch_or_count(options);
  DotSequence sequence;
  const double mass = sliced_mass(mesh, tone);
  const double pitch = options.pitch_m ? *options.pitch_m : pitch_for(mesh, tone, mass, *options.dot_count);
  check_dot_limit(options,
                  options.dot_count ? static_cast<double>(*options.dot_count) : mass / (pitch * pitch));
  const auto [low, high] = bounds(mesh);
  if ((high.z() - low.z()) / pitch > kMaxSlices)
    throw InputError("", "more than 10,000,000 slices: lower the dpi or the size");
  sequence.pitch_m = pitch;
  const Slices slices(mesh, pitch);
  const double length = toned_length(slices, tone, pitch);
  const std::uint64_t count =
      options.dot_count.value_or(static_cast<std::uint64_t>(std::llround(length / pitch)));
  if (count == 0) {
    if (!is_blank(mesh, tone)) throw_unmet(mesh, tone);
    return sequence;
  }

  const Surface surface(mesh);
  const std::vector<std::uint32_t> component_of = components_of(mesh, surface.neighbors);
  SliceWalk walk(surface, component_of, tone, pitch, length / static_cast<double>(count));
  for (std::size_t k = 0; k < slices.count(); ++k) {
    walk.walk_slice(join(slices.pieces(k)));
    progress.step(k + 1, slices.count());
  }
  sequence.dots = walk.take_dots();
  CHECK_EQ(sequence.dots.size(), count);
  if (report) {
    report->painted_area_m2 = painted_area(mesh, tone);
    report->patch_count = slices.piece_count();
    PathMeter meter(*report);
    meter.follow(sequence.dots);
    meter.finish();
  }
  return sequence;
}

}  // namespace hilbrush
