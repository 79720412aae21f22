#include "sampling/quality/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>

#include "sampling/base/input_error.h"
#include "sampling/base/text.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;

// Of a plot, in units of the drawing: pixels at 100 %.
constexpr double kWidth = 640;
constexpr double kHeight = 440;
constexpr double kLeftMargin = 76;
constexpr double kRightMargin = 20;
constexpr double kTopMargin = 40;
constexpr double kBottomMargin = 52;
constexpr std::array kColors{"#1b6ca8", "#d1495b", "#2e8b57", "#b8860b",
                             "#6a4c93", "#555555", "#e07a3f", "#008b8b"};

/// Digits of labels and of widths.
constexpr int kDigits = 4;

/// A coordinate in the drawing, to a tenth of its unit.
std::string place(double value) {
  const double tenths = std::round(value * 10) / 10;
  return number(tenths == 0 ? 0 : tenths, 6);
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '&')
      result += "&amp;";
    else
      result += c;
  }
  return result;
}

std::string text_at(double x, double y, const std::string& text, const std::string& attributes = {}) {
  return "<text x=\"" + place(x) + "\" y=\"" + place(y) + "\"" +
         (attributes.empty() ? "" : " " + attributes) + ">" + escaped(text) + "</text>\n";
}

std::string opening(double width, double height) {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + number(width, 6) + "\" height=\"" +
         number(height, 6) + "\" viewBox=\"0 0 " + number(width, 6) + " " + number(height, 6) +
         "\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" "
         "fill=\"white\"/>\n";
}

/// Maps values to coordinates along one side of the drawing.
struct Axis {
  bool is_log;
  double low, high;   ///< values, or their logarithms
  double begin, end;  ///< coordinates in the drawing

  double to_scale(double value) const { return is_log ? std::log10(value) : value; }
  double at(double value) const { return begin + (to_scale(value) - low) / (high - low) * (end - begin); }
  bool shows(double value) const { return !is_log || value > 0; }

  /// Values that get a line and a label.
  std::vector<double> ticks() const {
    std::vector<double> result;
    if (is_log && high - low >= 1.5) {
      const double step = std::max(1., std::ceil((high - low) / 8));
      for (double e = std::ceil(low - 1e-9); e <= high + 1e-9; e += step) result.push_back(std::pow(10, e));
      return result;
    }
    const double from = is_log ? std::pow(10, low) : low;
    const double to = is_log ? std::pow(10, high) : high;
    const double rough = (to - from) / 6;
    const double power = std::pow(10, std::floor(std::log10(rough)));
    const double step = power * (rough / power > 5 ? 10 : rough / power > 2 ? 5 : rough / power > 1 ? 2 : 1);
    for (double value = std::ceil(from / step - 1e-9) * step; value <= to + 1e-9 * step; value += step)
      result.push_back(std::abs(value) < 1e-9 * step ? 0 : value);
    return result;
  }
};

Axis axis_of(const Plot& plot, int coordinate) {
  Axis axis{coordinate == 0 ? plot.is_log_x : plot.is_log_y, std::numeric_limits<double>::infinity(),
            -std::numeric_limits<double>::infinity(), 0, 0};
  for (const PlotSeries& series : plot.series)
    for (const Vector2d& point : series.points) {
      if (!axis.shows(point[coordinate]) || !std::isfinite(point[coordinate])) continue;
      axis.low = std::min(axis.low, axis.to_scale(point[coordinate]));
      axis.high = std::max(axis.high, axis.to_scale(point[coordinate]));
    }
  if (coordinate == 1 && plot.y_min) axis.low = axis.to_scale(*plot.y_min);
  if (coordinate == 1 && plot.y_max) axis.high = axis.to_scale(*plot.y_max);
  if (!(axis.low <= axis.high)) {
    axis.low = 0;
    axis.high = 1;
  }
  if (axis.high - axis.low < 1e-9) {
    axis.low -= .5;
    axis.high += .5;
  }
  axis.begin = coordinate == 0 ? kLeftMargin : kHeight - kBottomMargin;
  axis.end = coordinate == 0 ? kWidth - kRightMargin : kTopMargin;
  return axis;
}

