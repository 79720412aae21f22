#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "planner/poses/shared_beams.h"

/// Stations: where table, yaw and elbow stand while the dots that share one beam direction are exposed. The
/// direction is fixed in O only; tilt and elbow are free, rotation and yaw follow from the tilt with two
/// solutions. Of these, each direction gets the one with which exposing its dots and visiting the stations
/// takes the least time.
namespace hilbrush {

struct Station {
  double tilt = 0, rotation = 0, yaw = 0;
  Elbow elbow = Elbow::kPositive;
};

/// The dots of a station, in the order in which they are to be exposed.
struct Tour {
  Station station;
  bool is_placed = false;  ///< the station is given; else place_stations() looks for one
  Eigen::Vector3d beam_O = Eigen::Vector3d::Zero();
  std::vector<std::uint32_t> dots;  ///< indices into DotsToPose
};

/// Joints that expose the dot from the station, if arm, quill and links fit; windings nearest to the
/// reference.
std::optional<Joints> joints_at(const Reach& reach, const Station& station, const Eigen::Vector3d& position_O,
                                const Joints& reference);

/// Gives each tour its station and puts the tours into the order in which they are visited: a tour of tours
/// by exchanges, then the cheapest stations along it (Viterbi), from home to home. Tours without any possible
/// station are removed, and their dots go to `unserved`. Tours whose station is fixed keep it. Cost:
/// O(tours^2) with a few dozen moves each.
void place_stations(const DotsToPose& dots, std::vector<Tour>& tours, std::vector<std::uint32_t>& unserved);

}  // namespace hilbrush
