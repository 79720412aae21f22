#include "drivers/steady_clock.h"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <thread>

#include "drivers/axis_group.h"

namespace hilbrush {
namespace {

TEST(SteadyClock, SleepsNoLessThanAsked) {
  SteadyClock clock;
  const double until = clock.now_s() + .02;
  clock.sleep_until(until);
  EXPECT_GE(clock.now_s(), until);
}

TEST(SteadyClock, APastTimeIsNoSleep) {
  SteadyClock clock;
  clock.sleep_until(-1);
  clock.sleep_until(std::numeric_limits<double>::quiet_NaN());
  EXPECT_LT(clock.now_s(), 5);
}

TEST(SteadyClock, WakeEndsASleepOfAnyLength) {
  for (const double until : {1e3, 1e18, std::numeric_limits<double>::infinity()}) {
    SteadyClock clock;
    std::thread sleeper([&] { clock.sleep_until(until); });
    clock.wake();  // before or during the sleep: both end it
    sleeper.join();
  }
}

TEST(SteadyClock, AWakeWithoutASleeperEndsTheNextSleepOnly) {
  SteadyClock clock;
  clock.wake();
  clock.wake();
  clock.sleep_until(1e3);
  const double until = clock.now_s() + .01;
  clock.sleep_until(until);
  EXPECT_GE(clock.now_s(), until);
}

TEST(DeviceState, EveryStateHasAName) {
  for (int state = 0; state <= static_cast<int>(DeviceState::kFault); ++state)
    EXPECT_STRNE(device_state_name(static_cast<DeviceState>(state)), "unknown");
}

}  // namespace
}  // namespace hilbrush