std::string frame_of(const Plot& plot, const Axis& x, const Axis& y) {
  std::string svg;
  for (const double value : x.ticks()) {
    svg += "<path stroke=\"#ddd\" d=\"M" + place(x.at(value)) + " " + place(y.begin) + "V" + place(y.end) +
           "\"/>\n";
    svg += text_at(x.at(value), y.begin + 16, number(value, kDigits), "text-anchor=\"middle\"");
  }
  for (const double value : y.ticks()) {
    svg += "<path stroke=\"#ddd\" d=\"M" + place(x.begin) + " " + place(y.at(value)) + "H" + place(x.end) +
           "\"/>\n";
    svg += text_at(x.begin - 6, y.at(value) + 4, number(value, kDigits), "text-anchor=\"end\"");
  }
  svg += "<path stroke=\"black\" fill=\"none\" d=\"M" + place(x.begin) + " " + place(y.end) + "V" +
         place(y.begin) + "H" + place(x.end) + "\"/>\n";
  svg += text_at((x.begin + x.end) / 2, kHeight - 14, plot.x_label, "text-anchor=\"middle\"");
  const double middle = (y.begin + y.end) / 2;
  svg += text_at(16, middle, plot.y_label,
                 "text-anchor=\"middle\" transform=\"rotate(-90 16 " + place(middle) + ")\"");
  return svg + text_at(kWidth / 2, 22, plot.title, "text-anchor=\"middle\" font-size=\"15\"");
}

std::string line_of(const PlotSeries& series, const Axis& x, const Axis& y, const std::string& color) {
  std::string path;
  bool goes_on = false;
  for (const Vector2d& point : series.points) {
    const bool is_shown = point.allFinite() && x.shows(point.x()) && y.shows(point.y());
    if (is_shown) path += (goes_on ? "L" : "M") + place(x.at(point.x())) + " " + place(y.at(point.y()));
    goes_on = is_shown;
  }
  return "<path fill=\"none\" stroke=\"" + color + "\" stroke-width=\"1.6\" d=\"" + path + "\"/>\n";
}

std::string marks_of(const PlotSeries& series, const Axis& x, const Axis& y, const std::string& color) {
  std::string path;
  for (const Vector2d& point : series.points)
    if (point.allFinite() && x.shows(point.x()) && y.shows(point.y()))
      path += "M" + place(x.at(point.x())) + " " + place(y.at(point.y())) + "h0";
  return "<path fill=\"none\" stroke=\"" + color + "\" stroke-width=\"3\" stroke-linecap=\"round\" d=\"" +
         path + "\"/>\n";
}

/// As wide as the points are apart.
std::string bars_of(const PlotSeries& series, const Axis& x, const Axis& y, const std::string& color) {
  std::string path;
  const double step = series.points.size() > 1 ? x.at(series.points[1].x()) - x.at(series.points[0].x()) : 20;
  for (const Vector2d& point : series.points)
    path += "M" + place(x.at(point.x()) - .45 * step) + " " + place(y.begin) + "V" + place(y.at(point.y())) +
            "h" + place(.9 * step) + "V" + place(y.begin) + "z";
  return "<path fill=\"" + color + "\" d=\"" + path + "\"/>\n";
}

struct Bounds {
  Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity());
  Vector2d high = Vector2d::Constant(-std::numeric_limits<double>::infinity());

  void take(const std::vector<Vector2d>& points) {
    for (const Vector2d& p : points) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
};

/// One picture, its upper left corner at (left, top), `size` high and wide at most.
std::string picture_at(const PointPicture& picture, double left, double top, double size) {
  Bounds bounds;
  bounds.take(picture.points);
  bounds.take(picture.path);
  if (!(bounds.low.x() <= bounds.high.x())) return {};
  const Vector2d extent = bounds.high - bounds.low;
  const double scale = size / std::max({extent.x(), extent.y(), 1e-300});
  const auto to_page = [&](const Vector2d& p) {
    return place(left + scale * (p.x() - bounds.low.x())) + " " +
           place(top + scale * (bounds.high.y() - p.y()));
  };
  std::string svg = text_at(left + size / 2, top - 8, picture.title, "text-anchor=\"middle\"");
  if (!picture.path.empty()) {
    svg += "<path fill=\"none\" stroke=\"#1b6ca8\" stroke-width=\".7\" d=\"M";
    for (std::size_t i = 0; i < picture.path.size(); ++i)
      svg += (i == 0 ? "" : "L") + to_page(picture.path[i]);
    svg += "\"/>\n";
  }
  svg += "<path fill=\"none\" stroke=\"black\" stroke-linecap=\"round\" stroke-width=\"" +
         number(std::max(.2, 2 * scale * picture.radius), kDigits) + "\" d=\"";
  for (const Vector2d& point : picture.points) svg += "M" + to_page(point) + "h0";
  return svg + "\"/>\n";
}

