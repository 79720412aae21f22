#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "drivers/guard/guard_codec.h"
#include "drivers/guard/guard_process.h"
#include "drivers/guard/guarded_head.h"
#include "tests/drivers/wired_cell.h"

/// hilbrush-laserguard as a process, in front of a simulated laser that says by itself whether it can emit.
namespace hilbrush::test {
namespace {

using Steady = std::chrono::steady_clock;

std::string guard_program() {
  return std::string(HILBRUSH_BUILD_DIR) + "/hilbrush-laserguard";
}

WireOptions with_laser(WireOptions::LaserHead head) {
  WireOptions options = WiredCell::quick();
  options.laser = head;
  return options;
}

constexpr int kBeatsMissed = 15;

/// A user of the guard that speaks its protocol by hand, so that it can break off at any point.
class GuardTest : public testing::Test {
 protected:
  void start(WireOptions::LaserHead laser = WireOptions::LaserHead::kObis) {
    world = std::make_unique<WiredCell>(with_laser(laser));
    channel = process.start(guard_program(), to_command_line(arguments()));
  }
  ~GuardTest() override {
    hang_up();
    kill_user();
  }

  GuardArguments arguments() const {
    const bool is_cobolt = world->wire.endpoints().laser_driver == "cobolt";
    GuardArguments result{is_cobolt ? "cobolt" : "obis", is_cobolt, world->laser_options(),
                          world->clock.wall_s(1)};
    result.laser.heartbeats_missed = kBeatsMissed;  // more than on a real cell: this machine may be busy
    return result;
  }
  void hang_up() {
    if (channel >= 0) ::close(channel);
    channel = -1;
  }
  void say(const std::string& message) { ::send(channel, message.data(), message.size(), MSG_NOSIGNAL); }
  void beat() { say(std::string(guard::kBeat)); }

