// The cost of the wire: a program painted through the real drivers against the device servers of sim/wire,
// beside the same program on the cell in process; how the time of a dot is divided; and the time from a stop
// to light off.
//
//   wire_bench [STOPS]                        a generated program of 150 dots, 60 of them in real time, 40
//   stops wire_bench ahead                          the gain from messages sent ahead, in real time
//   wire_bench MODEL SIZE_MM DPI SCALE REAL STOPS
//
// paints MODEL at SCALE wall seconds for each second of the cell, then its first REAL dots in real time, then
// measures STOPS.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <thread>

#include "config/cell_file.h"
#include "daemon/pipeline/pipeline.h"
#include "drivers/driver_error.h"
#include "planner/cell_model/program_file.h"
#include "sampling/images/image_file.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sim/devices/sim_cell.h"
#include "sim/film/beam.h"
#include "sim/film/film.h"
#include "tests/bench/answer_hash.h"
#include "tests/cell/wired_world.h"
#include "tests/support/temporary_folder.h"

namespace {

using namespace hilbrush;
using test::painted_in_process;
using test::WiredWorld;
using Wall = std::chrono::steady_clock;

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

ExposureProgram planned(const std::string& model, double size_mm, double dpi) {
  const testing_support::TemporaryFolder folder;
  JobSettings settings;
  settings.size_mm = size_mm;
  settings.dpi = dpi;
  run_plan({model, settings, find_cell("default"), folder.path()}, {});
  return read_program(folder.path() / "program.ply");
}

/// The time that dots take beyond the devices' own times.
void print_added_times(const std::vector<TimeRecord::Dot>& dots) {
  std::vector<double> before;
  std::vector<double> after;
  std::vector<double> both;
  for (const TimeRecord::Dot& dot : dots) {
    before.push_back(dot.before_s);
    after.push_back(dot.after_s);
    both.push_back(dot.before_s + dot.after_s);
  }
  std::printf(
      "  added a dot, ms of the cell: median %.3f, p99 %.3f, worst %.3f (before the light %.3f / %.3f, after "
      "it %.3f / "
      "%.3f)\n",
      quantile(both, .5) * 1e3, quantile(both, .99) * 1e3, quantile(both, 1) * 1e3,
      quantile(before, .5) * 1e3, quantile(before, .99) * 1e3, quantile(after, .5) * 1e3,
      quantile(after, .99) * 1e3);
}

/// Paints on the wire and prints how the time is divided between devices, drivers and executor.
std::vector<Emission> painted_on_wire(const ExposureProgram& program, double time_scale) {
  WiredWorld world(WiredWorld::quick(time_scale));
  ExecutionControl control;
  world.recover(control);
  Journal journal = Journal::in_memory(program.exposures.size());
  const auto begun = Wall::now();
  ExecutionResult result = execute(program, {}, world.cell(), world.description, journal, control);
  // On a busy machine the laser's guard may miss its heartbeat and stop the job, which goes on then.
  constexpr int kMaxResumes = 1000;
  int resumes = 0;
  while (result.outcome != ExecutionOutcome::kFinished && resumes < kMaxResumes) {
    if (++resumes <= 3) std::printf("  stopped: %s\n", result.reason.c_str());
    world.recover(control, 100);
    const auto robot = world.cell().robot.status().positions;
    const auto table = world.cell().table.status().positions;
    const Joints here{robot[0], robot[1], robot[2], robot[3], table[0], table[1]};
    const ExecutionResult more = execute(program, {here}, world.cell(), world.description, journal, control);
    const double before_s = result.elapsed_s;
    DurationHistogram own_time = result.own_time;
    own_time.add(more.own_time);
    result = more;
    result.elapsed_s += before_s;
    result.own_time = own_time;
  }
  const double wall_s = std::chrono::duration<double>(Wall::now() - begun).count();
  std::printf("scale %g: %zu of %zu dots, %zu in doubt, %d stops; %.1f s of the cell, %.1f s wall\n",
              time_scale, journal.done_count(), program.exposures.size(), journal.in_doubt().size(), resumes,
              result.elapsed_s, wall_s);
  print_added_times(world.wire().dot_times());
  std::printf("  the same by the executor's own watch: median %.3f, p99 %.3f, worst %.3f\n",
              result.own_time.quantile_s(.5) * 1e3, result.own_time.quantile_s(.99) * 1e3,
              result.own_time.longest_s() * 1e3);
  return world.emissions();
}

/// Of the emissions in process, those that belong to the ones on the wire: a dot that was left in doubt may
/// have none.
std::vector<Emission> aligned(const std::vector<Emission>& in_process, const std::vector<Emission>& on_wire) {
  constexpr double kSamePlace = 1e-4;
  std::vector<Emission> found;
  std::size_t next = 0;
  for (const Emission& emission : on_wire) {
    const auto is_there = [&](const Emission& other) {
      for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        if (std::abs(other.joints[axis] - emission.joints[axis]) > kSamePlace) return false;
      return true;
    };
    while (next < in_process.size() && !is_there(in_process[next])) ++next;
    if (next == in_process.size()) break;
    found.push_back(in_process[next++]);
  }
  return found;
}

void compare(const std::vector<Emission>& in_process, const std::vector<Emission>& on_wire,
             const CellDescription& description) {
  double worst_m = 0, worst_power = 0;
  const std::size_t count = std::min(in_process.size(), on_wire.size());
  AnswerHash hash;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d a = beam_from_joints(description, in_process[i].joints).focus_O;
    const Eigen::Vector3d b = beam_from_joints(description, on_wire[i].joints).focus_O;
    worst_m = std::max(worst_m, (a - b).norm());
    const double energy_a = in_process[i].power_w * in_process[i].length_s;
    const double energy_b = on_wire[i].power_w * on_wire[i].length_s;
    worst_power = std::max(worst_power, std::abs(energy_a - energy_b) / energy_a);
    hash.take(b.x());
  }
  std::printf("focus to focus at most %.3f um; energies differ by at most %.4f %%; hash %016llx\n",
              worst_m * 1e6, worst_power * 100, hash.value());
}