/// The legend is at the top, on the emptier side: on the left if most points of the upper half are on the
/// right.
bool is_upper_half_full_on_the_right(const Plot& plot, const Axis& x, const Axis& y) {
  std::ptrdiff_t balance = 0;
  for (const PlotSeries& series : plot.series)
    for (const Vector2d& point : series.points) {
      if (!point.allFinite() || !x.shows(point.x()) || !y.shows(point.y())) continue;
      if (y.at(point.y()) > (kTopMargin + kHeight - kBottomMargin) / 2) continue;
      balance += x.at(point.x()) > (kLeftMargin + kWidth - kRightMargin) / 2 ? 1 : -1;
    }
  return balance > 0;
}

}  // namespace

std::string svg_of(const Plot& plot) {
  const Axis x = axis_of(plot, 0);
  const Axis y = axis_of(plot, 1);
  std::string svg = opening(kWidth, kHeight) + frame_of(plot, x, y);
  svg += "<clipPath id=\"frame\"><rect x=\"" + place(kLeftMargin - 2) + "\" y=\"" + place(kTopMargin - 2) +
         "\" width=\"" + place(kWidth - kLeftMargin - kRightMargin + 4) + "\" height=\"" +
         place(kHeight - kTopMargin - kBottomMargin + 4) + "\"/></clipPath>\n<g clip-path=\"url(#frame)\">\n";
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const PlotSeries& series = plot.series[i];
    const std::string color = kColors[i % kColors.size()];
    svg += series.style == PlotSeries::Style::kLine    ? line_of(series, x, y, color)
           : series.style == PlotSeries::Style::kMarks ? marks_of(series, x, y, color)
                                                       : bars_of(series, x, y, color);
  }
  svg += "</g>\n";
  const bool is_legend_left = is_upper_half_full_on_the_right(plot, x, y);
  const double legend_x = is_legend_left ? kLeftMargin + 8 : kWidth - kRightMargin - 8;
  const std::string anchor = is_legend_left ? "start" : "end";
  double below = kTopMargin + 16;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    if (plot.series[i].name.empty()) continue;
    svg +=
        text_at(legend_x, below, plot.series[i].name,
                "text-anchor=\"" + anchor + "\" fill=\"" + std::string(kColors[i % kColors.size()]) + "\"");
    below += 16;
  }
  return svg + "</svg>\n";
}

std::string svg_of(std::span<const PointPicture> pictures, const std::string& title) {
  constexpr double kSize = 360;
  constexpr double kGap = 24;
  constexpr double kHead = 56;
  std::string svg =
      opening(kGap + static_cast<double>(pictures.size()) * (kSize + kGap), kSize + kHead + kGap);
  svg += text_at(kGap, 22, title, "font-size=\"15\"");
  for (std::size_t i = 0; i < pictures.size(); ++i)
    svg += picture_at(pictures[i], kGap + static_cast<double>(i) * (kSize + kGap), kHead, kSize);
  return svg + "</svg>\n";
}

Vector2d project(const Eigen::Vector3d& p, double turn_deg, double height_deg) {
  const double turn = turn_deg * std::numbers::pi / 180;
  const double height = height_deg * std::numbers::pi / 180;
  const double x = -std::sin(turn) * p.x() + std::cos(turn) * p.y();
  const double depth = std::cos(turn) * p.x() + std::sin(turn) * p.y();
  return {x, std::cos(height) * p.z() - std::sin(height) * depth};
}

void write_svg(const std::string& svg, const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out << svg;
  out.close();
  if (!out) throw InputError(file.string(), "cannot be written");
}

}  // namespace hilbrush