  /// Beats until the guard has answered the request.
  guard::Reply ask(guard::Verb verb, double value = 0) {
    const guard::Request request{++number, verb, value};
    say(guard::encode(request));
    const auto deadline = Steady::now() + std::chrono::seconds(10);
    while (Steady::now() < deadline) {
      beat();
      pollfd polled{channel, POLLIN, 0};
      ::poll(&polled, 1, 5);
      std::array<char, guard::kMessageMax> bytes{};
      const ssize_t got = ::recv(channel, bytes.data(), bytes.size(), MSG_DONTWAIT);
      if (got == 0) break;
      if (got < 0) continue;
      const std::string_view message(bytes.data(), static_cast<std::size_t>(got));
      if (const auto heard = guard::decode_status(message)) status = *heard;
      if (const auto reply = guard::decode_reply(message); reply && reply->number == number) return *reply;
    }
    return {number, false, "no answer"};
  }
  /// What the guard says against it, or nothing.
  std::string refusal_of(guard::Verb verb, double value = 0) {
    const guard::Reply reply = ask(verb, value);
    return reply.is_ok ? "" : "refused: " + reply.text;
  }
  void arm() {
    ASSERT_EQ(refusal_of(guard::Verb::kConnect), "");
    ASSERT_EQ(refusal_of(guard::Verb::kArm), "");
    ASSERT_TRUE(is_emission_ordered());
  }
  bool is_emission_ordered() {
    bool is_ordered = false;
    world->wire.act([&](TrueCell& cell) { is_ordered = cell.is_emission_ordered(); });
    return is_ordered;
  }
  /// Wall milliseconds until the laser cannot emit any more, or 5000.
  double milliseconds_until_off() {
    const auto start_time = Steady::now();
    double passed = 0;
    while (passed < 5000 && is_emission_ordered()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      passed = std::chrono::duration<double, std::milli>(Steady::now() - start_time).count();
    }
    return passed;
  }
  /// The guard's exit status; it has 5 s to end.
  int wait_for_exit() {
    int result = -1;
    for (int i = 0; i < 1000; ++i) {
      if (::waitpid(process.pid(), &result, WNOHANG) == process.pid()) return result;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return -1;
  }
  /// A process that does nothing but hold the channel and beat.
  void hand_over_to_child() {
    user = ::fork();
    if (user == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      for (;;) {
        ::send(channel, guard::kBeat.data(), guard::kBeat.size(), MSG_NOSIGNAL);
        ::usleep(5000);
      }
    }
    hang_up();
  }
  void kill_user() {
    if (user <= 0) return;
    ::kill(user, SIGKILL);
    ::waitpid(user, nullptr, 0);
    user = -1;
  }

  std::unique_ptr<WiredCell> world;
  GuardProcess process;
  int channel = -1;
  pid_t user = -1;
  std::uint32_t number = 0;
  guard::StatusMessage status;
};

constexpr double kAllowanceMs = 20 * kBeatsMissed;
constexpr double kSlackMs = 400;  // a busy machine

TEST_F(GuardTest, DisarmsAndEndsWithItsChannel) {
  start();
  arm();
  hang_up();
  EXPECT_LT(milliseconds_until_off(), kSlackMs);
  EXPECT_EQ(wait_for_exit(), 0);
}

TEST_F(GuardTest, DisarmsWhenItsUserIsKilled) {
  start();
  arm();
  hand_over_to_child();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  ASSERT_TRUE(is_emission_ordered());  // for as long as it lives
  kill_user();
  EXPECT_LT(milliseconds_until_off(), kSlackMs);
}

TEST_F(GuardTest, DisarmsWhenItsUserIsStopped) {
  start();
  arm();
  hand_over_to_child();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  ASSERT_TRUE(is_emission_ordered());
  ::kill(user, SIGSTOP);
  EXPECT_LT(milliseconds_until_off(), kAllowanceMs + kSlackMs);
  ::kill(user, SIGCONT);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_FALSE(is_emission_ordered());  // going on changes nothing
}

TEST_F(GuardTest, AMissedHeartbeatLatchesUntilItIsCleared) {
  start();
  arm();
  EXPECT_LT(milliseconds_until_off(), kAllowanceMs + kSlackMs);  // no heartbeat is sent
  const guard::Reply refusal = ask(guard::Verb::kArm);
  EXPECT_FALSE(refusal.is_ok);
  EXPECT_NE(refusal.text.find("heard nothing"), std::string::npos) << refusal.text;
  EXPECT_EQ(status.status.state, DeviceState::kFault);
  EXPECT_FALSE(ask(guard::Verb::kPulse, .005).is_ok);
  ASSERT_EQ(refusal_of(guard::Verb::kClear), "");
  EXPECT_TRUE(ask(guard::Verb::kArm).is_ok);
  EXPECT_TRUE(is_emission_ordered());
}

TEST_F(GuardTest, APulseThatIsNotReportedOverInTimeEndsEmissionAndLatches) {
  start();
  arm();
  say(guard::encode(guard::Request{++number, guard::Verb::kLight, .1}));
  const auto deadline = Steady::now() + std::chrono::seconds(5);
  while (is_emission_ordered() && Steady::now() < deadline) beat();
  EXPECT_FALSE(is_emission_ordered());
  const guard::Reply refusal = ask(guard::Verb::kArm);
  EXPECT_NE(refusal.text.find("received no report in time that a pulse was over"), std::string::npos)
      << refusal.text;
  ASSERT_EQ(refusal_of(guard::Verb::kClear), "");
  EXPECT_TRUE(ask(guard::Verb::kArm).is_ok);
}

TEST_F(GuardTest, APulseThatIsReportedOverDisturbsNothing) {
  start();
  arm();
  say(guard::encode(guard::Request{++number, guard::Verb::kLight, .2}));
  say(guard::encode(guard::Request{++number, guard::Verb::kDark, 0}));
  for (int i = 0; i < 40; ++i) {
    beat();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(is_emission_ordered());
}

TEST_F(GuardTest, GarbageOnTheChannelDisarmsAndEnds) {
  for (const std::string& garbage : {std::string("17 pulse much"), std::string(), std::string("\0\xff\n", 3),
                                     std::string(guard::kMessageMax + 500, 'x'), std::string("1 arm now")}) {
    start();
    arm();
    say(garbage);
    EXPECT_LT(milliseconds_until_off(), kSlackMs);
    EXPECT_TRUE(WIFEXITED(wait_for_exit()));
    hang_up();
  }
}

TEST_F(GuardTest, EveryCatchableSignalDisarms) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGQUIT, SIGUSR1, SIGALRM, SIGTSTP, SIGABRT, SIGSEGV,
                           SIGBUS, SIGFPE, SIGILL, SIGXCPU, SIGRTMIN + 3}) {
    start();
    arm();
    ::kill(process.pid(), signal);
    EXPECT_LT(milliseconds_until_off(), kSlackMs) << "signal " << signal;
    EXPECT_NE(wait_for_exit(), -1) << "signal " << signal;
    hang_up();
  }
}

TEST_F(GuardTest, DisarmingDoesNotWaitForArming) {
  start();
  ASSERT_EQ(refusal_of(guard::Verb::kConnect), "");
  say(guard::encode(guard::Request{++number, guard::Verb::kArm, 0}));  // waits for the start delay
  const auto begun = Steady::now();
  while (!is_emission_ordered() && Steady::now() < begun + std::chrono::seconds(2)) beat();
  ASSERT_EQ(refusal_of(guard::Verb::kDisarm), "");
  EXPECT_FALSE(is_emission_ordered());
  for (int i = 0; i < 20; ++i) {
    beat();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_FALSE(is_emission_ordered());
}

TEST_F(GuardTest, EndsASerialPulseByItselfWhenItsUserIsGone) {
  start(WireOptions::LaserHead::kCobolt);
  ASSERT_EQ(refusal_of(guard::Verb::kConnect), "");
  ASSERT_EQ(refusal_of(guard::Verb::kArm), "");
  ASSERT_EQ(refusal_of(guard::Verb::kPower, .05), "");
  constexpr double kPulseS = .05;  // cell
  ASSERT_EQ(refusal_of(guard::Verb::kPulse, kPulseS), "");
  hang_up();
  EXPECT_LT(milliseconds_until_off(), kSlackMs);
  const auto emissions = world->emissions();
  ASSERT_EQ(emissions.size(), 1u);
  EXPECT_LE(emissions[0].length_s, kPulseS + .03);  // cell seconds: 3 ms of this machine's
  EXPECT_NEAR(emissions[0].power_w, .05, 1e-5);
}

TEST_F(GuardTest, TimesSerialPulses) {
  start(WireOptions::LaserHead::kCobolt);
  ASSERT_EQ(refusal_of(guard::Verb::kConnect), "");
  ASSERT_EQ(refusal_of(guard::Verb::kArm), "");
  ASSERT_EQ(refusal_of(guard::Verb::kPower, .05), "");
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(refusal_of(guard::Verb::kPulse, .03), "");
    do beat();
    while (ask(guard::Verb::kPowers).is_ok && status.is_gate_on);
  }
  ASSERT_EQ(refusal_of(guard::Verb::kGateOff), "");
  const auto emissions = world->emissions();
  ASSERT_EQ(emissions.size(), 5u);
  // The simulated head reads its line when this machine lets it: on a busy one an end may be read late, or
  // together with its beginning, and most ends may be. So the longest speaks for all.
  double longest_s = 0;
  for (const Emission& emission : emissions) longest_s = std::max(longest_s, emission.length_s);
  EXPECT_GE(longest_s, .03 - .02);
  EXPECT_LE(longest_s, .03 + .1);
}

TEST(GuardCommandLine, IsReadAsItWasWritten) {
  GuardArguments arguments{"cobolt", true, {}, .05};
  arguments.laser.port = "/dev/ttyS 1";
  arguments.laser.baud = 9600;
  arguments.laser.heartbeats_missed = 7;
  const GuardArguments read = from_command_line(to_command_line(arguments));
  EXPECT_EQ(read.driver, "cobolt");
  EXPECT_TRUE(read.has_own_gate);
  EXPECT_EQ(read.laser.port, "/dev/ttyS 1");
  EXPECT_EQ(read.laser.baud, 9600);
  EXPECT_EQ(read.laser.heartbeats_missed, 7);
  EXPECT_EQ(read.time_scale, .05);
  for (const std::vector<std::string>& words : {std::vector<std::string>{"--port"},
                                                {"--port", "x", "--driver", "sun"},
                                                {"--driver", "obis"},
                                                {"--port", "x", "--baud", "fast"},
                                                {"--port", "x", "--gate", "own"},
                                                {"--port", "x", "--what", "1"}})
    EXPECT_THROW(from_command_line(words), DriverError) << words[0];
}

/// The user's side.
class GuardedHeadTest : public testing::Test {
 protected:
  GuardedHeadTest() : world(WiredCell::quick()), process(std::make_shared<GuardProcess>()) {
    const GuardArguments arguments{"obis", false, world.laser_options(), world.clock.wall_s(1)};
    auto launch = [this, arguments] { return process->start(guard_program(), to_command_line(arguments)); };
    laser = std::make_unique<GatedLaser>(
        std::make_unique<GuardedHead>(launch, GuardedHead::Options{}, world.clock), world.robot->gate(1),
        world.laser_limits(), world.clock);
  }
  WiredCell world;
  std::shared_ptr<GuardProcess> process;
  std::unique_ptr<GatedLaser> laser;
};

TEST_F(GuardedHeadTest, FiresLikeAHeadInTheSameProcess) {
  laser->connect();
  WiredCell::make_ready(*world.robot);
  laser->enable();
  auto target = world.robot->status().positions;
  target[0] += .01;
  world.robot->move_to(target, .02);
  ASSERT_TRUE(world.wait_for([&] { return world.robot->status().in_position; }));
  for (int i = 0; i < 3; ++i) {
    laser->fire(.05, .005);
    ASSERT_TRUE(world.wait_for([&] { return !laser->status().is_emitting; }));
  }
  EXPECT_EQ(laser->status().state, DeviceState::kReady) << laser->status().fault;
  EXPECT_EQ(world.emissions().size(), 3u);
  EXPECT_EQ(laser->identify().back(), "guarded by a process of its own");
}

/// Takes pulses and never says that one is over.
class StuckGate final : public Gate {
 public:
  double resolution_s() const override { return 0; }
  void pulse(double) override { is_on_ = true; }
  bool off() noexcept override { return !is_on_; }
  bool is_on() override { return is_on_; }
  void set_listener(Listener) override {}

