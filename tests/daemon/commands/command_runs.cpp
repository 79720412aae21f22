#include "tests/daemon/commands/command_runs.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

namespace hilbrush::commands_test {

std::string Peer::read_line() {
  std::size_t end = 0;
  while ((end = buffer_.find('\n')) == std::string::npos) {
    std::array<char, 4096> block;
    const ssize_t count = recv(descriptor_, block.data(), block.size(), 0);
    if (count <= 0) return {};
    buffer_.append(block.data(), static_cast<std::size_t>(count));
  }
  const std::string line = buffer_.substr(0, end);
  buffer_.erase(0, end + 1);
  return line;
}

void Peer::write(const std::string& text) {
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t count = send(descriptor_, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) return;
    sent += static_cast<std::size_t>(count);
  }
}

void Peer::wait_for_close() {
  while (!read_line().empty()) {
  }
}

FakeDaemon::FakeDaemon(std::function<void(Peer&)> script) {
  listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, socket_path().c_str(), sizeof(address.sun_path) - 1);
  if (bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
      listen(listener_, 4) != 0)
    throw std::runtime_error("the fake daemon cannot listen");
  thread_ = std::thread([this, run = std::move(script)] {
    const int connection = accept(listener_, nullptr, nullptr);
    if (connection < 0) return;  // finish() woke accept()
    Peer peer(connection);
    run(peer);
    close(connection);
  });
}

FakeDaemon::~FakeDaemon() {
  finish();
  close(listener_);
}

void FakeDaemon::finish() {
  shutdown(listener_, SHUT_RDWR);  // wakes accept()
  if (thread_.joinable()) thread_.join();
}

AnsweringDaemon::AnsweringDaemon(std::string reply_member)
    : daemon_([this, member = std::move(reply_member)](Peer& peer) {
        for (std::string line = peer.read_line(); !line.empty(); line = peer.read_line()) {
          const auto request = nlohmann::ordered_json::parse(line);
          requests_.push_back(request["method"].get<std::string>() + " " +
                              (request.contains("params") ? request["params"].dump() : "-"));
          peer.write_line(R"({"jsonrpc":"2.0","id":)" + request["id"].dump() + "," + member + "}");
        }
      }) {}

std::vector<std::string> AnsweringDaemon::requests() {
  daemon_.finish();
  return requests_;
}

CommandRun run_command(const std::vector<std::string>& arguments, bool is_terminal, const char* input) {
  std::ostringstream out, err;
  std::istringstream in(input != nullptr ? input : "");
  Terminal terminal{out, err, in, is_terminal, input != nullptr, 80};
  CommandRun run;
  run.exit_code = run_hilbrush(arguments, terminal);
  run.out = out.str();
  run.err = err.str();
  return run;
}

}  // namespace hilbrush::commands_test
