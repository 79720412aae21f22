#include "daemon/pipeline/planning_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string>

#include "sampling/base/angles.h"
#include "sampling/base/text.h"
#include "sampling/quality/plot.h"
#include "sim/film/canvas.h"
#include "sim/film/orthographic_view.h"
#include "sim/film/views.h"

namespace hilbrush {
namespace {

constexpr Color kBackground{104, 116, 130};
constexpr Color kSurface{150, 152, 154};
constexpr Color kBackFace{126, 106, 92};
constexpr Color kInk{245, 245, 245};
constexpr Color kExposed{225, 228, 226};
constexpr Color kRetract{255, 255, 255};
constexpr int kPad = 12;
constexpr int kViewPixels = 400;
constexpr int kScale = 2;
constexpr int kText = 7 * kScale;

enum Row { kReach, kIncidence, kPath, kRowCount };
constexpr std::array<const char*, kRowCount> kRowNames{"reach", "incidence", "path"};

/// Indexed by SkipReason.
constexpr std::array<Color, kSkipReasonCount> kReasonColors{{{120, 30, 160},
                                                             {20, 80, 220},
                                                             {240, 130, 0},
                                                             {225, 20, 30},
                                                             {110, 60, 10},
                                                             {0, 0, 0},
                                                             {0, 130, 120},
                                                             {235, 80, 190}}};

/// The color at `share` of a scale with evenly spaced colors.
Color ramp(std::span<const Color> colors, double share) {
  const double position = std::clamp(share, 0., 1.) * static_cast<double>(colors.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(position), colors.size() - 2);
  const double between = position - static_cast<double>(i);
  Color color;
  for (std::size_t k = 0; k < color.size(); ++k)
    color[k] =
        static_cast<std::uint8_t>(std::lround(colors[i][k] + (colors[i + 1][k] - colors[i][k]) * between));
  return color;
}

/// Dark blue along the normal, through pale yellow, to dark red at the limit of 45 degrees.
Color incidence_color(double incidence) {
  constexpr std::array<Color, 5> kColors{
      {{49, 54, 149}, {116, 173, 209}, {254, 224, 144}, {244, 109, 67}, {165, 0, 38}}};
  return ramp(kColors, incidence / (45 * kDegree));
}

/// From the first exposure (violet) to the last (yellow). The hues are far enough apart that only exposures
/// near in time look alike.
Color order_color(double share) {
  constexpr std::array<Color, 6> kColors{
      {{70, 10, 120}, {50, 70, 200}, {20, 150, 190}, {40, 180, 90}, {170, 205, 50}, {250, 230, 30}}};
  return ramp(kColors, share);
}

/// One view of the object, to draw rows of dots on.
class ViewSheet {
 public:
  ViewSheet(const TexturedMesh& mesh, const ViewDirection& direction, double pixel_m)
      : view_(mesh, direction, pixel_m, 2), tolerance_m_(2 * pixel_m) {}

  int width() const { return view_.width(); }
  int height() const { return view_.height(); }
  std::optional<Eigen::Vector2i> pixel_of(const Eigen::Vector3d& p_O) const {
    return view_.pixel_of(p_O, tolerance_m_);
  }

  bool shows_back_faces() const {
    for (int y = 0; y < view_.height(); ++y)
      for (int x = 0; x < view_.width(); ++x)
        if (view_.pixel(x, y).side == OrthographicView::Side::kBack) return true;
    return false;
  }

  void draw_surface(Canvas& canvas, int left, int top) const {
    for (int y = 0; y < view_.height(); ++y)
      for (int x = 0; x < view_.width(); ++x) {
        const auto side = view_.pixel(x, y).side;
        if (side == OrthographicView::Side::kBackground) continue;
        canvas.set(left + x, top + y, side == OrthographicView::Side::kFront ? kSurface : kBackFace);
      }
  }

 private:
  OrthographicView view_;
  double tolerance_m_;
};

/// Draws the three rows of a view.
struct PlanDrawing {
  const DotSequence& dots;
  const Plan& plan;
  int mark_radius;  ///< half the pitch in pixels: dots cover the surface between them

  void reach(const ViewSheet& view, Canvas& canvas, int left, int top) const {
    const auto mark = [&](std::size_t dot, const Color& color, int radius) {
      if (const auto pixel = view.pixel_of(dots.dots[dot].position_O))
        canvas.mark(left + pixel->x(), top + pixel->y(), radius, color);
    };
    for (const Exposure& exposure : plan.program.exposures) mark(exposure.dot_index, kExposed, mark_radius);
    for (const SkippedDot& skipped : plan.skipped)
      mark(skipped.dot_index, skip_reason_color(skipped.reason), std::max(mark_radius, 1));
  }