 private:
  std::atomic<bool> is_on_{false};
};

TEST_F(GuardedHeadTest, AGateThatNeverReportsAPulsesEndEndsEmission) {
  StuckGate gate;
  const GuardArguments arguments{"obis", false, world.laser_options(), world.clock.wall_s(1)};
  auto launch = [&] { return process->start(guard_program(), to_command_line(arguments)); };
  GatedLaser stuck(std::make_unique<GuardedHead>(launch, GuardedHead::Options{}, world.clock), gate,
                   world.laser_limits(), world.clock);
  stuck.connect();
  stuck.enable();
  const auto is_armed = [&] {
    bool is_ordered = false;
    world.wire.act([&](TrueCell& cell) { is_ordered = cell.is_emission_ordered(); });
    return is_ordered;
  };
  ASSERT_TRUE(is_armed());
  stuck.fire(.05, .005);
  EXPECT_TRUE(world.wait_for([&] { return !is_armed(); }, 60));
  EXPECT_TRUE(world.wait_for([&] { return stuck.status().state == DeviceState::kFault; }));
  EXPECT_NE(stuck.status().fault.find("pulse was over"), std::string::npos) << stuck.status().fault;
}

TEST_F(GuardedHeadTest, ALostGuardIsAFaultThatClearingMends) {
  laser->connect();
  WiredCell::make_ready(*world.robot);
  laser->enable();
  ::kill(process->pid(), SIGKILL);
  ASSERT_TRUE(world.wait_for([&] { return laser->status().state == DeviceState::kFault; }));
  EXPECT_NE(laser->status().fault.find("guard"), std::string::npos) << laser->status().fault;
  EXPECT_THROW(laser->fire(.05, .005), DriverError);
  laser->clear_fault();
  EXPECT_EQ(laser->status().state, DeviceState::kConnected);
  laser->enable();
  EXPECT_EQ(laser->status().state, DeviceState::kReady);
}

TEST_F(GuardedHeadTest, ASilentGuardIsAFault) {
  laser->connect();
  laser->enable();
  const int pid = process->pid();
  ::kill(pid, SIGSTOP);
  EXPECT_TRUE(world.wait_for([&] { return laser->status().state == DeviceState::kFault; }));
  ::kill(pid, SIGCONT);
  laser->disable();
  laser->clear_fault();
  EXPECT_EQ(laser->status().state, DeviceState::kConnected);
}

TEST_F(GuardedHeadTest, AMissingProgramIsASentence) {
  GuardedHead head([] { return GuardProcess().start("/nonexistent/guard", {}); }, {}, world.clock);
  try {
    head.connect();
    FAIL() << "connected";
  } catch (const DriverError& error) {
    EXPECT_NE(std::string(error.what()).find("cannot be started"), std::string::npos) << error.what();
  }
  EXPECT_EQ(head.status().state, DeviceState::kDisconnected);
}

}  // namespace
}  // namespace hilbrush::test
