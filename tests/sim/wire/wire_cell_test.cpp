#include "sim/wire/wire_cell.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <mutex>
#include <thread>

#include "config/cell_file.h"
#include "config/json_reader.h"
#include "config/wired_cell_file.h"
#include "tests/sim/wire/wire_world.h"

/// The real sockets and pseudo-terminals, spoken to with nothing but bytes.
namespace hilbrush {
namespace {

using test::from_hex;

class Caller {
 public:
  static Caller to_port(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
    EXPECT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    return Caller(fd);
  }
  static Caller to_terminal(const std::string& path) {
    return Caller(::open(path.c_str(), O_RDWR | O_NOCTTY));
  }
  explicit Caller(int fd) : fd_(fd) {}
  ~Caller() { ::close(fd_); }
  Caller(const Caller&) = delete;
  Caller& operator=(const Caller&) = delete;

  std::string ask(const std::string& bytes, std::size_t reply_bytes) {
    EXPECT_EQ(::write(fd_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
    return read(reply_bytes);
  }
  /// This many bytes, or what came before the other side closed or went silent for 5 s.
  std::string read(std::size_t count) {
    std::string bytes;
    while (bytes.size() < count) {
      pollfd waiting{fd_, POLLIN, 0};
      if (::poll(&waiting, 1, 5000) <= 0) break;
      std::array<char, 2048> buffer;
      const ssize_t got = ::read(fd_, buffer.data(), std::min(buffer.size(), count - bytes.size()));
      if (got <= 0) break;
      bytes.append(buffer.data(), static_cast<std::size_t>(got));
    }
    return bytes;
  }

 private:
  int fd_;
};

std::uint16_t port_of(const std::string& url) {
  return static_cast<std::uint16_t>(std::stoi(url.substr(url.rfind(':') + 1)));
}

WireOptions scaled(double time_scale) {
  WireOptions options = test::WireWorld::quick();
  options.time_scale = time_scale;
  return options;
}

TEST(WireCellTest, APulseOverTheWireIsOnRecord) {
  WireCell cell(test::small_cell(), scaled(.01));
  std::mutex mutex;
  std::vector<Emission> emissions;
  cell.set_emission_sink([&](const Emission& emission) {
    const std::lock_guard lock(mutex);
    emissions.push_back(emission);
  });
  Caller dashboard = Caller::to_port(cell.endpoints().dashboard_port);
  Caller motion = Caller::to_port(cell.endpoints().motion_port);
  Caller laser = Caller::to_port(port_of(cell.endpoints().laser_port));
  EXPECT_EQ(dashboard.ask("EnableRobot()", 19), "0,{},EnableRobot();");
  while (dashboard.ask("RobotMode()", 18) != "0,{5},RobotMode();") std::this_thread::yield();
  EXPECT_EQ(laser.ask("SOUR:AM:EXT DIGITAL\r\n", 4), "OK\r\n");
  EXPECT_EQ(laser.ask("SOUR:POW:LEV:IMM:AMPL 0.02\r\n", 4), "OK\r\n");
  EXPECT_EQ(laser.ask("SOUR:AM:STAT ON\r\n", 4), "OK\r\n");
  EXPECT_EQ(motion.ask("DO(1,1)wait(7)DO(1,0)Sync()", 51),
            "0,{},DO(1,1);0,{},wait(7);0,{},DO(1,0);0,{},Sync();");
  const std::lock_guard lock(mutex);
  ASSERT_EQ(emissions.size(), 1u);
  EXPECT_EQ(emissions[0].length_s, .007);
  EXPECT_FALSE(emissions[0].is_moving);
}

TEST(WireCellTest, FramesFlowAndARegisterBankAnswers) {
  WireCell cell(test::small_cell(), scaled(.1));
  Caller feedback = Caller::to_port(cell.endpoints().feedback_port);
  const std::string frames = feedback.read(10 * 1440);
  ASSERT_EQ(frames.size(), 14400u);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(frames.substr(i * 1440, 2), from_hex("A0 05"));
  Caller table = Caller::to_port(cell.endpoints().table_tcp_port);
  EXPECT_EQ(table.ask(from_hex("00 05 00 00 00 06 01 03 00 7F 00 01"), 11),
            from_hex("00 05 00 00 00 05 01 03 02 40 30"));
}

TEST(WireCellTest, PseudoTerminalsCarryModbusRtuAndScpi) {
  WireOptions options = scaled(.1);
  options.is_table_serial = options.is_laser_serial = true;
  WireCell cell(test::small_cell(), options);
  for (int round = 0; round < 3; ++round) {  // opened and closed again
    Caller table = Caller::to_terminal(cell.endpoints().table_serial);
    EXPECT_EQ(table.ask(test::with_crc("01 03 00 7F 00 01"), 7).substr(0, 5), from_hex("01 03 02 40 30"));
    Caller laser = Caller::to_terminal(cell.endpoints().laser_port);
    EXPECT_EQ(laser.ask("SYST:AUT?\r", 9), "OFF\r\nOK\r\n");
  }
}

TEST(WireCellTest, ADroppedConnectionIsClosedAndCanBeMadeAgain) {
  WireCell cell(test::small_cell(), scaled(.001));
  Caller first = Caller::to_port(cell.endpoints().dashboard_port);
  EXPECT_EQ(first.ask("RobotMode()", 18), "0,{4},RobotMode();");
  cell.add_fault({.kind = WireFaultKind::kDroppedConnection,
                  .device = WireDevice::kRobot,
                  .trigger = {},
                  .messages = 1,
                  .duration_s = 0});
  EXPECT_EQ(first.ask("RobotMode()", 18), "");
  Caller second = Caller::to_port(cell.endpoints().dashboard_port);
  EXPECT_EQ(second.ask("RobotMode()", 18), "0,{4},RobotMode();");
  EXPECT_EQ(cell.faults_begun(), 1u);
  EXPECT_EQ(cell.message_count(WireDevice::kRobot), 3u);
}

TEST(WireCellTest, ASlowReaderOfFramesHoldsUpNobody) {
  WireCell cell(test::small_cell(), scaled(.0005));
  Caller feedback = Caller::to_port(cell.endpoints().feedback_port);
  Caller dashboard = Caller::to_port(cell.endpoints().dashboard_port);
  for (int i = 0; i < 300; ++i) ASSERT_EQ(dashboard.ask("RobotMode()", 18), "0,{4},RobotMode();");
}

TEST(WireCellTest, WritesACellFileThatNamesItsEndpoints) {
  WireCell cell(test::small_cell(), scaled(.5));
  const std::string shipped = read_text_file(find_cell("default").string(), 1u << 20);
  const std::string text = wired_cell_text(shipped, cell.endpoints(), .5);
  EXPECT_NE(text.find("\"dashboard_port\": " + std::to_string(cell.endpoints().dashboard_port)),
            std::string::npos);
  EXPECT_NE(text.find(cell.endpoints().laser_port), std::string::npos);
  EXPECT_NE(text.find("\"time_scale\": 0.5"), std::string::npos);
  EXPECT_THROW(wired_cell_text("[1]", cell.endpoints(), 1), InputError);
}

TEST(WireCellTest, RefusesAClockThatStandsStill) {
  EXPECT_THROW(WireCell(test::small_cell(), scaled(0)), std::invalid_argument);
}

}  // namespace
}  // namespace hilbrush
