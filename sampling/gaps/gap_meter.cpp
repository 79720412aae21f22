#include "sampling/gaps/gap_meter.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sampling/curve/project_to_surface.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Samples of the tone over a disc for its mean.
constexpr int kToneSamples = 24;
/// The nearest dot is searched for up to this multiple of the allowed radius; larger holes count as that
/// large.
constexpr double kMaxRadiusShare = 8;
/// Pieces of a triangle are halved until their radius is this share of the largest gap there ...
constexpr double kFinestPiece = .03;
/// ... and below this share a piece is judged by its mean tone, however noisy it is.
constexpr double kOneTone = .25;

}  // namespace

GapMeter::GapMeter(const Surface& surface, const ToneField& tone, const DotGrid& grid, double limit_m,
                   double darkest)
    : surface_(surface), tone_(tone), grid_(grid), limit_(limit_m), darkest_(darkest) {}

double GapMeter::strictest_m() const {
  return limit_ / std::sqrt(darkest_);
}

double GapMeter::mean_tone(const SurfacePoint& point, double radius_m) const {
  const Vector3d middle = position(surface_.mesh, point);
  const Vector3d normal = face_normal(surface_.mesh, point);
  const Vector3d across = normal.unitOrthogonal();
  const Vector3d along = normal.cross(across);
  double sum = 0;
  for (int k = 0; k < kToneSamples; ++k) {
    // Vogel's sunflower pattern (golden angle): even over the disc.
    const double r = radius_m * std::sqrt((k + .5) / kToneSamples);
    const double turn = k * std::numbers::pi * (3 - std::sqrt(5.));
    const Vector3d target = middle + r * (std::cos(turn) * across + std::sin(turn) * along);
    sum += tone_.asked(walk_towards(surface_, point, target));
  }
  return sum / kToneSamples;
}

GapMeter::Hole GapMeter::hole_at(const SurfacePoint& point, double slack_m) const {
  Hole hole{point, 0, 0};
  const double asked = tone_.asked(point);
  if (!(asked > 0)) return hole;
  const double allowed = limit_ / std::sqrt(asked);
  const Vector3d place = position(surface_.mesh, point);
  const Eigen::Vector3f normal = face_normal(surface_.mesh, point).cast<float>();
  const DotGrid::Nearest nearest = grid_.nearest(place, normal, kMaxRadiusShare * allowed);
  const double radius = nearest.dot == DotGrid::kNone ? kMaxRadiusShare * allowed : nearest.distance_m;
  if (radius + slack_m <= allowed) return hole;
  const double size = (radius + slack_m) * std::sqrt(std::min(asked, mean_tone(point, radius))) / limit_;
  if (size > 1) {
    hole.size = size;
    hole.radius_m = radius;
  }
  return hole;
}

GapMeter::Verdict GapMeter::judge(std::uint32_t triangle, const Corners& corners, const SurfacePoint& center,
                                  double radius_m) const {
  const double strictest = strictest_m();
  const Vector3d place = position(surface_.mesh, center);
  const Eigen::Vector3f normal = face_normal(surface_.mesh, center).cast<float>();
  if (radius_m < strictest && grid_.nearest(place, normal, strictest - radius_m).dot != DotGrid::kNone)
    return Verdict::kCovered;

  std::array<Vector2d, 3> polygon;
  for (std::size_t c = 0; c < 3; ++c) polygon[c] = corners[c].tail<2>();
  const ToneIntegral integral = tone_.integrate(triangle, polygon);
  if (!(integral.mass > 0)) return Verdict::kCovered;
  const double mean = integral.mass / integral.area_m2;
  const double deviation = std::sqrt(std::max(0., integral.square / integral.area_m2 - mean * mean));
  const bool is_small = radius_m * std::sqrt(mean) <= kOneTone * limit_;
  const double tone = std::min(darkest_, is_small ? mean : mean + 2 * deviation);
  const double allowed = limit_ / std::sqrt(tone);
  if (radius_m >= allowed) return Verdict::kTooLarge;
  if (allowed > strictest && grid_.nearest(place, normal, allowed - radius_m).dot != DotGrid::kNone)
    return Verdict::kCovered;
  return radius_m > kFinestPiece * allowed ? Verdict::kTooLarge : Verdict::kSuspect;
}

void GapMeter::find_suspects(std::uint32_t triangle, std::vector<Suspect>& suspects) const {
  if (tone_.is_blank(triangle)) return;
  std::vector<Corners> waiting{{Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()}};
  const auto place_of = [&](const Vector3d& b) { return position(surface_.mesh, {triangle, b}); };
  while (!waiting.empty()) {
    const Corners corners = waiting.back();
    waiting.pop_back();
    std::array<Vector3d, 3> places;
    for (std::size_t c = 0; c < 3; ++c) places[c] = place_of(corners[c]);
    // A ball around the middle of the longest side or around the centroid holds the piece: the smaller one is
    // used.
    std::size_t longest = 0;
    for (std::size_t side = 1; side < 3; ++side)
      if ((places[(side + 1) % 3] - places[side]).norm() >
          (places[(longest + 1) % 3] - places[longest]).norm())
        longest = side;
    const Vector3d middle_b = .5 * (corners[longest] + corners[(longest + 1) % 3]);
    const auto reach = [&](const Vector3d& from) {
      return std::max({(places[0] - from).norm(), (places[1] - from).norm(), (places[2] - from).norm()});
    };
    const SurfacePoint centroid{triangle, (corners[0] + corners[1] + corners[2]) / 3},
        middle{triangle, middle_b};
    const double from_centroid = reach(position(surface_.mesh, centroid));
    const double from_middle = reach(position(surface_.mesh, middle));
    const bool is_centroid = from_centroid <= from_middle;
    const double radius = std::min(from_centroid, from_middle);
    switch (judge(triangle, corners, is_centroid ? centroid : middle, radius)) {
      case Verdict::kCovered:
        break;
      case Verdict::kSuspect:
        suspects.push_back({is_centroid ? centroid : middle, radius});
        break;
      case Verdict::kTooLarge:
        waiting.push_back({corners[(longest + 2) % 3], middle_b, corners[(longest + 1) % 3]});
        waiting.push_back({corners[(longest + 2) % 3], corners[longest], middle_b});
        break;
    }
  }
}

}  // namespace hilbrush