/// Hits on the object's surface, as the film takes them.
void compare_films(const std::string& model, double size_mm, const std::vector<Emission>& in_process,
                   const std::vector<Emission>& on_wire, const CellDescription& description, double pitch_m) {
  const Model loaded = load_model(model, load_image_file);
  PlacementOptions placement;
  placement.size_m = size_mm * 1e-3;
  const TexturedMesh mesh = place_on_table(loaded, placement);
  Film one(mesh, description, pitch_m), other(mesh, description, pitch_m);
  const auto hits = one.expose(in_process), others = other.expose(on_wire);
  std::vector<double> away;
  std::size_t missed = 0;
  for (std::size_t i = 0; i < std::min(hits.size(), others.size()); ++i) {
    if (hits[i].is_hit != others[i].is_hit) ++missed;
    if (hits[i].is_hit && others[i].is_hit)
      away.push_back((hits[i].position_O - others[i].position_O).norm() * 1e6);
  }
  std::printf(
      "hits on the surface: %zu compared, apart by median %.3f, p99 %.3f, at most %.3f um; %zu hit only "
      "once\n",
      away.size(), quantile(away, .5), quantile(away, .99), quantile(away, 1), missed);
}

/// The same device, without messages sent ahead.
template <std::size_t N>
class ToldInTime final : public AxisGroup<N> {
 public:
  using Positions = typename AxisGroup<N>::Positions;
  explicit ToldInTime(AxisGroup<N>& axes) : axes_(axes) {}
  void connect() override { axes_.connect(); }
  void enable() override { axes_.enable(); }
  void home() override { axes_.home(); }
  void disable() noexcept override { axes_.disable(); }
  void clear_fault() override { axes_.clear_fault(); }
  void move_to(const Positions& target, double settle_s) override { axes_.move_to(target, settle_s); }
  typename AxisGroup<N>::Status status() override { return axes_.status(); }
  double expected_arrival_s() override { return axes_.expected_arrival_s(); }
  void stop() noexcept override { axes_.stop(); }

 private:
  AxisGroup<N>& axes_;
};
class LaserToldInTime final : public Laser {
 public:
  explicit LaserToldInTime(Laser& laser) : laser_(laser) {}
  void connect() override { laser_.connect(); }
  Limits limits() override { return laser_.limits(); }
  void enable() override { laser_.enable(); }
  void disable() noexcept override { laser_.disable(); }
  void fire(double power_w, double pulse_s) override { laser_.fire(power_w, pulse_s); }
  bool off() noexcept override { return laser_.off(); }
  Status status() override { return laser_.status(); }
  void clear_fault() override { laser_.clear_fault(); }

 private:
  Laser& laser_;
};

/// The table moves for every dot, each with another power; a chain of waypoints of the arm before every
/// tenth.
ExposureProgram restless_job(const CellDescription& cell, std::size_t count) {
  ExposureProgram program = test::small_job(cell, count, 1, count);
  program.vias.clear();
  for (std::size_t i = 0; i < count; ++i) {
    Exposure& exposure = program.exposures[i];
    exposure.joints[kTilt] = .01 * static_cast<double>(i % 3);
    exposure.joints[kRotation] = .02 * static_cast<double>(i % 5);
    exposure.power_w *= i % 2 == 0 ? 1.f : .5f;
    if (i % 10 != 9) continue;
    Joints via = program.exposures[i - 1].joints;
    for (int step = 1; step <= 6; ++step) {
      via[kJ3] += .003;
      program.vias.push_back({static_cast<std::uint32_t>(i), via});
    }
  }
  return program;
}

