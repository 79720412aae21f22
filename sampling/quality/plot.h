#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

/// Plots that a person can read: SVG text, written without a library. For figures of quality; nothing here measures.
namespace hilbrush {

/// One curve of a plot.
struct PlotSeries {
  enum class Style { kLine, kMarks, kBars };
  std::string name;                     ///< in the legend; none if empty
  std::vector<Eigen::Vector2d> points;  ///< (x, y)
  Style style = Style::kLine;
};

struct Plot {
  std::string title, x_label, y_label;
  bool is_log_x = false, is_log_y = false;  ///< values that are not positive are left out
  std::optional<double> y_least, y_most;    ///< else from the points
  std::vector<PlotSeries> series;
};
std::string svg_of(const Plot& plot);

/// Dots, and a path through places, in a picture with equal scales; y upwards.
struct PointPicture {
  std::string title;
  std::vector<Eigen::Vector2d> points;
  double radius = 0;                  ///< of a dot, in the points' units
  std::vector<Eigen::Vector2d> path;  ///< drawn thin, under the dots
};
/// Several side by side.
std::string svg_of(std::span<const PointPicture> pictures, const std::string& title = {});

/// Parallel projection from (1, turn_deg around +z, height_deg above the xy plane) onto a plane; y of the result is up.
Eigen::Vector2d project(const Eigen::Vector3d& place, double turn_deg, double height_deg);

/// @throws InputError naming the file if it can't be written.
void write_svg(const std::string& svg, const std::filesystem::path& file);

}  // namespace hilbrush