  void incidence(const ViewSheet& view, Canvas& canvas, int left, int top) const {
    for (const Exposure& exposure : plan.program.exposures)
      if (const auto pixel = view.pixel_of(exposure.position_O))
        canvas.mark(left + pixel->x(), top + pixel->y(), mark_radius,
                    incidence_color(static_cast<double>(exposure.incidence)));
  }

  void path(const ViewSheet& view, Canvas& canvas, int left, int top) const {
    const auto& exposures = plan.program.exposures;
    const Eigen::Vector2i corner(left, top);
    std::vector<Eigen::Vector2i> retracts;
    Eigen::Vector2i last = corner;
    bool is_last_seen = false;
    for (std::size_t i = 0; i < exposures.size(); ++i) {
      const auto pixel = view.pixel_of(exposures[i].position_O);
      const Eigen::Vector2i here = pixel ? Eigen::Vector2i(corner + *pixel) : corner;
      const bool is_retracted = !plan.program.vias_before(i).empty();
      if (pixel && is_retracted) retracts.push_back(here);
      if (pixel && is_last_seen && !is_retracted)
        canvas.line(last.x(), last.y(), here.x(), here.y(),
                    order_color(static_cast<double>(i) / static_cast<double>(exposures.size())));
      last = here;
      is_last_seen = pixel.has_value();
    }
    for (const Eigen::Vector2i& at : retracts) canvas.mark(at.x(), at.y(), 1, kRetract);
  }
};

void write_legend_entry(Canvas& canvas, int& left, int top, const Color& color, const std::string& text) {
  canvas.mark(left + kText / 2, top + kText / 2, kText / 2, color);
  canvas.write(left + kText + kPad / 2, top, text, kScale, kInk);
  left += kText + 2 * kPad + Canvas::text_width(text, kScale);
}

void write_legend(Canvas& canvas, Row row, int top, const Plan& plan, bool has_back_faces) {
  int left = kPad;
  if (row == kReach) {
    std::array<std::size_t, kReasonColors.size()> counts{};
    for (const SkippedDot& skipped : plan.skipped) ++counts[static_cast<std::size_t>(skipped.reason)];
    write_legend_entry(canvas, left, top, kExposed,
                       std::to_string(plan.program.exposures.size()) + " exposed");
    for (std::size_t r = 0; r < counts.size(); ++r)
      if (counts[r] > 0)
        write_legend_entry(canvas, left, top, kReasonColors[r],
                           std::to_string(counts[r]) + " " + skip_reason_name(static_cast<SkipReason>(r)));
    if (has_back_faces) write_legend_entry(canvas, left, top, kBackFace, "surface seen from behind");
  } else if (row == kIncidence) {
    for (const int degrees : {0, 10, 20, 30, 40, 45})
      write_legend_entry(canvas, left, top, incidence_color(degrees * kDegree),
                         std::to_string(degrees) + " deg");
  } else {
    write_legend_entry(canvas, left, top, order_color(0), "first");
    write_legend_entry(canvas, left, top, order_color(.5), "half way");
    write_legend_entry(canvas, left, top, order_color(1), "last");
    write_legend_entry(canvas, left, top, kRetract, "after a retract");
  }
}

/// 3725.4 -> "1:02 h"; less than a minute in seconds.
std::string hours_text(double seconds) {
  const auto minutes = static_cast<long long>(std::floor(seconds / 60 + .5));
  if (minutes < 1) return amount(seconds) + " s";
  const std::string rest = std::to_string(minutes % 60);
  return std::to_string(minutes / 60) + ":" + (rest.size() < 2 ? "0" : "") + rest + " h";
}

struct TimeUnit {
  const char* name;
  double seconds;
};

/// So that the numbers at the axis are short.
TimeUnit time_unit(double total_s) {
  constexpr double kMinute = 60;
  constexpr double kHour = 3600;
  if (total_s >= 2 * kHour) return {"hours so far", kHour};
  if (total_s >= 2 * kMinute) return {"minutes so far", kMinute};
  return {"seconds so far", 1};
}

}  // namespace

Plot time_plot(const CellDescription& cell, const ExposureProgram& program) {
  constexpr std::size_t kMaxPoints = 400;
  const std::size_t step = std::max<std::size_t>(1, program.exposures.size() / kMaxPoints);
  const TimeSplit total = estimate_time(cell, program);
  const double total_s = total.total_s();
  const TimeUnit unit = time_unit(total_s);
  const auto part = [total_s](const char* name, double seconds) {
    const auto percent = static_cast<int>(std::lround(100 * seconds / std::max(total_s, 1e-9)));
    return PlotSeries{std::string(name) + " " + hours_text(seconds) + ", " + std::to_string(percent) + " %",
                      {}};
  };
  std::array<PlotSeries, 5> series{PlotSeries{"in all " + hours_text(total_s), {}},
                                   part("move", total.move_s), part("settle", total.settle_s),
                                   part("expose", total.expose_s), part("retract", total.retract_s)};
  estimate_time(cell, program, [&](std::size_t exposure, const TimeSplit& so_far) {
    if (exposure % step != 0 && exposure + 1 != program.exposures.size()) return;
    const auto x = static_cast<double>(exposure + 1);
    const std::array<double, 5> seconds{so_far.total_s(), so_far.move_s, so_far.settle_s, so_far.expose_s,
                                        so_far.retract_s};
    for (std::size_t k = 0; k < series.size(); ++k)
      series[k].points.emplace_back(x, seconds[k] / unit.seconds);
  });
  return {"Where the time goes",         "exposures", unit.name, false, false, 0., {},
          {series.begin(), series.end()}};
}

Color skip_reason_color(SkipReason reason) {
  return kReasonColors[static_cast<std::size_t>(reason)];
}

Picture planning_sheet(const TexturedMesh& mesh, const DotSequence& dots, const Plan& plan) {
  const auto [low, high] = bounds(mesh);
  const double pixel_m = (high - low).maxCoeff() / kViewPixels;
  const PlanDrawing drawing{dots, plan,
                            std::clamp(static_cast<int>(dots.pitch_m / pixel_m / 2), 0, kViewPixels / 20)};
  std::vector<std::pair<const char*, ViewSheet>> views;
  int width = kPad;
  int height = 0;
  for (const ViewDirection& direction : picture_views()) {
    views.emplace_back(direction.name, ViewSheet(mesh, direction, pixel_m));
    const std::string longest = std::string(direction.name) + ", " + kRowNames[kIncidence];
    width += std::max(views.back().second.width(), Canvas::text_width(longest, kScale)) + kPad;
    height = std::max(height, views.back().second.height());
  }
  const bool has_back_faces = std::any_of(views.begin(), views.end(),
                                          [](const auto& view) { return view.second.shows_back_faces(); });
  constexpr int kMinWidth = 900;  // pixels, so that the legends fit
  const int row_height = 2 * (kText + kPad) + height + kPad;
  Canvas canvas(std::max(width, kMinWidth), kRowCount * row_height + kPad, kBackground);
  for (int row = 0; row < kRowCount; ++row) {
    int left = kPad;
    const int top = kPad + row * row_height;
    for (const auto& [name, view] : views) {
      const std::string caption = std::string(name) + ", " + kRowNames[static_cast<std::size_t>(row)];
      const int column = std::max(view.width(), Canvas::text_width(caption, kScale));
      const int x = left + (column - view.width()) / 2;
      const int y = top + kText + kPad + (height - view.height()) / 2;
      canvas.write(left, top, caption, kScale, kInk);
      view.draw_surface(canvas, x, y);
      if (row == kReach)
        drawing.reach(view, canvas, x, y);
      else if (row == kIncidence)
        drawing.incidence(view, canvas, x, y);
      else
        drawing.path(view, canvas, x, y);
      left += column + kPad;
    }
    write_legend(canvas, static_cast<Row>(row), top + kText + kPad + height + kPad, plan, has_back_faces);
  }
  return canvas.picture();
}

std::vector<std::filesystem::path> write_planning_pictures(const TexturedMesh& mesh, const DotSequence& dots,
                                                           const Plan& plan, const CellDescription& cell,
                                                           const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files{folder / "planning.png"};
  save_png(planning_sheet(mesh, dots, plan), files.back());
  if (!plan.program.exposures.empty()) {
    files.push_back(folder / "time.svg");
    write_svg(svg_of(time_plot(cell, plan.program)), files.back());
  }
  return files;
}

}  // namespace hilbrush
