#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

/// Plots as SVG text, written without a library: the figures of quality reports and of the benchmarks.
namespace hilbrush {

/// One curve of a plot.
struct PlotSeries {
  enum class Style { kLine, kMarks, kBars };
  std::string name;                     ///< in the legend; none if empty
  std::vector<Eigen::Vector2d> points;  ///< (x, y)
  Style style = Style::kLine;
};

struct Plot {
  std::string title;
  std::string x_label;
  std::string y_label;
  bool is_log_x = false;  ///< values that are not positive are left out
  bool is_log_y = false;
  std::optional<double> y_min;  ///< end of the y axis; by default that of the points
  std::optional<double> y_max;
  std::vector<PlotSeries> series;
};
std::string svg_of(const Plot& plot);

/// Dots and a path, drawn with the same scale in x and y; y upwards.
struct PointPicture {
  std::string title;
  std::vector<Eigen::Vector2d> points;
  double radius = 0;                  ///< of a dot, in the points' units
  std::vector<Eigen::Vector2d> path;  ///< drawn thin, under the dots
};
/// Several side by side.
std::string svg_of(std::span<const PointPicture> pictures, const std::string& title = {});

/// Parallel projection from (1, turn_deg around +z, height_deg above the xy plane) onto a plane; y of the
/// result is up.
Eigen::Vector2d project(const Eigen::Vector3d& place, double turn_deg, double height_deg);

/// @throws InputError with the name of the file if it cannot be written.
void write_svg(const std::string& svg, const std::filesystem::path& file);

}  // namespace hilbrush
