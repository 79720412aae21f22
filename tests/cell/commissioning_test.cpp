#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "sampling/base/angles.h"
#include "sim/devices/emission_record.h"
#include "tests/cell/wired_world.h"
#include "tests/daemon/server/daemon_process.h"
#include "tests/support/shell.h"

/// `hilbrush check-cell` and `hilbrush jog`, as processes, against simulated devices on wires:
/// hilbrush-simcell as a process too, and the same devices in this one where the truth behind the wires is
/// looked at.
namespace hilbrush {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::WiredWorld;
using testing_support::CommandResult;
using testing_support::quoted;
using testing_support::TemporaryFolder;

std::string program(const std::string& name) {
  return std::string(HILBRUSH_BUILD_DIR) + "/" + name;
}

CommandResult hilbrush(const std::string& arguments) {
  return testing_support::run_command(quoted(program("hilbrush")) + " " + arguments + " </dev/null");
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// hilbrush-simcell, ready when made, ended with it.
class Simcell {
 public:
  explicit Simcell(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), program("hilbrush-simcell"));
    std::vector<char*> argv;
    for (auto& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    std::array<int, 2> ends{};
    if (::pipe(ends.data()) != 0) throw std::runtime_error("no pipe");
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    ::posix_spawn_file_actions_addclose(&actions, ends[0]);
    const int failure = ::posix_spawn(&pid_, argv[0], &actions, nullptr, argv.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    char byte = 0;
    while (failure == 0 && ::read(ends[0], &byte, 1) == 1 && byte != '\n') ready_ += byte;
    ::close(ends[0]);
    if (ready_.empty()) throw std::runtime_error("hilbrush-simcell does not get ready");
  }
  ~Simcell() { end(); }
  Simcell(const Simcell&) = delete;
  Simcell& operator=(const Simcell&) = delete;
  int end() {
    if (pid_ <= 0) return 0;
    ::kill(pid_, SIGTERM);
    int status = 0;
    ::waitpid(std::exchange(pid_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  json ready() const { return json::parse(ready_); }

 private:
  pid_t pid_ = -1;
  std::string ready_;
};

class CheckCell : public testing::Test {
 protected:
  Simcell simcell(std::vector<std::string> more = {}) {
    more.insert(more.end(), {"--write-cell", cell, "--record", record, "--start-delay-s", ".1"});
    return Simcell(more);
  }
  json written_cell() const {
    std::ifstream in(cell);
    return json::parse(in);
  }
  void write_cell(const json& changed) const { std::ofstream(cell) << changed.dump(2); }
  CommandResult check() const { return hilbrush("check-cell " + quoted(cell)); }
  json checked() const {
    return json::parse(hilbrush("check-cell --json " + quoted(cell)).output).at("devices");
  }
  static std::string problem_of(const json& device) {
    return device.at("problems").empty() ? "" : device.at("problems").front().get<std::string>();
  }

  TemporaryFolder folder;
  const std::string cell = (folder / "cell.json").string();
  const std::string record = (folder / "emissions.ply").string();
};

TEST_F(CheckCell, AFitCellIsSaidToBeFitAndNothingMovesOrShines) {
  for (const char* table : {"oriental-az", "cia402", "leadshine-pr"}) {
    SCOPED_TRACE(table);
    Simcell devices = simcell({"--table", table});
    EXPECT_TRUE(devices.ready().at("ready"));
    const json before = checked();
    for (const char* device : {"robot", "table", "laser"}) {
      EXPECT_TRUE(before.at(device).at("fit")) << before.dump();
      EXPECT_FALSE(before.at(device).at("found").empty());
    }
    const CommandResult result = check();
    EXPECT_EQ(result.exit_code, 0) << result.output;
    EXPECT_TRUE(has(result.output, "robot (dobot): fit\n")) << result.output;
    EXPECT_TRUE(has(result.output, "laser (obis): fit\n")) << result.output;
    EXPECT_TRUE(has(result.output, "j1 is at ")) << result.output;
    EXPECT_EQ(checked(), before) << "states and positions are the same";
    EXPECT_EQ(devices.end(), 0);
    EXPECT_TRUE(read_emission_record(record).empty());
  }
}

TEST_F(CheckCell, WhatIsUnfitIsNamedAndTheExitCodeTells) {
  const Simcell devices = simcell();
  const json written = written_cell();
  json changed = written;
  changed["laser"]["power_max_mw"] = 10 * changed["laser"]["power_max_mw"].get<double>();
  write_cell(changed);
  CommandResult result = check();
  EXPECT_EQ(result.exit_code, 5) << result.output;
  EXPECT_TRUE(has(result.output, "laser (obis): NOT FIT")) << result.output;
  EXPECT_TRUE(has(result.output, "the cell file says ")) << result.output;
  EXPECT_TRUE(has(result.output, "table (oriental-az): fit")) << result.output;

  changed = written;
  changed["devices"]["robot"]["axes"]["j1"]["offset_deg"] = 500;
  write_cell(changed);
  result = check();
  EXPECT_EQ(result.exit_code, 5) << result.output;
  EXPECT_TRUE(has(result.output, "wrong sign, offset or scale?")) << result.output;

  changed = written;
  changed["devices"]["robot"]["dashboard_port"] = 1;
  write_cell(changed);
  const json found = checked();
  EXPECT_TRUE(has(problem_of(found.at("robot")), ":1")) << found.dump();
  EXPECT_TRUE(found.at("table").at("fit")) << "a device that is absent hides no other";
  EXPECT_EQ(check().exit_code, 5);
}

TEST_F(CheckCell, AnOpenInterlockAndAnAlarmAreNotFit) {
  const std::string faults = folder.write("faults.json", R"({"faults": [
    {"kind": "interlock_open", "at_s": 0, "duration_ms": 80000000},
    {"kind": "device_alarm", "device": "table", "at_s": 0}]})");
  const Simcell devices = simcell({"--faults", faults});
  const json found = checked();
  EXPECT_TRUE(has(problem_of(found.at("laser")), "interlock")) << found.dump();
  EXPECT_FALSE(found.at("table").at("fit")) << found.dump();
  EXPECT_TRUE(found.at("robot").at("fit")) << found.dump();
}

TEST_F(CheckCell, ACellThatADaemonDrivesIsLeftAlone) {
  const Simcell devices = simcell();
  test::DaemonWorld world;
  world.options.cell = cell;
  world.options.time_scale.reset();
  const test::DaemonProcess daemon(world.options);
  test::connect(world.options);
  for (const std::string& command :
       {"check-cell " + quoted(cell), "jog j1 --by-deg 1 --yes --cell " + quoted(cell)}) {
    const CommandResult result = hilbrush(command);
    EXPECT_EQ(result.exit_code, 5) << result.output;
    EXPECT_TRUE(has(result.output, "another process drives this cell")) << result.output;
  }
}

/// Scaled time; the truth is at hand.
class Jog : public testing::Test {
 protected:
  CommandResult jog(const std::string& arguments) {
    return hilbrush("jog " + arguments + " --cell " + quoted(world.cell_file().string()));
  }
  Joints joints() {
    Joints now{};
    world.wire().act([&](TrueCell& truth) { now = truth.joints(); });
    return now;
  }
  bool may_emit() {
    bool is_ordered = false;
    world.wire().act(
        [&](TrueCell& truth) { is_ordered = truth.is_emission_ordered() || truth.is_gate_open(); });
    return is_ordered;
  }
  /// That axis by so much, and no other at all.
  void expect_step(const Joints& before, std::size_t axis, double step) {
    const Joints after = joints();
    for (std::size_t i = 0; i < kAxisCount; ++i)
      EXPECT_NEAR(after[i] - before[i], i == axis ? step : 0, 2e-5) << kAxisNames[i];
    EXPECT_FALSE(may_emit());
    EXPECT_TRUE(world.emissions().empty());
  }

  WiredWorld world{WiredWorld::quick(.05), WiredWorld::Drivers::kNone};
};

TEST_F(Jog, MovesOneAxisByItsSignInTheDark) {
  struct Step {
    const char* flags;
    std::size_t axis;
    double step;
  };
  for (const Step& step : {Step{"j1 --by-deg 3", kJ1, 3 * kDegree}, Step{"j1 --by-deg=-5", kJ1, -5 * kDegree},
                           Step{"j3 --by-mm=-4", kJ3, -.004}, Step{"a --by-deg 2.5", kTilt, 2.5 * kDegree},
                           Step{"c --by-deg=-15", kRotation, -15 * kDegree}}) {
    SCOPED_TRACE(step.flags);
    const Joints before = joints();
    const CommandResult result = jog(std::string(step.flags) + " --yes");
    EXPECT_EQ(result.exit_code, 0) << result.output;
    EXPECT_TRUE(has(result.output, " is at ")) << result.output;
    expect_step(before, step.axis, step.step);
  }
}

TEST_F(Jog, FollowsTheCellFilesSign) {
  const std::string file = world.cell_file().string();
  std::ifstream in(file);
  json cell = json::parse(in);
  cell["devices"]["table"]["axes"]["c"]["sign"] = -1;
  std::ofstream(file) << cell.dump(2);
  const Joints before = joints();
  EXPECT_EQ(jog("c --by-deg 4 --yes").exit_code, 0);
  expect_step(before, kRotation, -4 * kDegree);
}

TEST_F(Jog, RefusesWhatItMustNotDoAndMovesNothing) {
  const Joints before = joints();
  struct Refusal {
    const char* flags;
    int exit_code;
    const char* part;
  };
  for (const Refusal& refusal :
       {Refusal{"j1 --by-deg 1", 5, "nothing was moved"}, Refusal{"j1 --by-deg 16 --yes", 3, "at most 15"},
        Refusal{"j1 --by-deg 0 --yes", 3, "at most"}, Refusal{"j1 --by-mm 1 --yes", 3, "degrees"},
        Refusal{"j3 --by-deg 1 --yes", 3, "millimeters"}, Refusal{"j3 --by-mm 21 --yes", 3, "at most 20"},
        Refusal{"j3 --by-mm nan --yes", 3, "at most 20"}, Refusal{"j5 --by-deg 1 --yes", 2, "AXIS"},
        Refusal{"j1 --yes", 3, "degrees"}}) {
    SCOPED_TRACE(refusal.flags);
    const CommandResult result = jog(refusal.flags);
    EXPECT_EQ(result.exit_code, refusal.exit_code) << result.output;
    EXPECT_TRUE(has(result.output, refusal.part)) << result.output;
  }
  expect_step(before, kJ1, 0);
}

TEST_F(Jog, StopsAtTheCellFilesLimits) {
  double stroke_mm = 0;
  CommandResult result;
  for (int i = 0; i < 60; ++i) {
    result = jog("j3 --by-mm 20 --yes");
    if (result.exit_code != 0) break;
    stroke_mm += 20;
  }
  EXPECT_EQ(result.exit_code, 5) << result.output;
  EXPECT_TRUE(has(result.output, "its limits are")) << result.output;
  EXPECT_LE(joints()[kJ3], world.description.axes[kJ3].max + 1e-6);
  EXPECT_NEAR(joints()[kJ3], world.description.axes[kJ3].home + stroke_mm * 1e-3, 1e-5);
}

TEST_F(Jog, NeedsALaserThatIsProvedOff) {
  const Joints before = joints();
  WireFault fault;
  fault.kind = WireFaultKind::kDroppedConnection;
  fault.device = WireDevice::kLaser;
  fault.trigger.at_s = world.wire().now_s();
  fault.messages = 1000;
  fault.duration_s = 1e5;
  world.wire().add_fault(fault);
  const CommandResult result = jog("j1 --by-deg 1 --yes");
  EXPECT_EQ(result.exit_code, 5) << result.output;
  expect_step(before, kJ1, 0);
}

}  // namespace
}  // namespace hilbrush