double seconds_a_dot(WiredWorld& world, const ExposureProgram& program, const Cell& cell) {
  ExecutionControl control;
  world.recover(control, 20);
  Journal journal = Journal::in_memory(program.exposures.size());
  const ExecutionResult result = execute(program, {}, cell, world.description, journal, control);
  if (result.outcome != ExecutionOutcome::kFinished) std::printf("  stopped: %s\n", result.reason.c_str());
  return result.elapsed_s / static_cast<double>(std::max<std::size_t>(journal.done_count(), 1));
}

void measure_ahead() {
  constexpr std::size_t kDots = 100;
  constexpr int kRounds = 3;
  using Table = WireOptions::Table;
  for (const auto& [name, table] :
       {std::pair{"oriental-az", Table::kOrientalAz}, std::pair{"cia402", Table::kCia402},
        std::pair{"leadshine-pr", Table::kLeadshinePr}}) {
    WireOptions options = WiredWorld::quick(1, .01);
    options.table = table;
    WiredWorld world(options);
    const ExposureProgram program = restless_job(world.description, kDots);
    const Cell cell = world.cell();
    ToldInTime<4> robot(cell.robot);
    ToldInTime<2> slow_table(cell.table);
    LaserToldInTime laser(cell.laser);
    std::vector<double> ahead, in_time;
    for (int round = 0; round < kRounds; ++round) {
      in_time.push_back(seconds_a_dot(world, program, {robot, slow_table, laser, cell.clock}));
      ahead.push_back(seconds_a_dot(world, program, cell));
    }
    std::printf("%s, %zu dots, %d rounds: %.3f ms a dot told in time, %.3f ms told ahead\n", name, kDots,
                kRounds, quantile(in_time, .5) * 1e3, quantile(ahead, .5) * 1e3);
  }
}

/// In real time: long pulses, each stopped at a random moment.
void measure_stops(int stops) {
  WiredWorld world(WiredWorld::quick(1, .01));
  std::mt19937 random(1);
  std::vector<double> latencies;
  int lost = 0;
  for (int i = 0; i < 3 * stops && latencies.size() < static_cast<std::size_t>(stops); ++i) {
    ExecutionControl control;
    world.recover(control, 20);
    const Cell cell = world.cell();
    const auto positions = cell.robot.status().positions;
    cell.robot.move_to(positions, 0);
    while (!cell.robot.status().in_position) cell.clock.sleep_until(cell.clock.now_s() + .002);
    try {
      cell.laser.fire(.01, .05);
    } catch (const DriverError&) {  // on a busy machine its guard may have turned it off
      ++lost;
      continue;
    }
    std::this_thread::sleep_for(std::chrono::microseconds(5000 + random() % 35'000));
    const double asked_s = world.wire().now_s();
    const bool is_confirmed = request_stop(cell, control);
    const auto emissions = world.emissions();
    if (!is_confirmed || emissions.empty()) {
      ++lost;
      continue;
    }
    latencies.push_back(emissions.back().start_s + emissions.back().length_s - asked_s);
  }
  std::printf(
      "stops: %zu measured, %d without light or word; from the call to the light's end: median %.3f ms, p99 "
      "%.3f ms, "
      "worst %.3f ms\n",
      latencies.size(), lost, quantile(latencies, .5) * 1e3, quantile(latencies, .99) * 1e3,
      quantile(latencies, 1) * 1e3);
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  if (argc == 2 && std::string(argv[1]) == "ahead") {
    measure_ahead();
    return 0;
  }
  const bool has_model = argc > 6;
  const double time_scale = has_model ? std::atof(argv[4]) : .05;
  const std::size_t real_dots = has_model ? static_cast<std::size_t>(std::atoi(argv[5])) : 60;
  const int stops = has_model ? std::atoi(argv[6]) : argc > 1 ? std::atoi(argv[1]) : 40;
  const CellDescription description = test::shipped_cell();
  ExposureProgram program = has_model ? planned(argv[1], std::atof(argv[2]), std::atof(argv[3]))
                                      : test::small_job(description, 150);
  const auto in_process = painted_in_process(program, description);
  const auto on_wire = painted_on_wire(program, time_scale);
  const auto beside = aligned(in_process, on_wire);
  std::printf("%zu emissions in process, %zu on the wire, of which %zu stand beside each other\n",
              in_process.size(), on_wire.size(), beside.size());
  compare(beside, on_wire, description);
  if (has_model) compare_films(argv[1], std::atof(argv[2]), beside, on_wire, description, program.pitch_m);
  program.exposures.resize(std::min(program.exposures.size(), real_dots));
  std::erase_if(program.vias,
                [&](const Via& via) { return via.before_exposure >= program.exposures.size(); });
  painted_on_wire(program, 1);
  measure_stops(stops);
  return 0;
}
