#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <mutex>

#include "config/rpc_errors.h"
#include "tests/daemon/execution/sim_devices.h"
#include "tests/daemon/server/daemon_fixture.h"

/// Acts that take long, stops that overtake them, and devices that answer late: no other client waits.
namespace hilbrush {
namespace {

using test::DaemonWorld;
using test::Json;
using test::LineClient;

/// The test closes and opens it; a thread that passes waits while it is closed.
class Barrier {
 public:
  void close() {
    const std::lock_guard lock(mutex_);
    is_closed_ = true;
  }
  void open() {
    const std::lock_guard lock(mutex_);
    is_closed_ = false;
    changed_.notify_all();
  }
  void pass() {
    std::unique_lock lock(mutex_);
    ++waiting_;
    changed_.notify_all();
    changed_.wait_for(lock, LineClient::kPatience, [this] { return !is_closed_; });
    --waiting_;
  }
  /// Until a thread waits before it.
  bool wait_for_arrival() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, LineClient::kPatience, [this] { return waiting_ > 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_closed_ = false;
  int waiting_ = 0;
};

/// Its reference run does not hear the first stop, as one that came a moment before the run began.
class DeafRobot final : public Robot {
 public:
  DeafRobot(Robot& robot, Barrier& connecting) : robot_(robot), connecting_(connecting) {}
  void connect() override {
    connecting_.pass();
    robot_.connect();
  }
  void enable() override { robot_.enable(); }
  void home() override {
    is_homing = true;
    const auto deadline = std::chrono::steady_clock::now() + LineClient::kPatience;
    while (is_deaf && stops < 2 && std::chrono::steady_clock::now() < deadline)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    is_homing = false;
    robot_.home();
  }
  void disable() noexcept override { robot_.disable(); }
  void clear_fault() override { robot_.clear_fault(); }
  void move_to(const Positions& target, double settle_s) override { robot_.move_to(target, settle_s); }
  Status status() override { return robot_.status(); }
  double expected_arrival_s() override { return robot_.expected_arrival_s(); }
  void stop() noexcept override {
    if (is_homing) ++stops;
    robot_.stop();
  }
  std::atomic<bool> is_deaf{false}, is_homing{false};
  std::atomic<int> stops{0};

 private:
  Robot& robot_;
  Barrier& connecting_;
};

class LateLaser final : public Laser {
 public:
  LateLaser(Laser& laser, Barrier& answering) : laser_(laser), answering_(answering) {}
  void connect() override { laser_.connect(); }
  Limits limits() override { return laser_.limits(); }
  void enable() override { laser_.enable(); }
  void disable() noexcept override { laser_.disable(); }
  void fire(double power_w, double pulse_s) override { laser_.fire(power_w, pulse_s); }
  bool off() noexcept override {
    const bool is_off = laser_.off();
    answering_.pass();
    return is_off;
  }
  Status status() override { return laser_.status(); }
  void clear_fault() override { laser_.clear_fault(); }

 private:
  Laser& laser_;
  Barrier& answering_;
};

class AwkwardDevices final : public CellDevices {
 public:
  AwkwardDevices(const CellDescription& description, Barrier& connecting, Barrier& answering)
      : inner(description), robot(inner.cell().robot, connecting), laser(inner.cell().laser, answering) {}
  Cell cell() override { return {robot, inner.cell().table, laser, inner.cell().clock}; }
  bool is_simulated() const override { return true; }
  void record_emissions(const std::filesystem::path& file) override { inner.record_emissions(file); }

  test::SimDevices inner;
  DeafRobot robot;
  LateLaser laser;
};

class ServerActsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    world.options.make_devices = [this](const CellDescription& description) {
      auto made = std::make_unique<AwkwardDevices>(description, connecting, answering);
      devices = made.get();
      return made;
    };
    world.begin();
    a = std::make_unique<LineClient>(world.options.socket);
    b = std::make_unique<LineClient>(world.options.socket);
  }
  void TearDown() override {
    connecting.open();
    answering.open();
  }
  static std::string request(const char* method) {
    return std::string(R"({"jsonrpc":"2.0","id":"later","method":")") + method + "\"}\n";
  }

  Barrier connecting, answering;
  AwkwardDevices* devices = nullptr;
  DaemonWorld world;
  std::unique_ptr<LineClient> a, b;
};

TEST_F(ServerActsTest, AClearThatConnectsForLongKeepsNobodyWaiting) {
  connecting.close();
  a->send_bytes(request("cell.clear"));
  ASSERT_TRUE(connecting.wait_for_arrival());
  EXPECT_EQ(b->result("cell.status").at("cell").at("state"), "clearing");
  EXPECT_EQ(b->error_code("cell.arm"), kRpcWrongState);
  EXPECT_EQ(b->result("cell.stop").at("cell").at("state"), "stopped")
      << "while the robot is still being connected";
  connecting.open();
  const Json answer = a->read_message();
  EXPECT_EQ(answer.at("error").at("code"), kRpcWrongState) << "the clear was overtaken";
  EXPECT_EQ(b->result("cell.status").at("cell").at("state"), "stopped");
  world.clear_and_arm(*b);
}

TEST_F(ServerActsTest, ALaserThatAnswersLateDelaysTheAnswerToItsStopAndNoOther) {
  world.clear_and_arm(*a);
  answering.close();
  a->send_bytes(request("cell.stop"));
  ASSERT_TRUE(answering.wait_for_arrival());
  const Json cell = b->result("cell.status").at("cell");
  EXPECT_EQ(cell.at("state"), "stopped") << "already";
  EXPECT_EQ(cell.at("laser"), "unconfirmed");
  EXPECT_TRUE(b->result("job.list").at("jobs").empty());
  answering.open();
  EXPECT_EQ(a->read_message().at("result").at("cell").at("laser"), "off");
}

TEST_F(ServerActsTest, AStopIsRepeatedUntilTheExecutorIsAtRestAndNothingElseIsBegun) {
  a->result("cell.clear");
  devices->robot.is_deaf = true;
  a->send_bytes(request("cell.arm"));
  while (!devices->robot.is_homing) std::this_thread::yield();
  EXPECT_EQ(b->result("cell.stop").at("cell").at("state"), "stopped");
  EXPECT_EQ(a->read_message().at("error").at("code"), kRpcWrongState);
  while (devices->robot.is_homing) std::this_thread::yield();
  EXPECT_GE(devices->robot.stops, 2);
  devices->robot.is_deaf = false;
  b->result("cell.clear");  // is answered when the executor is at rest
  const Json cell = b->result("cell.status").at("cell");
  EXPECT_EQ(cell.at("devices").at("table").at("state"), "enabled") << "its reference run was never begun";
  EXPECT_EQ(cell.at("devices").at("laser").at("state"), "connected");
}

TEST_F(ServerActsTest, ManyStopsAtOnceAreAllAnswered) {
  world.clear_and_arm(*a);
  constexpr int kStops = 50;
  for (int i = 0; i < kStops; ++i) {
    a->send_bytes(request("cell.stop"));
    b->send_bytes(request("cell.stop"));
  }
  for (int i = 0; i < kStops; ++i) {
    EXPECT_EQ(a->read_message().at("result").at("cell").at("laser"), "off");
    EXPECT_EQ(b->read_message().at("result").at("cell").at("laser"), "off");
  }
  world.clear_and_arm(*b);
}

}  // namespace
}  // namespace hilbrush
